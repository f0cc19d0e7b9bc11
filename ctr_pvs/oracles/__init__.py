"""Models that judge the solver without its energy: the boundary-value model, and two tubes in closed form.

May use all rooms up to ``answer``."""
