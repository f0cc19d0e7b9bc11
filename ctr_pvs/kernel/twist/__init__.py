"""Twist, element by element: energy, Newton by condensation, margin, relaxed state, gradient flow."""
