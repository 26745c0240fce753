"""Where samples come from: recordings and live robots, and what their streams lacked."""
