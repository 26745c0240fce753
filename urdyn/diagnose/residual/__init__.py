"""What the commissioned model leaves unexplained: row by row, and as information in moments."""
