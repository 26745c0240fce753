"""A tracked run: its history, section by section, and its page."""
