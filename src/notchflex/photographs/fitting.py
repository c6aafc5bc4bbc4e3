"""Fitting the projected chain to the edges of a photograph."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np

from notchflex.photographs.camera import NUMBERS
from notchflex.photographs.chain_table import Numbers
from notchflex.photographs.edges import Contrast, Edges, find_edges
from notchflex.photographs.lines import from_median, median_shift
from notchflex.photographs.outline import MAX_ANGLE, MIN_ANGLE, Outline, OutlineModel

MAX_RESIDUAL = 2.0
"""Distance from the outline within which an edge counts as its own, px."""


class _Parameters(NamedTuple):
    """Means and standard deviations of the priors of all numbers, bounds, and usual steps."""

    centre: Numbers
    spread: Numbers
    low: Numbers
    high: Numbers
    scale: Numbers


def _parameters(model: OutlineModel, numbers: Numbers) -> _Parameters:
    """Return what is known of the numbers before the fit, in the order of `camera.VIEW`."""
    outer, n, prior = 2.0 * model.table.outer, model.table.notches, model.prior
    pixel, inf = math.exp(-numbers[3]), math.inf
    turn = math.pi if math.cos(numbers[4]) < 0.0 else 0.0
    log_scale = (math.log(prior.scale) if prior.scale > 0.0 else 0.0, prior.scale_deviation)
    tilt = (0.0, math.radians(8.0))
    if math.isfinite(prior.slope_deviation):
        tilt = (prior.tilt(float(numbers[2])), prior.slope_deviation)
    near = (0.006 / outer, 0.006 / outer)
    if prior.perspective_deviation < near[1]:
        near = (prior.perspective, prior.perspective_deviation)
    # Notches are made to some 0.01 of the outer diameter; where every notch is measured, the file
    # says little of it, and only other photographs separate its depth from the roll.
    kerf = 0.1 if len(numbers) > NUMBERS + n else 0.01
    lengths = [(0.0, spread * outer, -0.2 * outer, 0.2 * outer, pixel) for spread in (0.1, 1.0)]
    rows = [
        (0.0, inf, -inf, inf, 1.0),
        (0.0, inf, -inf, inf, 1.0),
        (0.0, inf, -inf, inf, 0.01),
        (*log_scale, -inf, inf, 0.01),
        (turn, math.radians(10.0), turn - 0.7, turn + 0.7, 0.05),
        (*tilt, -0.5, 0.5, 0.05),
        (*near, 0.0, 0.03 / outer, 0.003),
        (0.0, kerf * outer, -0.08 * outer, 0.08 * outer, pixel),
        (0.0, 0.006 * outer, -0.08 * outer, 0.08 * outer, pixel),
        *n * [(0.0, inf, MIN_ANGLE, MAX_ANGLE, 0.01)],
        *n * lengths[:1],
        *n * lengths[1:],
        *(n + 1) * lengths[:1],
    ]
    return _Parameters(*np.array(rows[: len(numbers)]).T)


_EDGE = 0.25  # px: noise of an edge in quick rounds
_MIN_NOISE = 0.05  # px
_ROBUST = 3.0  # over the noise: edges farther away count less
_DAMPING, _LITTLE = 1e-3, 1e-7
_MAX_TURN = 0.35  # rad in one step
_EARLY = 5  # rounds in which spreads of lines are not yet found
_DONE = 2e-3  # of usual steps: smaller ones end a fit
_STEPS = np.array([0.05, 0.05, 1e-4, 1e-4, 1e-3, 1e-3, 1e-5, 1e-4, 1e-4])

_MAX_DISTANCE = 3.0  # px: an edge farther away belongs to something else
_CAP, _ALIKE = 4.0, 4.0  # residuals over their noise; edges that err as one
_OWN = 0.75  # px: how far a line may be shifted from the others and still lie where it should
_COMMON = 0.025  # of the width of the tube: how far all lines may be shifted outward or inward
_LINE = np.array([0.1, 0.06])  # px: usual shift and turn of a line


@dataclass(frozen=True, eq=False)
class Fit:
    """A fitted robot.

    Attributes:
        model: The outline of the robot.
        numbers: View and angles, (NUMBERS + n,), and lengths where notches are measured.
        outline: The outline there.
        jacobian: Its derivatives along its normals by the numbers, (N, numbers).
        edges: The edges beside it.
    """

    model: OutlineModel
    numbers: Numbers
    outline: Outline
    jacobian: Numbers
    edges: Edges

    @property
    def residual(self) -> Numbers:
        """Distances of the edges from the outline, px, (N,), NaN where there is none."""
        return self.edges.offset

    @property
    def score(self) -> float:
        """Share of the edges looked for that lie where they should."""
        is_near, looked = np.abs(self.residual) < MAX_RESIDUAL, self.edges.looked
        return float(is_near[looked].sum() / max(1, len(is_near) // 2, looked.sum()))

    @cached_property
    def cost(self) -> float:
        """How badly the fit lies, 0 to 1: edges that are missed count 1."""
        far = np.nan_to_num(np.abs(self._apart()) / _MAX_DISTANCE, nan=1.0)[self.edges.looked]
        return float(np.minimum(far, 1.0).mean()) if far.size else 1.0

    def misfit(self, noise: float) -> float:
        """Return how unlikely residuals are: a sum of squares in which those far away are capped.

        Errors of neighbouring edges are correlated, so that only some of them count; missed edges
        count most. Lines that are shifted or turned relative to the others count too: seen from the
        wrong side, a robot fits edge by edge, but only with shifted lines, or with notches of
        another depth.
        """
        errors, left = self.model.lines.errors(self.residual, 1.0)
        capped = np.minimum(np.nan_to_num(np.abs(left) / noise, nan=np.inf), _CAP) ** 2
        apart = from_median(errors) / _LINE
        of_lines = float(np.nansum(2.0 * np.log1p(apart**2 / 2.0)))
        known = _parameters(self.model, self.numbers)
        unlikely = float((((self.numbers - known.centre) / known.spread) ** 2).sum())
        return float(capped[self.edges.looked].sum()) / _ALIKE + of_lines + unlikely

    @cached_property
    def noise(self) -> float:
        """Robust spread of the residuals, px."""
        return _noise_of(self._apart())

    def covariance(self) -> Numbers:
        """Return the covariance of all numbers.

        Errors of lines are among the unknowns (`lines.py`): neighbouring edges are correlated.
        """
        weights = _weights(self.model, self.edges, len(self.numbers))
        known = _parameters(self.model, self.numbers)
        normal, _ = _normal(known, self.numbers, self.jacobian, self.residual, weights)
        scale = 1.0 / np.sqrt(np.maximum(np.diag(normal), 1e-200))
        inverse = np.linalg.pinv(normal * scale[:, None] * scale, hermitian=True)
        count = len(self.numbers)
        return (inverse * scale[:, None] * scale)[:count, :count]

    def _apart(self) -> Numbers:
        """Return residuals less the shift of their line, as far as lines shift."""
        lines, outer = self.model.lines, self.model.table.outer
        errors, _ = lines.errors(self.residual, 1.0)
        most = _COMMON * 2.0 * outer * math.exp(self.numbers[3])
        common = float(np.clip(median_shift(errors), -most, most))
        shift = common + np.clip(np.nan_to_num(errors[:, 0] - common), -_OWN, _OWN)
        return self.residual - shift[lines.which]


def refine(
    model: OutlineModel,
    contrast: Contrast,
    numbers: Numbers,
    reaches: list[float],
    quick: bool = False,
) -> Fit:
    """Fit a robot to the edges near it, again and again from ever nearer.

    Args:
        model: The outline of the robot.
        contrast: Contrast of the photograph.
        numbers: View and angles from which to start.
        reaches: How far edges are looked for in each round, px.
        quick: Whether edges count by their distance alone, and no round ends the fit early.
    """
    for number, reach in enumerate(reaches):
        outline, jacobian = _outline(model, numbers)
        edges = find_edges(contrast, outline, reach)
        is_edge = np.isfinite(edges.offset)
        if np.count_nonzero(is_edge) < 2 * len(numbers):
            break
        early = number < _EARLY
        if quick:
            far = np.nan_to_num(edges.offset) / (0.25 * reach)
            weight = np.where(is_edge, 1.0 / (1.0 + far**2), 0.0) / _EDGE**2
            weights = _EdgeWeights(weight, np.zeros((len(weight), 0)), np.zeros(0))
        else:
            weights = _weights(model, edges, None if early else len(numbers))
        before = numbers
        numbers = _stepped(model, numbers, jacobian, edges.offset, weights)
        step = (numbers - before) / _parameters(model, numbers).scale
        if not (quick or early) and np.abs(step).max() < _DONE:
            break
    outline, jacobian = _outline(model, numbers)
    return Fit(
        model, numbers, outline, jacobian, find_edges(contrast, outline, max(reaches[-1], 3.0))
    )


class _EdgeWeights(NamedTuple):
    """Weights of edges: weights (1/px^2, (N,)), columns of errors of lines and their spreads."""

    weight: Numbers
    columns: Numbers
    spreads: Numbers


def _noise_of(errors: Numbers) -> float:
    finite = np.abs(errors[np.isfinite(errors)])
    return max(1.4826 * float(np.median(finite)), _MIN_NOISE) if finite.size else _MIN_NOISE


def _weights(model: OutlineModel, edges: Edges, fitted: int | None) -> _EdgeWeights:
    """Weigh edges by their distance from their line, and lines by their distance from others."""
    lines, noise, strength = model.lines, 0.3, edges.strength
    errors, left = lines.errors(edges.offset, _ROBUST * noise, strength)
    for _ in range(2):
        noise = _noise_of(left)
        errors, left = lines.errors(edges.offset, _ROBUST * noise, strength)
    weight = strength**2 / (1.0 + (np.nan_to_num(left) / (_ROBUST * noise)) ** 2) / noise**2
    weight = np.where(np.isfinite(left), weight, 0.0)
    return _EdgeWeights(weight, lines.columns, lines.spreads(errors, fitted))


def _stepped(
    model: OutlineModel, numbers: Numbers, jacobian: Numbers, offset: Numbers, weights: _EdgeWeights
) -> Numbers:
    """Take one damped Gauss-Newton step within the bounds."""
    count, known = len(numbers), _parameters(model, numbers)
    normal, pull = _normal(known, numbers, jacobian, offset, weights)
    scales = np.append(known.scale, np.ones(len(weights.spreads)))
    normal = normal * scales[:, None] * scales
    # Errors of lines leave little of the diagonal: more damping would hardly let numbers move.
    damping = _DAMPING if len(weights.spreads) == 0 else _LITTLE
    normal += np.diag(damping * np.diag(normal) + 1e-9)
    free = np.ones(len(scales), bool)
    step = np.zeros(len(scales))
    for _ in range(3):
        fixed = ~free
        right = (scales * pull)[free] - normal[np.ix_(free, fixed)] @ (step / scales)[fixed]
        step[free] = scales[free] * np.linalg.solve(normal[np.ix_(free, free)], right)
        within = np.clip(numbers + step[:count], known.low, known.high) - numbers
        beyond = free[:count] & (np.abs(within - step[:count]) > 1e-12)
        step[:count] = within
        if not beyond.any():
            break
        free[:count] &= ~beyond  # numbers at a bound stay there, the others are solved again
    moved = step[:count]
    turned = np.abs(moved[NUMBERS : NUMBERS + model.table.notches]).max()
    moved = moved * min(1.0, _MAX_TURN / max(float(turned), 1e-12))
    return np.clip(numbers + moved, known.low, known.high)


def _normal(
    known: _Parameters, numbers: Numbers, jacobian: Numbers, offset: Numbers, weights: _EdgeWeights
) -> tuple[Numbers, Numbers]:
    """Return the normal matrix and the right side, for the numbers and the errors of lines."""
    rows = np.hstack([jacobian, weights.columns])
    heavy = rows * weights.weight[:, None]
    inverse = np.append(1.0 / known.spread, 1.0 / weights.spreads) ** 2
    pull = heavy.T @ np.nan_to_num(offset)
    pull[: len(numbers)] -= (numbers - known.centre) * inverse[: len(numbers)]
    return heavy.T @ rows + np.diag(inverse), pull


def _outline(model: OutlineModel, numbers: Numbers) -> tuple[Outline, Numbers]:
    """Return the outline and its derivatives along its normals, (N, numbers)."""
    steps = np.concatenate([_STEPS, np.full(len(numbers) - NUMBERS, 1e-4)])
    outline = model.outline(np.vstack([numbers, numbers + np.diag(steps)]))
    projected = np.einsum("bnk,nk->bn", outline.point, outline.normal)
    return outline, ((projected[1:] - projected[0]) / steps[:, None]).T
