"""Fitting the projected chain to the edges of a photograph."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from notchflex.photographs.chain.camera import NUMBERS
from notchflex.photographs.chain.outline import Numbers, Outline, OutlineModel
from notchflex.photographs.contrast import Contrast
from notchflex.photographs.edges import Edges, find_edges
from notchflex.photographs.lines import Lines, lines_of, relative

_PRIOR_ROLL, _PRIOR_TILT = math.radians(10.0), math.radians(8.0)
_PRIOR_KERF, _PRIOR_CUT = 0.01, 0.006  # of the outer diameter: how well notches are made
_PRIOR_OWN, _MAX_OWN = 0.1, 0.2  # of the outer diameter: deviation of a single notch
_PRIOR_ANY = 1.0  # of the outer diameter: other photographs separate roll from depth
_PRIOR_CAMERA, _CAMERA = 0.006, 0.006  # inverse distance of the camera, per outer diameter
_EDGE = 0.25  # px: noise of an edge in quick rounds
_MIN_NOISE = 0.05  # px
_MAX_DISTANCE = 3.0  # px: an edge farther away belongs to something else
_CAP, _ALIKE = 4.0, 4.0  # residuals over their noise; edges that err as one
_OWN = 0.75  # px: how far a line may be shifted from the others and still lie where it should
_COMMON = 0.025  # of the width of the tube: how far all lines may be shifted outward or inward
_LINE = np.array([0.1, 0.06])  # px: usual shift and turn of a line
_ROBUST = 3.0  # over the noise: edges farther away count less
_DAMPING, _LITTLE = 1e-3, 1e-7
_MAX_TURN = 0.35  # rad in one step
_EARLY = 5  # rounds in which spreads of lines are not yet found
_DONE = 2e-3  # of `_scales`: smaller steps end a fit

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
    lines = lines_of(model)
    for number, reach in enumerate(reaches):
        outline, jacobian = _outline(model, numbers)
        edges = find_edges(contrast, outline, reach, middle)
        if np.count_nonzero(np.isfinite(edges.offset)) < 2 * len(numbers):
            break
        early = number < _EARLY
        if quick:  # edges count by their distance alone
            is_edge = np.isfinite(edges.offset)
            far = np.nan_to_num(edges.offset) / (0.25 * reach)
            weight = np.where(is_edge, 1.0 / (1.0 + far**2), 0.0) / _EDGE**2
            weighed = _EdgeWeights(weight, np.zeros((len(weight), 0)), np.zeros(0))
        else:
            weighed = _weighed(lines, edges, None if early else len(numbers))
        before = numbers
        numbers = _stepped(model, numbers, jacobian, edges.offset, weighed)
        if quick or early:
            continue
        if np.abs((numbers - before) / _scales(model, numbers)).max() < _DONE:
            break
    outline, jacobian = _outline(model, numbers)
    edges = find_edges(contrast, outline, max(reaches[-1], 3.0), middle)
    is_near = np.abs(edges.offset) < near
    score = float(is_near[edges.looked].sum() / max(1, len(is_near) // 2, edges.looked.sum()))
    return Fit(numbers, outline, edges, jacobian, edges.offset, score)


class _EdgeWeights(NamedTuple):
    """Weights of edges: weights (1/px^2, (N,)), columns of errors of lines and their spreads."""

    weight: Numbers
    columns: Numbers
    spreads: Numbers


def _noise_of(errors: Numbers) -> float:
    finite = np.abs(errors[np.isfinite(errors)])
    return max(1.4826 * float(np.median(finite)), _MIN_NOISE) if finite.size else _MIN_NOISE


def _weighed(lines: Lines, edges: Edges, fitted: int | None) -> _EdgeWeights:
    """Weigh edges by their distance from their line, and lines by their distance from others."""
    noise, strength = 0.3, edges.strength
    errors, left = lines.errors(edges.offset, _ROBUST * noise, strength)
    for _ in range(2):
        noise = _noise_of(left)
        errors, left = lines.errors(edges.offset, _ROBUST * noise, strength)
    weight = strength**2 / (1.0 + (np.nan_to_num(left) / (_ROBUST * noise)) ** 2) / noise**2
    weight = np.where(np.isfinite(left), weight, 0.0)
    return _EdgeWeights(weight, lines.columns(), lines.spreads(errors, fitted))


def _stepped(
    model: OutlineModel, numbers: Numbers, jacobian: Numbers, offset: Numbers, weighed: _EdgeWeights
) -> Numbers:
    """Take one damped Gauss-Newton step within the bounds."""
    count = len(numbers)
    normal, pull = _normal(model, numbers, jacobian, offset, weighed)
    scales = np.append(_scales(model, numbers), np.ones(len(weighed.spreads)))
    normal = normal * scales[:, None] * scales
    # Errors of lines leave little of the diagonal: more damping would hardly let numbers move.
    damping = _DAMPING if len(weighed.spreads) == 0 else _LITTLE
    normal += np.diag(damping * np.diag(normal) + 1e-9)
    low, high = _bounds(model, numbers)
    free = np.ones(len(scales), bool)
    step = np.zeros(len(scales))
    for _ in range(3):
        fixed = ~free
        right = (scales * pull)[free] - normal[np.ix_(free, fixed)] @ (step / scales)[fixed]
        step[free] = scales[free] * np.linalg.solve(normal[np.ix_(free, free)], right)
        within = np.clip(numbers + step[:count], low, high) - numbers
        beyond = free[:count] & (np.abs(within - step[:count]) > 1e-12)
        step[:count] = within
        if not beyond.any():
            break
        free[:count] &= ~beyond  # numbers at a bound stay there, the others are solved again
    moved = step[:count]
    turned = moved[NUMBERS : NUMBERS + model.table.notches]
    moved = moved * min(1.0, _MAX_TURN / max(float(np.abs(turned).max()), 1e-12))
    return np.clip(numbers + moved, low, high)


def _normal(
    model: OutlineModel, numbers: Numbers, jacobian: Numbers, offset: Numbers, weighed: _EdgeWeights
) -> tuple[Numbers, Numbers]:
    """Return the normal matrix and the right side, for the numbers and the errors of lines."""
    rows = np.hstack([jacobian, weighed.columns])
    centre, spread = priors(model, numbers)
    heavy = rows * weighed.weight[:, None]
    inverse = np.append(1.0 / spread, 1.0 / weighed.spreads) ** 2
    pull = heavy.T @ np.nan_to_num(offset)
    pull[: len(numbers)] -= (numbers - centre) * inverse[: len(numbers)]
    return heavy.T @ rows + np.diag(inverse), pull


def priors(model: OutlineModel, numbers: Numbers) -> tuple[Numbers, Numbers]:
    """Return means and standard deviations of the priors."""
    outer = 2.0 * model.table.outer
    centre, spread = np.zeros(len(numbers)), np.full(len(numbers), np.inf)
    turn = math.pi if math.cos(numbers[4]) < 0.0 else 0.0
    centre[4], spread[4] = turn, _PRIOR_ROLL
    spread[5] = _PRIOR_TILT
    centre[6], spread[6] = _CAMERA / outer, _PRIOR_CAMERA / outer
    prior = model.prior
    if prior.has_scale:
        centre[3], spread[3] = math.log(prior.scale), prior.scale_deviation
    if math.isfinite(prior.slope_deviation):
        centre[5], spread[5] = prior.tilt(float(numbers[2])), prior.slope_deviation
    if prior.perspective_deviation < spread[6]:
        centre[6], spread[6] = prior.perspective, prior.perspective_deviation
    spread[7], spread[8] = _PRIOR_KERF * outer, _PRIOR_CUT * outer
    n = model.table.notches
    if len(numbers) > NUMBERS + n:  # where every notch is measured, its file says little of it
        spread[7] = _PRIOR_OWN * outer
    spread[NUMBERS + n :] = _PRIOR_OWN * outer
    spread[NUMBERS + 2 * n : NUMBERS + 3 * n] = _PRIOR_ANY * outer
    return centre, spread


def _bounds(model: OutlineModel, numbers: Numbers) -> tuple[Numbers, Numbers]:
    outer = 2.0 * model.table.outer
    low, high = np.full(len(numbers), -np.inf), np.full(len(numbers), np.inf)
    turn = math.pi if math.cos(numbers[4]) < 0.0 else 0.0
    low[4], high[4] = turn - 0.7, turn + 0.7
    low[5], high[5] = -0.5, 0.5
    low[6], high[6] = 0.0, 0.03 / outer
    low[7:9], high[7:9] = -0.08 * outer, 0.08 * outer
    angles = slice(NUMBERS, NUMBERS + model.table.notches)
    low[angles], high[angles] = -0.6, 1.9
    low[angles.stop :], high[angles.stop :] = -_MAX_OWN * outer, _MAX_OWN * outer
    return low, high


def _scales(model: OutlineModel, numbers: Numbers) -> Numbers:
    scale = math.exp(numbers[3])
    view = [1.0, 1.0, 0.01, 0.01, 0.05, 0.05, 0.003, 1.0 / scale, 1.0 / scale]
    own = len(numbers) - NUMBERS - model.table.notches
    return np.array([*view, *[0.01] * model.table.notches, *[1.0 / scale] * own])


def _outline(model: OutlineModel, numbers: Numbers) -> tuple[Outline, Numbers]:
    """Return the outline and its derivatives along its normals, (N, numbers)."""
    steps = np.concatenate([_STEPS, np.full(len(numbers) - NUMBERS, 1e-4)])
    outline = model.outline(np.vstack([numbers, numbers + np.diag(steps)]))
    projected = np.einsum("bnk,nk->bn", outline.point, outline.normal)
    return outline, ((projected[1:] - projected[0]) / steps[:, None]).T


def covariance(fit: Fit, model: OutlineModel) -> tuple[NDArray[np.float64], float]:
    """Return the covariance of all numbers, and the robust spread of the residuals, px.

    Errors of lines are among the unknowns (`lines.py`), because neighbouring edges are correlated.
    """
    weighed = _weighed(lines_of(model), fit.edges, len(fit.numbers))
    normal, _ = _normal(model, fit.numbers, fit.jacobian, fit.residual, weighed)
    scale = 1.0 / np.sqrt(np.maximum(np.diag(normal), 1e-200))
    inverse = np.linalg.pinv(normal * scale[:, None] * scale, hermitian=True)
    count = len(fit.numbers)
    noise = _noise_of(_own(fit, model))
    return (inverse * scale[:, None] * scale)[:count, :count], noise


def cost(fit: Fit, model: OutlineModel) -> float:
    """Return how badly a fit lies, 0 to 1: edges that are missed count 1."""
    far = np.nan_to_num(np.abs(_own(fit, model)) / _MAX_DISTANCE, nan=1.0)
    return float(np.minimum(far[fit.edges.looked], 1.0).mean()) if fit.edges.looked.any() else 1.0


def misfit(fit: Fit, model: OutlineModel, noise: float) -> float:
    """Return how unlikely residuals are: a sum of squares in which those far away are capped.

    Errors of neighbouring edges are correlated, so that only some of them count; missed edges count
    most. Lines that are shifted or turned relative to the others count too: seen from the wrong
    side, a robot fits edge by edge, but only with shifted lines, or with notches of another depth.
    """
    lines = lines_of(model)
    errors, left = lines.errors(fit.residual, 1.0)
    capped = np.minimum(np.nan_to_num(np.abs(left) / noise, nan=np.inf), _CAP) ** 2
    own = relative(errors) / _LINE
    of_lines = float(np.nansum(2.0 * np.log1p(own**2 / 2.0)))
    centre, spread = priors(model, fit.numbers)
    unlikely = float((((fit.numbers - centre) / spread) ** 2).sum())
    return float(capped[fit.edges.looked].sum()) / _ALIKE + of_lines + unlikely


def _own(fit: Fit, model: OutlineModel) -> Numbers:
    """Return residuals less the shift of their line, as far as lines shift."""
    lines = lines_of(model)
    errors, _ = lines.errors(fit.residual, 1.0)
    most = _COMMON * 2.0 * model.table.outer * math.exp(fit.numbers[3])
    finite = errors[np.isfinite(errors[:, 0]), 0]
    common = float(np.clip(np.median(finite), -most, most)) if len(finite) else 0.0
    shift = common + np.clip(np.nan_to_num(errors[:, 0] - common), -_OWN, _OWN)
    return fit.residual - shift[lines.which]
