"""The belief in an arm: the states and their prior, how filters hold it, what it means."""
