"""Stability: what is found, what it costs, and where methods fail."""
