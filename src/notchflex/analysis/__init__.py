"""Analyses of a robot: equilibria along a path, batches, closing loads, derivatives, kinematics."""

from notchflex.analysis.bands import Band, Bands, band_names, uncertain
from notchflex.analysis.batch import Batch, batch, simulate_batch, solve_batch
from notchflex.analysis.closing_loads import Closing, ClosingStatus, closing
from notchflex.analysis.differentiable import Differentiable, differentiable
from notchflex.analysis.forward_model import TipResponse, tip_response
from notchflex.analysis.kinematics import (
    AxisPlaces,
    SharedStroke,
    axis_places,
    axis_points,
    bodies_from_angles,
    equal_stroke,
    points_on_axis,
    tip_from_angles,
)
from notchflex.analysis.slopes import PathGradient
from notchflex.analysis.solve import simulate, solve, solve_each
from notchflex.analysis.spool import spool_path
from notchflex.analysis.stepping import Step, Stepper
from notchflex.analysis.tangent import Kink

__all__ = [
    "AxisPlaces",
    "Band",
    "Bands",
    "Batch",
    "Closing",
    "ClosingStatus",
    "Differentiable",
    "Kink",
    "PathGradient",
    "SharedStroke",
    "Step",
    "Stepper",
    "TipResponse",
    "axis_places",
    "axis_points",
    "band_names",
    "batch",
    "bodies_from_angles",
    "closing",
    "differentiable",
    "equal_stroke",
    "points_on_axis",
    "simulate",
    "simulate_batch",
    "solve",
    "solve_batch",
    "solve_each",
    "spool_path",
    "tip_from_angles",
    "tip_response",
    "uncertain",
]
