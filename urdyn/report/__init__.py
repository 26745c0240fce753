"""Tables, plots, one self-contained page."""
