"""Materials: how a cross-section answers strain."""

from notchflex._packages import import_all
from notchflex.mechanics.material.fibre_section import Fibres, FibreSection, NotchEnds
from notchflex.mechanics.material.flattening import Flattening
from notchflex.mechanics.material.law import SectionLaw, SectionResponse, section_law

import_all(__name__, __path__)

__all__ = [
    "FibreSection",
    "Fibres",
    "Flattening",
    "NotchEnds",
    "SectionLaw",
    "SectionResponse",
    "section_law",
]
