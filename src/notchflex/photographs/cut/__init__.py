"""Notches as they were cut, from photographs of the straight robot."""
