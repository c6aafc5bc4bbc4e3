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
    section_law,
)
from notchflex.mechanics.material.strains import (
    CORNERS,
    PLACES,
    LimitLine,
    SectionStrain,
    edge_strain,
    peak_strain,
    section_strain,
)

import_all(__name__, __path__)

__all__ = [
    "CORNERS",
    "PLACES",
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
