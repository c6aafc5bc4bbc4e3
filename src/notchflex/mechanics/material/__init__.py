"""Materials: how a cross-section answers strain."""

from notchflex._imports import import_all
from notchflex.mechanics.material.law import (
    CORNERS,
    Fibres,
    FibreSection,
    Flattening,
    Law,
    LimitLine,
    MixedLaw,
    NotchEnds,
    SectionLaw,
    SectionResponse,
    SectionStrain,
    edge_strain,
    peak_strain,
    section_law,
    section_strain,
)

import_all(__name__, __path__)

__all__ = [
    "CORNERS",
    "FibreSection",
    "Fibres",
    "Flattening",
    "Law",
    "LimitLine",
    "MixedLaw",
    "NotchEnds",
    "SectionLaw",
    "SectionResponse",
    "SectionStrain",
    "edge_strain",
    "peak_strain",
    "section_law",
    "section_strain",
]
