"""Statics: loads, balance, Newton's method, states with memory."""

from notchflex.statics.batch import Batch, simulate_batch, solve_batch
from notchflex.statics.closing import Closing, closing
from notchflex.statics.differentiable import Differentiable, differentiable
from notchflex.statics.external import BodyForce, ExternalLoad
from notchflex.statics.kinematics import (
    SharedStroke,
    bodies_from_angles,
    equal_stroke,
    tip_from_angles,
)
from notchflex.statics.load import Load, LoadPath
from notchflex.statics.newton import Settings
from notchflex.statics.path import ConvergenceError, Equilibrium, Path
from notchflex.statics.ramps import draw, pull
from notchflex.statics.solve import simulate, solve, solve_each
from notchflex.statics.state import SavedState, State
from notchflex.statics.tip_response import TipResponse, tip_response

__all__ = [
    "Batch",
    "BodyForce",
    "Closing",
    "ConvergenceError",
    "Differentiable",
    "Equilibrium",
    "ExternalLoad",
    "Load",
    "LoadPath",
    "Path",
    "SavedState",
    "Settings",
    "SharedStroke",
    "State",
    "TipResponse",
    "bodies_from_angles",
    "closing",
    "differentiable",
    "draw",
    "equal_stroke",
    "pull",
    "simulate",
    "simulate_batch",
    "solve",
    "solve_batch",
    "solve_each",
    "tip_from_angles",
    "tip_response",
]
