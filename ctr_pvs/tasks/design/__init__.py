"""The parts of a design: targets, what may vary, limits, the equations and their least squares, search, report."""
