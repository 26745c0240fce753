"""From residuals to findings."""
