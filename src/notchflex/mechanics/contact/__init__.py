"""Contact: the lips of a notch that close it."""

from notchflex.mechanics.contact.build import lay_lips
from notchflex.mechanics.contact.pairs import LipGroup, Touch
from notchflex.mechanics.contact.spine import closing_travel, free_angle

__all__ = ["LipGroup", "Touch", "closing_travel", "free_angle", "lay_lips"]
