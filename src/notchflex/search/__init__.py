"""Searches of satellites: bounded least squares, one driver of SLSQP, one set of starts."""
