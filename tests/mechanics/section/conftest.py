"""What the section tests share."""

from margins import margin

__all__ = ["margin"]
