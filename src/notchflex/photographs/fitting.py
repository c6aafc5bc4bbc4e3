"""Fitting the projected chain to the edges of a photograph."""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import least_squares

from notchflex.photographs.camera import NUMBERS
from notchflex.photographs.contrast import Contrast
from notchflex.photographs.edges import Edges, find_edges
from notchflex.photographs.outline import Numbers, Outline, OutlineModel

ROBUST = (0.35, 2.0)
"""Least and largest residual beyond which an edge counts less, px."""

_PRIOR_ROLL, _PRIOR_TILT = math.radians(10.0), math.radians(8.0)
_PRIOR_KERF, _PRIOR_CUT = 0.01, 0.006  # of the outer diameter: how well notches are made
_PRIOR_NEAR, _NEAR = 0.006, 0.006  # inverse distance of the camera, per outer diameter
_EDGE = 0.25  # px: noise of an edge, against which the priors are weighed
_MOST_SHIFT = 1.5  # px
_LEAST_NOISE = 0.05  # px
_FAR = 3.0  # px: an edge farther away belongs to something else
_CAP, _ALIKE = 4.0, 4.0  # residuals over their noise; edges that err as one
LINE_SHIFT, ALL_SHIFT = 0.25, 0.5
"""How far the edges of one line at least, and all edges, are shifted together, px (standard
deviations)."""

_STEPS = np.array([0.05, 0.05, 1e-4, 1e-4, 1e-3, 1e-3, 1e-5, 1e-4, 1e-4])


class Fit(NamedTuple):
    """A fitted robot.

    Attributes:
        numbers: View and angles, (NUMBERS + n,).
        outline: The outline there.
        edges: The edges beside it.
        jacobian: Derivatives of all residuals, those of the priors last.
        residual: Distances of the edges from the outline, px, (N,), NaN where there is none.
        score: Share of the edges looked for that lie where they should.
    """

    numbers: Numbers
    outline: Outline
    edges: Edges
    jacobian: Numbers
    residual: Numbers
    score: float


def refine(
    model: OutlineModel,
    contrast: Contrast,
    numbers: Numbers,
    reaches: list[float],
    middle: Numbers,
    near: float,
    quick: bool = False,
) -> Fit:
    """Fit a robot to the edges near it, again and again from ever nearer.

    Args:
        model: The outline of the robot.
        contrast: Contrast of the photograph.
        numbers: View and angles from which to start.
        reaches: How far edges are looked for in each round, px.
        middle: Middle of the photograph, px.
        near: Distance within which an edge lies where it should, px.
        quick: Whether each round takes one step only.
    """
    for reach in reaches:
        outline = model.outline(numbers)
        edges = find_edges(contrast, outline, reach, middle)
        if np.count_nonzero(np.isfinite(edges.offset)) < 2 * len(numbers):
            break
        if quick:
            numbers = _stepped(model, numbers, outline, edges, 0.25 * reach)
        else:
            typical = float(np.nanmedian(np.abs(edges.offset)))
            numbers = _solved(
                model, numbers, outline, edges, float(np.clip(2.5 * typical, *ROBUST))
            )
    outline = model.outline(numbers)
    edges = find_edges(contrast, outline, max(reaches[-1], 3.0), middle)
    jacobian = _jacobian(model, numbers, outline.normal)
    good = np.abs(edges.offset) < near
    score = float(good[edges.looked].sum() / max(1, len(good) // 2, edges.looked.sum()))
    return Fit(numbers, outline, edges, jacobian, edges.offset, score)


def _stepped(
    model: OutlineModel, numbers: Numbers, outline: Outline, edges: Edges, robust: float
) -> Numbers:
    """Take one damped, reweighted Gauss-Newton step."""
    found = np.isfinite(edges.offset)
    offset = edges.offset[found]
    rows = _jacobian(model, numbers, outline.normal)[found]
    weight = 1.0 / (1.0 + (offset / robust) ** 2)
    centre, spread = priors(model, numbers)
    scales = _scales(model, numbers)
    normal = (rows * weight[:, None]).T @ rows + np.diag(1.0 / spread**2)
    normal = normal * scales[:, None] * scales
    normal += np.diag(1e-3 * np.diag(normal) + 1e-9)
    pull = (rows * weight[:, None]).T @ offset - (numbers - centre) / spread**2
    step = scales * np.linalg.solve(normal, scales * pull)
    step *= min(1.0, 0.35 / max(float(np.abs(step[NUMBERS:]).max()), 1e-12))
    low, high = _bounds(model, numbers)
    return np.clip(numbers + step, low, high)


def _solved(
    model: OutlineModel, numbers: Numbers, outline: Outline, edges: Edges, robust: float
) -> Numbers:
    """Solve for the numbers, and for a shift of each line of edges (`shifts`)."""
    found = np.isfinite(edges.offset)
    normal = outline.normal[found]
    target = outline.point[0][found] + edges.offset[found, None] * normal
    target_along = (target * normal).sum(axis=1)
    columns, shift_spread = shifts(model, edges.offset)
    centre, spread = priors(model, numbers)
    count, columns = len(numbers), columns[found]
    centre = np.append(centre, np.zeros(len(shift_spread)))
    spread = np.append(spread, shift_spread / _EDGE)

    def residual(x: Numbers) -> Numbers:
        seen = (model.outline(x[:count]).point[0][found] * normal).sum(axis=1)
        return np.concatenate([seen + columns @ x[count:] - target_along, (x - centre) / spread])

    def slopes(x: Numbers) -> Numbers:
        rows = _jacobian(model, x[:count], outline.normal)[found]
        return np.concatenate([np.hstack([rows, columns]), np.diag(1.0 / spread)])

    jacobian: Any = slopes  # SciPy's types know its names of differences only
    low, high = (
        np.append(one, np.full(len(shift_spread), sign * np.inf))
        for one, sign in zip(_bounds(model, numbers), (-1.0, 1.0), strict=True)
    )
    first = np.append(numbers, np.zeros(len(shift_spread)))
    scales = np.append(_scales(model, numbers), np.ones(len(shift_spread)))
    solved = least_squares(
        residual, np.clip(first, low + 1e-9, high - 1e-9), jacobian, (low, high),
        x_scale=scales, loss="cauchy", f_scale=robust, max_nfev=12, xtol=1e-9, ftol=1e-7,
    )  # fmt: skip
    return solved.x[:count]


def shifts(model: OutlineModel, offset: Numbers) -> tuple[Numbers, Numbers]:
    """Return columns by which lines of edges shift together, and how far they do, px.

    Highlights and blur shift all edges of one line alike, and all lines outward. How far is found
    from the edges themselves: rings that are not made as the robot file says shift lines too.

    Args:
        model: The outline of the robot.
        offset: Distances of the edges from it, px, (N,).
    """
    line = model.kind * 10000 + model.ring * 2 + (model.which > 0)
    names, which = np.unique(line, return_inverse=True)
    columns = np.zeros((len(line), len(names) + 1))
    columns[np.arange(len(line)), which] = 1.0
    columns[:, -1] = 1.0
    lines = [offset[(which == one) & np.isfinite(offset)] for one in range(len(names))]
    typical = np.median([abs(float(np.median(one))) for one in lines if len(one) > 2] or [0.0])
    spread = float(np.clip(1.5 * typical, LINE_SHIFT, _MOST_SHIFT))
    return columns, np.append(np.full(len(names), spread), ALL_SHIFT)


def priors(model: OutlineModel, numbers: Numbers) -> tuple[Numbers, Numbers]:
    """Return centres and spreads of what is known before, in units of an edge's noise."""
    outer = 2.0 * model.table.outer
    centre, spread = np.zeros(len(numbers)), np.full(len(numbers), np.inf)
    turn = math.pi if math.cos(numbers[4]) < 0.0 else 0.0
    centre[4], spread[4] = turn, _PRIOR_ROLL
    spread[5] = _PRIOR_TILT
    centre[6], spread[6] = _NEAR / outer, _PRIOR_NEAR / outer
    spread[7], spread[8] = _PRIOR_KERF * outer, _PRIOR_CUT * outer
    return centre, spread / _EDGE


def _bounds(model: OutlineModel, numbers: Numbers) -> tuple[Numbers, Numbers]:
    outer = 2.0 * model.table.outer
    low, high = np.full(len(numbers), -np.inf), np.full(len(numbers), np.inf)
    turn = math.pi if math.cos(numbers[4]) < 0.0 else 0.0
    low[4], high[4] = turn - 0.7, turn + 0.7
    low[5], high[5] = -0.5, 0.5
    low[6], high[6] = 0.0, 0.03 / outer
    low[7], high[7] = -0.08 * outer, 0.08 * outer
    low[8], high[8] = -0.08 * outer, 0.08 * outer
    low[NUMBERS:], high[NUMBERS:] = -0.6, 1.9
    return low, high


def _scales(model: OutlineModel, numbers: Numbers) -> Numbers:
    scale = math.exp(numbers[3])
    view = [1.0, 1.0, 0.01, 0.01, 0.05, 0.05, 0.003, 1.0 / scale, 1.0 / scale]
    return np.array([*view, *[0.01] * model.table.notches])


def _jacobian(model: OutlineModel, numbers: Numbers, normal: Numbers) -> Numbers:
    """Return derivatives of where the outline lies along fixed normals, (N, numbers)."""
    steps = np.concatenate([_STEPS, np.full(model.table.notches, 1e-4)])
    both = np.concatenate([numbers + np.diag(steps), numbers - np.diag(steps)])
    seen = (model.outline(both).point * normal).sum(axis=-1)
    half = len(steps)
    return ((seen[:half] - seen[half:]) / (2.0 * steps[:, None])).T


def covariance(fit: Fit, model: OutlineModel) -> tuple[NDArray[np.float64], float]:
    """Return the covariance of all numbers, and the robust spread of the residuals, px.

    The shifts of whole lines are among the unknowns. Beside them neighbouring edges err alike: the
    covariance is scaled by the correlation of residuals that follow one another on one line.
    """
    found = np.isfinite(fit.residual)
    columns, shift_spread = shifts(model, fit.residual)
    rows = np.hstack([fit.jacobian, columns])[found]
    _, spread = priors(model, fit.numbers)
    inverse_spread = np.append(1.0 / (spread * _EDGE), 1.0 / shift_spread)
    residual = _without_shifts(fit, model)[found]
    noise = max(1.4826 * float(np.median(np.abs(residual))), _LEAST_NOISE)
    weight = 1.0 / (1.0 + (residual / max(ROBUST[0], noise)) ** 2)
    normal = (rows * weight[:, None]).T @ rows / (noise**2 * _correlation(fit, model))
    normal += np.diag(inverse_spread**2)
    scale = 1.0 / np.sqrt(np.maximum(np.diag(normal), 1e-300))
    inverse = np.linalg.pinv(normal * scale[:, None] * scale, hermitian=True)
    count = len(fit.numbers)
    return (inverse * scale[:, None] * scale)[:count, :count], noise


def cost(fit: Fit, model: OutlineModel) -> float:
    """Return how badly a fit lies, 0 to 1: edges that are missed count 1."""
    far = np.nan_to_num(np.abs(_without_shifts(fit, model)) / _FAR, nan=1.0)
    return float(np.minimum(far[fit.edges.looked], 1.0).mean()) if fit.edges.looked.any() else 1.0


def misfit(fit: Fit, model: OutlineModel, noise: float) -> float:
    """Return the capped sum of squares of residuals over an edge's noise; missed edges count most.

    Neighbouring edges err alike, so that only some of them count.
    """
    far = np.abs(_without_shifts(fit, model)) / noise
    capped = np.minimum(np.nan_to_num(far, nan=np.inf), _CAP) ** 2
    return float(capped[fit.edges.looked].sum()) / _ALIKE


def _without_shifts(fit: Fit, model: OutlineModel) -> Numbers:
    """Return residuals less the median of their line, as far as lines shift."""
    columns, spread = shifts(model, fit.residual)
    left = fit.residual.copy()
    for column, one in zip(columns.T[:-1] > 0.0, spread, strict=False):
        if np.isfinite(left[column]).sum() > 2:
            shift = float(np.nanmedian(left[column]))
            left[column] -= np.clip(shift, -3.0 * one, 3.0 * one)
    return left


def _correlation(fit: Fit, model: OutlineModel) -> float:
    """Return by how much correlated residuals raise the variance of a mean."""
    line = model.kind * 10000 + model.ring * 2 + (model.which > 0)
    residual = np.clip(_without_shifts(fit, model), -2.0, 2.0)
    total = 1.0
    power = np.nanmean(residual**2)
    for lag in range(1, 12):
        same = line[lag:] == line[:-lag]
        product = (residual[lag:] * residual[:-lag])[same]
        if not np.isfinite(product).any():
            break
        value = float(np.nanmean(product)) / max(float(power), 1e-12)
        if value < 0.05:
            break
        total += 2.0 * value
    return total
