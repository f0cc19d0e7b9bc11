"""The parts of a fit: table, parameters, model and its rates, least squares, report."""
