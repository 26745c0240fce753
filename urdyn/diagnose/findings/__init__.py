"""Findings in a plant's words, and the book that is kept of them."""
