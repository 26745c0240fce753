"""The currents' noise: its colour, its scale, outliers, and currents that are missing."""
