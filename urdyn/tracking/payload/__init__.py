"""What an arm carries: pieces that come and go, and what is known of the load meanwhile."""
