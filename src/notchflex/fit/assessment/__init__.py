"""Assessment of a calibration, and the next measurement."""
