"""Mechanics of the parts of a robot, assembled into a chain of rigid bodies and flexures."""
