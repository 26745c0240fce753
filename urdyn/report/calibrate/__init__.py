"""A calibration: its tables, its words, its page."""
