"""Measurements: reading, writing, repeats, simulated ones."""
