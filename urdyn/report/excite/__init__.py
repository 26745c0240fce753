"""A planned motion: what it will tell, its scene, its page."""
