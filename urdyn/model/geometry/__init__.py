"""The geometry of an arm: its coordinates, its poses, its forms on paper."""
