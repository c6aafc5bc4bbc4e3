"""Analyses of a robot: equilibria along a path, batches, closing loads, derivatives, kinematics."""

from notchflex.analysis.axis_points import AxisPlaces, axis_places, axis_points, points_on_axis
from notchflex.analysis.batch import simulate_batch, solve_batch
from notchflex.analysis.closing_loads import Closing, ClosingStatus, closing
from notchflex.analysis.derivatives.differentiable import Differentiable, differentiable
from notchflex.analysis.derivatives.tangent import Kink
from notchflex.analysis.derivatives.tip_response import TipResponse, tip_response
from notchflex.analysis.kinematics import (
    SharedStroke,
    bodies_from_angles,
    equal_stroke,
    tip_from_angles,
)
from notchflex.analysis.outputs import Batch
from notchflex.analysis.solve import simulate, solve, solve_each
from notchflex.analysis.uncertainty.bands import Band, Bands, band_names, uncertain

__all__ = [
    "AxisPlaces",
    "Band",
    "Bands",
    "Batch",
    "Closing",
    "ClosingStatus",
    "Differentiable",
    "Kink",
    "SharedStroke",
    "TipResponse",
    "axis_places",
    "axis_points",
    "band_names",
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
    "tip_from_angles",
    "tip_response",
    "uncertain",
]
