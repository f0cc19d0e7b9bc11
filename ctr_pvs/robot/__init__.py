"""The robot: tubes and segments, the limits of its commands, and the YAML file it is read from.

May use ``errors`` only, and numpy and yaml; no scipy."""
