"""A planned motion: what it will identify, its scene, its page."""
