"""The `full` level, piecewise variable strain as the paper has it: strains, energy, equations, velocities, its loads.

May use ``robot``, ``model`` and ``kernel``."""
