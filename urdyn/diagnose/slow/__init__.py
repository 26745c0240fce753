"""Slow kinds: moments in, changes that last out; the healthy arm, every onset, and a judge."""
