"""Calibration on measured robots."""
