"""Streams beside the joints' own sensors: poses and the wrench, at rates of their own."""
