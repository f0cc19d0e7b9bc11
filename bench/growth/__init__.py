"""How the cost grows with the work."""
