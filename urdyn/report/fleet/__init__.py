"""Several arms on one page."""
