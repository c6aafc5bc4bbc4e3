"""Measuring notches as they were cut, in photographs of a straight robot.

From the side, a notch that is rolled a little looks like one that is less deep. One photograph does
not tell which it is; photographs between which the robot was turned by known angles do.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from functools import partial
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import approx_fprime, least_squares
from threadpoolctl import threadpool_limits

from notchflex import ArcNotch, InputError, Robot
from notchflex.photographs.board import NO_RULER, Board, Ruler
from notchflex.photographs.edges import Numbers
from notchflex.photographs.fitting import refine, rejection_reason
from notchflex.photographs.locating import EDGE_NOISE, reversed_view
from notchflex.photographs.measure import (
    Photographs,
    Progress,
    judged_photograph,
    names_of,
    pictures_of,
    see,
)
from notchflex.photographs.measured import MeasuredCut, MeasuredPhotograph
from notchflex.photographs.outline import (
    USUAL_DISTANCE,
    OutlineModel,
    PlanarRobot,
    View,
    spine_edge,
)
from notchflex.support import check_number

_WIDTH = 300.0  # of the tube beyond which a photograph is made smaller, px
_REACH, _LAST = 0.08, 4.0  # of the width of the tube, and px, within which edges are looked for
_ROUNDS = 30
_CORNER = 0.35  # outer radii: blurred corners beside spines shift ends
_BENT = "the robot is bent; photograph it straight"
_MAX_ANGLE = math.radians(12.0)
_STEP = 1e-5  # mm, rad
_SHIFT = 0.2
"""How far blur and shading shift all edges of a photograph alike, px: by that the tube looks wider
and all notches look lower, or the other way round. Nothing else in the photograph shows it."""


_NOTHING = np.zeros(0)


class StraightFit(NamedTuple):
    """Notches of a robot measured in one photograph. Lengths mm.

    Attributes:
        photograph: The fit as a photograph; with a reason nothing else is said.
        lengths: Heights and uncut lengths less those of the robot file, (2 n,).
        spread: Their covariance, (2 n, 2 n).
        edge: How high over the axis the inner edge of every spine is seen, (n,).
        edge_spread: Their covariance, (n, n).
    """

    photograph: MeasuredPhotograph
    lengths: Numbers = _NOTHING
    spread: Numbers = _NOTHING
    edge: Numbers = _NOTHING
    edge_spread: Numbers = _NOTHING


# Of matrices this small, threads of the linear algebra only cost.
@threadpool_limits.wrap(limits=1)
def fit_straight(
    picture: NDArray[np.uint8], planar: PlanarRobot, name: str, ruler: Ruler = NO_RULER
) -> StraightFit:
    """Fit heights, depths and places of all notches to a photograph, (height, width, 3)."""
    n = planar.notches
    located = see(picture, planar, ruler)
    if isinstance(located, str):
        return StraightFit(MeasuredPhotograph.refused(name, n, located))
    first = located.fit
    if np.abs(first.numbers[first.model.angles]).max() > 1.5 * _MAX_ANGLE:
        return StraightFit(MeasuredPhotograph.refused(name, n, _BENT))
    width = planar.width(first.numbers)
    image = located.contrast.reduced(_WIDTH / width)
    reaches = [*3 * [max(_LAST, _REACH * width * image.factor)], *_ROUNDS * [_LAST]]
    model = OutlineModel(planar, corner=_CORNER, shift=_SHIFT, prior=first.model.prior)
    start = np.pad(first.numbers, (0, 3 * n + 1))
    fits = [refine(model, image, view, reaches) for view in _tilted(planar, start)]
    noise = max(EDGE_NOISE, min(fit.noise for fit in fits))
    fit = min(fits, key=lambda fit: fit.misfit(noise))
    reason = rejection_reason(fit, located.rivals)
    if not reason and np.abs(fit.numbers[model.angles]).max() > _MAX_ANGLE:
        reason = _BENT
    photograph = judged_photograph(name, fit, reason)
    lengths = _lengths(planar, fit.numbers)
    slopes: Any = approx_fprime(fit.numbers, partial(_lengths, planar), _STEP)
    spread, edge = slopes @ fit.covariance @ slopes.T, slice(2 * n, None)
    return StraightFit(
        photograph, lengths[: 2 * n], spread[: 2 * n, : 2 * n], lengths[edge], spread[edge, edge]
    )


def _tilted(planar: PlanarRobot, numbers: Numbers) -> Numbers:
    """Return starts whose views differ: edges of a straight robot hardly show them at first."""
    roll, tilt = numbers[4:6]
    starts = np.tile(numbers, (4, 1))
    starts[:, 4] = roll, roll, roll, reversed_view(numbers)[4]
    starts[:, 5] = tilt, -tilt, 0.0, 0.0
    starts[:, 6] = USUAL_DISTANCE / planar.outer
    return starts


def _lengths(planar: PlanarRobot, numbers: Numbers) -> Numbers:
    """Return what heights and uncut lengths are more than in the file, and `seen_edges`, (3 n,)."""
    view = View(numbers[None], planar.notches)
    height, moved = view.kerf[0], view.moved[0]
    uncut = np.diff(moved) - 0.5 * (height + np.append(height[1:], 0.0))
    return np.concatenate([height, uncut, seen_edges(planar, view.cut[0], numbers[4])])


def seen_edges(planar: PlanarRobot, cut: Numbers, roll: float) -> Numbers:
    """Return how high over the axis the inner edges of spines are seen, (n,).

    Args:
        planar: The robot.
        cut: What the notches are deeper than in the robot file, (n,).
        roll: Roll about the tube axis, rad.
    """
    notches = np.arange(planar.notches)
    return spine_edge(planar, notches, cut, abs(math.cos(roll)), abs(math.sin(roll)))


_ROLL = math.radians(10.0)  # usual roll of a robot that was laid down with care
_DEPTH = 0.2  # outer radii: how far a depth may be off
_TURN = math.radians(0.3)  # how well a turn is known
_MIN_SPREAD = 1e-4  # mm: no edge is known better
_STARTS = np.radians(np.arange(-24.0, 25.0, 6.0))


def depths(
    planar: PlanarRobot, fits: Sequence[StraightFit], turns: Numbers
) -> tuple[Numbers, Numbers, float]:
    """Return what notches are deeper than in the robot file, and standard deviations, mm, (n,).

    The third is the largest residual, in standard deviations.

    Args:
        planar: The robot.
        fits: What the photographs say.
        turns: By how much the robot was turned about its axis for each of them, rad.
    """
    n = planar.notches
    scales = np.array([*n * [_DEPTH * planar.outer], _ROLL, *len(fits) * [_TURN]])
    least = _MIN_SPREAD**2 * np.eye(n)
    weights = [np.linalg.inv(np.linalg.cholesky(fit.edge_spread + least)) for fit in fits]

    def residuals(scaled: Numbers) -> Numbers:
        cut, roll, errors = np.split(scaled * scales, [n, n + 1])
        apart = [
            weight @ (seen_edges(planar, cut, angle) - fit.edge)
            for weight, fit, angle in zip(weights, fits, roll + turns + errors, strict=True)
        ]
        return np.concatenate([*apart, scaled])

    starts = np.outer(_STARTS / _ROLL, np.arange(len(scales)) == n)
    best = min((least_squares(residuals, start) for start in starts), key=lambda fit: fit.cost)
    deviation = scales * np.sqrt(np.diag(np.linalg.inv(best.jac.T @ best.jac)))
    return (best.x * scales)[:n], deviation[:n], float(np.abs(best.fun).max())


MAX_TURN_DEG = 40.0
"""Most that the robot is turned between photographs, deg: all are taken from the side."""

_APART = 5.0  # standard deviations by which photographs may contradict each other


def measure_cut(
    photographs: Photographs,
    robot: Robot,
    *,
    turn_deg: float | Sequence[float] = (),
    scale: float | None = None,
    board: Board | None = None,
    progress: Progress | None = None,
) -> MeasuredCut:
    """Measure height, depth and uncut length of every notch in photographs of the straight robot.

    From the side, a notch that is rolled looks like one that is less deep. Two photographs between
    which the robot was turned by some 20 deg about its axis separate roll from depth; with one,
    the standard deviations of the depths are some percent of the outer diameter.

    Args:
        photographs: One file or several: PNG, JPEG or TIFF.
        robot: The robot in all of them; its notches are arcs and bend in one plane.
        turn_deg: By how much the robot was turned about its axis for each photograph after the
            first, from the first on, deg; known to about 0.3 deg.
        scale: Pixels of the photographs per mm at the robot, known to 0.3 %.
        board: Board of markers beside the robot.
        progress: Called with the stage, how many photographs are done, and how many there are.

    Returns:
        Lengths with standard deviations, or the reason why there are none.

    Raises:
        InputError: A file is not a photograph, the robot is of another kind, the number of turns
            differs from the number of photographs, scale or board are invalid, or
            `opencv-python-headless` is not installed.

    Example:
        >>> import notchflex as nf
        >>> robot = nf.load_robot("wrist.toml")  # doctest: +SKIP
        >>> cut = nf.measure_cut(["a.jpg", "b.jpg"], robot, turn_deg=20)  # doctest: +SKIP
        >>> cut.write_robot("wrist-as-cut.toml")  # doctest: +SKIP
    """
    names = names_of(photographs)
    form, given = "a number or a list of numbers", np.ravel(np.asarray(turn_deg, object))
    turns = np.array([check_number(turn, "turn_deg", form) for turn in given])
    if len(turns) != len(names) - 1:
        raise InputError.WRONG_SHAPE(
            f"{len(names)} photographs need {len(names) - 1} turns, one for each after the first; "
            f"got {turns.size}"
        )
    if not (np.abs(turns) <= MAX_TURN_DEG).all():
        raise InputError.OUT_OF_RANGE(
            f"turns must lie between -{MAX_TURN_DEG:g} and {MAX_TURN_DEG:g} deg, not "
            f"{', '.join(f'{turn:g}' for turn in turns)}"
        )
    turns = np.radians(np.concatenate([[0.0], turns]))
    planar, ruler = PlanarRobot(robot), Ruler(scale, board)
    fits = [
        fit_straight(picture, planar, name, ruler) for name, picture in pictures_of(names, progress)
    ]
    return combined(planar, fits, turns)


def combined(planar: PlanarRobot, fits: Sequence[StraightFit], turns: Numbers) -> MeasuredCut:
    """Return what photographs say together.

    Args:
        planar: The robot.
        fits: What each photograph says.
        turns: By how much the robot was turned for each of them, rad.
    """
    photographs = tuple(fit.photograph for fit in fits)
    values = np.full((6, planar.notches), np.nan)
    refused = [f"{seen.source}: {seen.reason}" for seen in photographs if seen.reason]
    reason = refused[0] if refused else ""
    if not refused:
        lengths, spread, apart = _mean(fits)
        cut, cut_deviation, apart_in_depth = depths(planar, fits, turns)
        if apart > _APART:
            reason = "the photographs contradict each other in heights"
        elif apart_in_depth > _APART:
            reason = "the photographs contradict each other; check the turns"
        else:
            arcs = [notch for notch in planar.robot.notches if isinstance(notch, ArcNotch)]
            depth = np.array([arc.depth for arc in arcs])
            # Depths may count from elsewhere than the outer surface.
            beyond = planar.depth - planar.outer
            is_off = np.abs(beyond) > 1e-6
            slope = np.divide(depth - planar.outer, beyond, out=np.ones_like(depth), where=is_off)
            height, uncut = np.split(lengths, 2)
            values[:3] = planar.height + height, depth + slope * cut, planar.uncut + uncut
            values[[3, 5]], values[4] = np.split(spread, 2), slope * cut_deviation
    return MeasuredCut(planar.robot, photographs, turns, reason, *values)


def _mean(fits: Sequence[StraightFit]) -> tuple[Numbers, Numbers, float]:
    """Return the weighted mean of lengths, standard deviations, and how far fits lie apart."""
    weights = [np.linalg.pinv(fit.spread, hermitian=True) for fit in fits]
    covariance = np.linalg.pinv(sum(weights), hermitian=True)
    mean = covariance @ sum(weight @ fit.lengths for weight, fit in zip(weights, fits, strict=True))
    apart = max(
        float((np.abs(fit.lengths - mean) / np.sqrt(np.diag(fit.spread))).max()) for fit in fits
    )
    # Blur and shading shift edges equally in all photographs: a mean of several is no better.
    return mean, np.sqrt(len(fits) * np.diag(covariance)), apart
