"""Equilibrium of a loaded chain: residual, linear step, Newton's method, continuation."""
