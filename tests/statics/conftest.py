"""What the tests of statics share."""

from margins import margin

__all__ = ["margin"]
