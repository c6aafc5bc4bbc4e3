"""Materials: how a cross-section answers strain."""

from notchflex._imports import import_all
from notchflex.mechanics.material.law import (
    Fibres,
    FibreSection,
    Flattening,
    Law,
    MixedLaw,
    NotchEnds,
    SectionLaw,
    SectionResponse,
    SectionStrain,
    peak_strain,
    section_law,
    section_strain,
)

import_all(__name__, __path__)

__all__ = [
    "FibreSection",
    "Fibres",
    "Flattening",
    "Law",
    "MixedLaw",
    "NotchEnds",
    "SectionLaw",
    "SectionResponse",
    "SectionStrain",
    "peak_strain",
    "section_law",
    "section_strain",
]
