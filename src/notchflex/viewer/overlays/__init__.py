"""Overlays of the robot: a handle at the tip, the reachable cloud, the sensed force."""
