"""The friction rig: a coefficient of friction from two hanging weights."""
