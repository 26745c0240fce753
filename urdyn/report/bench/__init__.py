"""What the benches found: tables, confusions, pages."""
