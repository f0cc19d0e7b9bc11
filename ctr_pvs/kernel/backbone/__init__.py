"""Frames, poses, and how far a change of the unknowns moves them."""
