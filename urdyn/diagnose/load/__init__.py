"""The load at the tool, which is no fault while it comes and goes."""
