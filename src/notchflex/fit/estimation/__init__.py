"""Least squares: objective, minimisation, intervals."""
