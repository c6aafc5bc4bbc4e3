"""Shapes of robots: outline, bent notches, loads that act on them."""
