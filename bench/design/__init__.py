"""Designs for targets of known robots."""
