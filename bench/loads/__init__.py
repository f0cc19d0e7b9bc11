"""Robots under external loads: what they cost, and the figures of docs/loads.md."""
