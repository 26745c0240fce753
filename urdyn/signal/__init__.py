"""Log -> Motion."""
