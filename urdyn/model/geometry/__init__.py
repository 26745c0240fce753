"""The geometry of an arm: its coordinates, its poses, its conventions."""
