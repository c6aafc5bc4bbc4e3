"""A board of markers beside the robot: it tells the scale and the tilt of a photograph."""
