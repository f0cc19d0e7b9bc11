"""What users do with many equilibria: fit a robot to measurements, find the command for a tip, lead it along a path."""
