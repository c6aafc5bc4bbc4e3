"""Contact between the edges of a notch that close it."""

from notchflex.mechanics.contact.build import build_contacts
from notchflex.mechanics.contact.pairs import ContactGroup, GapResponse
from notchflex.mechanics.contact.spine import closing_angles, free_angle

__all__ = ["ContactGroup", "GapResponse", "build_contacts", "closing_angles", "free_angle"]
