"""How far a calibration can be trusted, and what to measure next."""
