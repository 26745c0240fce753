"""Motion -> Fit: what the arm is, and how sure that is."""
