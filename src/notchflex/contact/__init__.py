"""Contact: the lips of a notch that close it."""

from notchflex.contact.laying import lay_lips
from notchflex.contact.lip import LipGroup, Touch
from notchflex.contact.spine import closing_travel, free_angle

__all__ = ["LipGroup", "Touch", "closing_travel", "free_angle", "lay_lips"]
