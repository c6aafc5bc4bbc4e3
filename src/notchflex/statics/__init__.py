"""Statics: loads, balance, Newton's method, states with memory."""

from notchflex.statics.axis_points import AxisPlaces, axis_places, axis_points, points_on_axis
from notchflex.statics.batch import Batch, simulate_batch, solve_batch
from notchflex.statics.closing import Closing, closing
from notchflex.statics.closing_search import ClosingStatus
from notchflex.statics.differentiable import Differentiable, differentiable
from notchflex.statics.equilibrium import Equilibrium
from notchflex.statics.external import BodyForce, ExternalLoad
from notchflex.statics.kinematics import (
    SharedStroke,
    bodies_from_angles,
    equal_stroke,
    tip_from_angles,
)
from notchflex.statics.kinks import Kink
from notchflex.statics.load import Load, LoadPath
from notchflex.statics.newton import Settings
from notchflex.statics.path import EquilibriumPath
from notchflex.statics.prepare import prepared
from notchflex.statics.ramps import pull, stroke_path
from notchflex.statics.recorded import BEFORE, TOLD, Recorded
from notchflex.statics.solve import simulate, solve, solve_each
from notchflex.statics.state import SavedState, State
from notchflex.statics.tip_response import TipResponse, tip_response

__all__ = [
    "BEFORE",
    "TOLD",
    "AxisPlaces",
    "Batch",
    "BodyForce",
    "Closing",
    "ClosingStatus",
    "Differentiable",
    "Equilibrium",
    "EquilibriumPath",
    "ExternalLoad",
    "Kink",
    "Load",
    "LoadPath",
    "Recorded",
    "SavedState",
    "Settings",
    "SharedStroke",
    "State",
    "TipResponse",
    "axis_places",
    "axis_points",
    "bodies_from_angles",
    "closing",
    "differentiable",
    "equal_stroke",
    "points_on_axis",
    "prepared",
    "pull",
    "simulate",
    "simulate_batch",
    "solve",
    "solve_batch",
    "solve_each",
    "stroke_path",
    "tip_from_angles",
    "tip_response",
]
