"""The arm in three dimensions, in a browser: replayed from its history, or live."""
