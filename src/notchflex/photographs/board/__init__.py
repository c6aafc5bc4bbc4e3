"""A board of markers beside the robot: it gives the scale and the tilt of a photograph."""
