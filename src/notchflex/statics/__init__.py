"""Statics: loads, balance, Newton's method, states with memory."""

from notchflex.analysis.axis_points import AxisPlaces, axis_places, axis_points, points_on_axis
from notchflex.analysis.batch import Batch, simulate_batch, solve_batch
from notchflex.analysis.closing_loads.closing import Closing, closing
from notchflex.analysis.closing_loads.search import ClosingStatus
from notchflex.analysis.derivatives.differentiable import Differentiable, differentiable
from notchflex.analysis.derivatives.kinks import Kink
from notchflex.analysis.derivatives.tip_response import TipResponse, tip_response
from notchflex.analysis.kinematics import (
    SharedStroke,
    bodies_from_angles,
    equal_stroke,
    tip_from_angles,
)
from notchflex.analysis.solve import simulate, solve, solve_each
from notchflex.loads import Load
from notchflex.loads.external import BodyForce, ExternalLoad
from notchflex.loads.load_path import LoadPath
from notchflex.loads.ramps import pull, stroke_path
from notchflex.results.equilibrium import ConvergenceError, Equilibrium
from notchflex.results.path import EquilibriumPath
from notchflex.results.recorded import BEFORE, TOLD, Recorded
from notchflex.results.state import SavedState, State
from notchflex.solver.newton import Settings
from notchflex.solver.programs.prepare import prepared

__all__ = [
    "BEFORE",
    "TOLD",
    "AxisPlaces",
    "Batch",
    "BodyForce",
    "Closing",
    "ClosingStatus",
    "ConvergenceError",
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
