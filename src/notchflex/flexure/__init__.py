"""Flexures: one notch becomes a short rod with a few strain modes."""

from notchflex._packages import import_all
from notchflex.flexure.registry import rod
from notchflex.flexure.rod import Rod
from notchflex.flexure.state import FlexureState, fibre_stretch, flexure_state, relative_pose

import_all(__name__, __path__)

__all__ = ["FlexureState", "Rod", "fibre_stretch", "flexure_state", "relative_pose", "rod"]
