"""Inverse kinematics: what is reached, how fast, and how near the rest is come to."""
