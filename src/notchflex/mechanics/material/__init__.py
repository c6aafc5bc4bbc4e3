"""Materials: how a cross-section answers strain."""

from notchflex._packages import import_all
from notchflex.mechanics.material.fibre_section import Fibres, FibreSection, NotchEnds
from notchflex.mechanics.material.flattening import Flattening
from notchflex.mechanics.material.law import SectionLaw, SectionResponse, section_law
from notchflex.mechanics.material.peak_strain import SectionStrain, peak_strain, section_strain

import_all(__name__, __path__)

__all__ = [
    "FibreSection",
    "Fibres",
    "Flattening",
    "NotchEnds",
    "SectionLaw",
    "SectionResponse",
    "SectionStrain",
    "peak_strain",
    "section_law",
    "section_strain",
]
