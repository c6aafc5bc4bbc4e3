"""Fitting the projected chain to the edges of a photograph, and whether a fit is accepted."""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from notchflex.photographs.edges import (
    Contrast,
    Edges,
    Numbers,
    Outline,
    find_edges,
    from_median,
    median_shift,
)
from notchflex.photographs.outline import (
    FACE,
    MAX_ANGLE,
    MIN_ANGLE,
    NUMBERS,
    SIDE,
    SPINE,
    OutlineModel,
)

MAX_RESIDUAL = 2.0
"""Distance from the outline within which an edge counts as its own, px."""

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


Weights = tuple[Numbers, Numbers, Numbers]
"""Weights of edges (1/px^2, (N,)), columns of errors of lines (N, m), and their spreads (px)."""


@dataclass(frozen=True, eq=False)
class Fit:
    """A robot beside the edges of a photograph.

    Attributes:
        model: The outline of the robot.
        numbers: View and angles, (NUMBERS + n,), and lengths where notches are measured.
        contrast: The photograph, made smaller.
        outline: The outline there, px of the contrast.
        jacobian: Its derivatives along its normals by the numbers, (N, numbers).
        edges: The edges beside it.
    """

    model: OutlineModel
    numbers: Numbers
    contrast: Contrast
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

    @cached_property
    def noise(self) -> float:
        """Robust spread of the residuals, px."""
        return _noise_of(self._apart())

    @cached_property
    def known(self) -> Numbers:
        """Means and spreads of the priors of all numbers, low and high bounds, usual steps."""
        outer, n, prior = 2.0 * self.model.planar.outer, self.model.planar.notches, self.model.prior
        inf, pixel = math.inf, 1.0 / self.contrast.factor
        mm = pixel * math.exp(-self.numbers[3])
        direction, turn = self.numbers[2], math.pi if math.cos(self.numbers[4]) < 0.0 else 0.0
        tilt = math.atan(np.dot(prior.slope, [math.cos(direction), math.sin(direction)]))
        near = min((0.006 / outer, 0.006 / outer), prior.perspective, key=lambda known: known[1])
        # Notches are made to some 0.01 of the outer diameter; where every notch is measured, the
        # file says little of it, and only other photographs separate its depth from the roll.
        kerf = 0.1 if len(self.numbers) > NUMBERS + n else 0.01
        lengths = [(0.0, spread * outer, -0.2 * outer, 0.2 * outer, mm) for spread in (0.1, 1.0)]
        rows = [
            (0.0, inf, -inf, inf, pixel),
            (0.0, inf, -inf, inf, pixel),
            (0.0, inf, -inf, inf, 0.01),
            (*prior.log_scale, -inf, inf, 0.01),
            (turn, math.radians(10.0), turn - 0.7, turn + 0.7, 0.05),
            (tilt, prior.tilt_deviation, -0.5, 0.5, 0.05),
            (*near, 0.0, 0.03 / outer, 0.003),
            (0.0, kerf * outer, -0.08 * outer, 0.08 * outer, mm),
            (0.0, 0.006 * outer, -0.08 * outer, 0.08 * outer, mm),
            *n * [(0.0, inf, MIN_ANGLE, MAX_ANGLE, 0.01)],
            *n * lengths[:1],
            *n * lengths[1:],
            *(n + 1) * lengths[:1],
        ]
        return np.array(rows[: len(self.numbers)]).T

    def misfit(self, noise: float) -> float:
        """Return how unlikely residuals are: a sum of squares in which those far away are capped.

        Errors of neighbouring edges are correlated, so that only some of them count; missed edges
        count most. Lines that are shifted or turned relative to the others count too: seen from the
        wrong side, a robot fits edge by edge, but only with shifted lines, or with notches of
        another depth.
        """
        errors, left = self.model.lines.errors(self.residual, 1.0)
        capped = np.minimum(np.nan_to_num(np.abs(left) / noise, nan=np.inf), _CAP) ** 2
        of_lines = float(np.nansum(2.0 * np.log1p((from_median(errors) / _LINE) ** 2 / 2.0)))
        unlikely = float((((self.numbers - self.known[0]) / self.known[1]) ** 2).sum())
        return float(capped[self.edges.looked].sum()) / _ALIKE + of_lines + unlikely

    @cached_property
    def covariance(self) -> Numbers:
        """Covariance of all numbers.

        Errors of lines are among the unknowns (`Lines`): neighbouring edges are correlated.
        """
        count = len(self.numbers)
        normal, _ = self._normal(self.weights(count))
        scale = 1.0 / np.sqrt(np.maximum(np.diag(normal), 1e-200))
        inverse = np.linalg.pinv(normal * scale[:, None] * scale, hermitian=True)
        return (inverse * scale[:, None] * scale)[:count, :count]

    @property
    def deviation(self) -> Numbers:
        """Standard deviations of the angles, rad, (n,)."""
        return np.sqrt(np.maximum(np.diag(self.covariance)[self.model.angles], 0.0))

    def quick_weights(self, reach: float) -> Weights:
        """Weigh edges by their distance alone."""
        weight = 1.0 / (1.0 + (self.residual / (0.25 * reach)) ** 2) / _EDGE**2
        return np.nan_to_num(weight), np.zeros((len(weight), 0)), np.zeros(0)

    def weights(self, fitted: int | None) -> Weights:
        """Weigh edges by their distance from their line, and lines by their distance from others.

        `fitted` is as in `Lines.spreads`.
        """
        lines, noise, strength = self.model.lines, 0.3, self.edges.strength
        errors, left = lines.errors(self.residual, _ROBUST * noise, strength)
        for _ in range(2):
            noise = _noise_of(left)
            errors, left = lines.errors(self.residual, _ROBUST * noise, strength)
        weight = np.nan_to_num(strength**2 / (1.0 + (left / (_ROBUST * noise)) ** 2) / noise**2)
        return weight, lines.columns, lines.spreads(errors, fitted)

    def step(self, weights: Weights) -> Numbers:
        """Return the numbers after one damped Gauss-Newton step within the bounds."""
        count, (_, _, low, high, usual) = len(self.numbers), self.known
        normal, pull = self._normal(weights)
        scales = np.append(usual, np.ones(len(pull) - count))
        normal, pull = normal * scales[:, None] * scales, pull * scales
        # Errors of lines leave little of the diagonal: more damping would hardly let numbers move.
        damping = _LITTLE if len(pull) > count else _DAMPING
        normal += np.diag(damping * np.diag(normal) + 1e-9)
        room = np.full((2, len(pull)), [[-np.inf], [np.inf]])
        room[:, :count] = (np.array([low, high]) - self.numbers) / usual
        free, step = np.ones(len(pull), bool), np.zeros(len(pull))
        for _ in range(3):
            right = pull[free] - normal[np.ix_(free, ~free)] @ step[~free]
            step[free] = np.linalg.solve(normal[np.ix_(free, free)], right)
            is_beyond = step != np.clip(step, *room)
            step = np.clip(step, *room)
            if not is_beyond.any():
                break
            free &= ~is_beyond  # numbers at a bound stay there, the others are solved again
        moved = step[:count] * usual
        turned = float(np.abs(moved[self.model.angles]).max())
        return np.clip(self.numbers + moved * min(1.0, _MAX_TURN / max(turned, 1e-12)), low, high)

    def _normal(self, weights: Weights) -> tuple[Numbers, Numbers]:
        """Return the normal matrix and right side, for the numbers and the errors of lines."""
        weight, columns, spreads = weights
        rows, count = np.hstack([self.jacobian, columns]), len(self.numbers)
        heavy = (rows * weight[:, None]).T
        inverse = np.append(1.0 / self.known[1], 1.0 / spreads) ** 2
        pull = heavy @ np.nan_to_num(self.residual)
        pull[:count] -= (self.numbers - self.known[0]) * inverse[:count]
        return heavy @ rows + np.diag(inverse), pull

    def _apart(self) -> Numbers:
        """Return residuals less the shift of their line, as far as lines shift."""
        lines, most = (
            self.model.lines,
            _COMMON * self.contrast.factor * self.model.planar.width(self.numbers),
        )
        errors, _ = lines.errors(self.residual, 1.0)
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
        reaches: How far edges are looked for in each round, px of the contrast.
        quick: Whether edges count by their distance alone, and no round ends the fit early.
    """
    for number, reach in enumerate(reaches):
        fit = _beside(model, contrast, numbers, reach)
        if np.count_nonzero(np.isfinite(fit.residual)) < 2 * len(numbers):
            break
        is_late = number >= _EARLY and not quick
        fitted = len(numbers) if is_late else None
        numbers = fit.step(fit.quick_weights(reach) if quick else fit.weights(fitted))
        if is_late and np.abs((numbers - fit.numbers) / fit.known[4]).max() < _DONE:
            break
    return _beside(model, contrast, numbers, max(reaches[-1], 3.0))


def _beside(model: OutlineModel, contrast: Contrast, numbers: Numbers, reach: float) -> Fit:
    """Return the outline of numbers, its derivatives along its normals, and the edges beside it."""
    steps = np.concatenate([_STEPS, np.full(len(numbers) - NUMBERS, 1e-4)])
    outline = model.outline(np.vstack([numbers, numbers + np.diag(steps)]), contrast.factor)
    projected = np.einsum("bnk,nk->bn", outline.point, outline.normal)
    jacobian = ((projected[1:] - projected[0]) / steps[:, None]).T
    return Fit(model, numbers, contrast, outline, jacobian, find_edges(contrast, outline, reach))


def _noise_of(errors: Numbers) -> float:
    finite = np.abs(errors[np.isfinite(errors)])
    return max(1.4826 * float(np.median(finite)), _MIN_NOISE) if finite.size else _MIN_NOISE


MIN_WIDTH = 25.0
"""Width of the tube below which angles are not measured, px."""

MAX_SPREAD = math.radians(0.5)
"""Standard deviation of one angle beyond which none is reported, rad."""

UNCERTAINTY = math.radians(0.11)
"""Root mean square of the standard deviations beyond which no angles are reported, rad."""

_APART = 3.0  # standard deviations by which the scale of a fit may differ from a known one
_MAX_NOISE = 1.0
_RIVAL = 12.0  # by how much the misfit of another shape must be larger
_OTHER = math.radians(0.7)  # by how much the angles of another shape differ
_MADE = 0.08  # outer radii: how far notches may differ from the robot file
_MAX_ROLL, _MAX_TILT = math.radians(25.0), math.radians(18.0)


def rejection_reason(
    fit: Fit, rivals: Iterable[tuple[float, float]], uncertainty: float = math.inf
) -> str:
    """Return why the fit is rejected, or an empty string.

    Args:
        fit: The best fit.
        rivals: By how much more other fits miss the edges, and by how much their angles differ.
        uncertainty: Root mean square of the standard deviations that is allowed, rad.
    """
    planar, prior, deviation = fit.model.planar, fit.model.prior, fit.deviation
    roll, tilt, _, *made = np.abs(fit.numbers[4:NUMBERS])
    more, worst = fit.numbers[3] - prior.log_scale[0], int(np.argmax(deviation))
    other = [differs for worse, differs in rivals if worse < _RIVAL and differs > _OTHER]
    mean = float(np.sqrt((deviation**2).mean()))
    lacking, width = missing(fit), planar.width(fit.numbers)
    reasons = {
        f"the tube is {width:.0f} pixels wide; it needs {MIN_WIDTH:.0f} or more, go nearer": (
            width < MIN_WIDTH
        ),
        f"the outer diameter gives a scale {100.0 * math.expm1(more):+.1f} % off the one that is "
        "given or that the board gives; check the diameter, and that the board lies in the plane "
        "of the robot": abs(more) > _APART * prior.log_scale[1],
        # Where parts are missing, view and cut are those of something else.
        lacking: lacking != "",
        "the robot is not seen from the side: it is rolled or tilted too far": (
            abs(math.remainder(roll, math.pi)) > _MAX_ROLL or tilt > _MAX_TILT
        ),
        "the notches differ from the robot file; check its depths and heights": (
            max(made) > _MADE * planar.outer
        ),
        f"edges lie {fit.noise:.1f} pixels beside the outline": fit.noise > _MAX_NOISE,
        f"the angle of notch {worst + 1} is uncertain by {math.degrees(deviation[worst]):.1f} deg "
        "(standard deviation)": not (deviation <= MAX_SPREAD).all(),
        "two shapes fit almost equally well; their angles differ by up to "
        f"{math.degrees(max(other, default=0.0)):.1f} deg": len(other) > 0,
        f"the angles are uncertain by {math.degrees(mean):.3f} deg (standard deviations, root mean "
        f"square), and {math.degrees(uncertainty):g} deg are allowed; go nearer, take it sharper "
        "and in even light, or allow more": mean > uncertainty,
    }
    return next((reason for reason, holds in reasons.items() if holds), "")


_MIN_SCORE, _MIN_SIDE, _MIN_BASE, _MIN_TIP = 0.7, 0.5, 0.35, 0.5
_MAX_HIDDEN, _MIN_OTHER = 1, 0.7  # rings of which one side looks like the background
_MIN_FACES, _MIN_SPINES, _MIN_INNER = 0.35, 0.5, 0.3
_FEW = 6  # points: less of a part says nothing


def missing(fit: Fit) -> str:
    """Return why the fit is rejected for a part that is not seen, or an empty string."""
    model, n = fit.model, fit.model.planar.notches
    is_near, looked = np.abs(fit.residual) < MAX_RESIDUAL, fit.edges.looked
    if fit.score < _MIN_SCORE:
        return (
            f"only {100.0 * fit.score:.0f} % of the outline that the robot file gives is found in "
            "the photograph"
        )
    side, face, spine = (model.kind == kind for kind in (SIDE, FACE, SPINE))
    shares = np.array([
        [is_near[side & (model.ring == ring) & (model.which == which)].mean() for which in (-1, 1)]
        for ring in range(n + 1)
    ])  # fmt: skip
    is_hidden = shares.min(axis=1) < np.array([_MIN_BASE, *n * [_MIN_SIDE]])
    is_gone = is_hidden & (shares.max(axis=1) < _MIN_OTHER)
    elsewhere = "not seen where the robot file has"
    if is_gone.any() or is_hidden.sum() > _MAX_HIDDEN:
        ring = int(np.argmax(is_gone if is_gone.any() else is_hidden))
        tube = f"the tube behind notch {ring}" if ring else "the tube before notch 1"
        return f"a side of {tube} is {elsewhere} it"
    notch = model.ring + (model.which > 0)  # of a face
    # A robot laid out on its wrong side fits rings, but its spines lie where there is nothing.
    inward = model.which * np.append(0.0, model.planar.side)[model.ring] > 0.0
    parts = [(face & (notch > n), _MIN_TIP, f"the tip is {elsewhere} it")]
    parts += [
        (face & looked & (notch == k), _MIN_FACES, f"the faces of notch {k} are {elsewhere} them")
        for k in range(1, n + 1)
    ]
    parts += [
        (spine & ~inward, _MIN_SPINES, f"the spines beside the notches are {elsewhere} them"),
        (
            spine & inward & looked,
            _MIN_INNER,
            f"the inner edges of the notches are {elsewhere} them; check depth and cut",
        ),
    ]
    for part, least, words in parts:
        if part.sum() > _FEW and is_near[part].mean() < least:
            return words
    return ""
