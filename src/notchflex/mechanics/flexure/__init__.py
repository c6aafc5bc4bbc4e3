"""Flexures: one notch becomes a short rod with a few strain modes."""

from notchflex._imports import import_all
from notchflex.mechanics.flexure.rod import (
    LEVELS,
    MAX_REFINEMENT,
    Rod,
    Site,
    flattened,
    law_error,
    rod,
    rod_at,
    section_fibres,
    stack,
    validity_warnings,
    with_level,
)
from notchflex.mechanics.flexure.rod_kinematics import (
    FlexureState,
    fibre_slope,
    fibre_stretch,
    flexure_state,
    geometric_stiffness,
    in_space,
    material_tangent,
    of_rod,
    relative_pose,
    rotation_error_estimate,
)

import_all(__name__, __path__)

__all__ = [
    "LEVELS",
    "MAX_REFINEMENT",
    "FlexureState",
    "Rod",
    "Site",
    "fibre_slope",
    "fibre_stretch",
    "flattened",
    "flexure_state",
    "geometric_stiffness",
    "in_space",
    "law_error",
    "material_tangent",
    "of_rod",
    "relative_pose",
    "rod",
    "rod_at",
    "rotation_error_estimate",
    "section_fibres",
    "stack",
    "validity_warnings",
    "with_level",
]
