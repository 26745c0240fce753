"""What an arm carries: handled pieces, and the belief in the load meanwhile."""
