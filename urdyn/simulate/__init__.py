"""The virtual arm: the ground truth of every test."""
