"""An identified arm and its validation: tables and pages."""
