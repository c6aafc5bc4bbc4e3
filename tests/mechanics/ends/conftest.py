"""What the tests of the ends of a notch share."""

from margins import margin

__all__ = ["margin"]
