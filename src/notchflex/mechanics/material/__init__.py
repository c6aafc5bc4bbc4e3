"""Materials: how a cross-section answers strain."""

from notchflex._packages import import_all
from notchflex.mechanics.material.law import FibreSection, Response, SectionLaw, section_law

import_all(__name__, __path__)

__all__ = ["FibreSection", "Response", "SectionLaw", "section_law"]
