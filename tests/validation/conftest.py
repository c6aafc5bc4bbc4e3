"""What the validation tests share."""

from margins import margin

__all__ = ["margin"]
