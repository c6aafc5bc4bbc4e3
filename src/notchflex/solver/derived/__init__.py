"""Quantities that follow from a converged state."""
