"""Fitting every notch of a nearly straight robot in one photograph."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from threadpoolctl import threadpool_limits

from notchflex.photographs.board.ruler import NO_RULER, Ruler
from notchflex.photographs.chain.camera import NUMBERS
from notchflex.photographs.chain.chain_table import ChainTable, Numbers
from notchflex.photographs.chain.outline import OutlineModel, spine_edge
from notchflex.photographs.contrast import contrast
from notchflex.photographs.fitting import Fit, covariance, misfit, refine
from notchflex.photographs.judging import rejection_reason
from notchflex.photographs.locating import EDGE_NOISE, locate
from notchflex.photographs.measure import (
    NO_TUBE,
    judged_photograph,
    refused_photograph,
    smaller,
)
from notchflex.photographs.measured import MeasuredPhotograph
from notchflex.photographs.missing import MAX_RESIDUAL
from notchflex.photographs.start import reversed_view

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


class StraightFit(NamedTuple):
    """Notches of a robot measured in one photograph. Lengths mm.

    Attributes:
        photograph: The fit as a photograph, with the reason if it was refused.
        lengths: Heights and uncut lengths less those of the robot file, (2 n,).
        spread: Their covariance, (2 n, 2 n).
        edge: How high over the axis the inner edge of every spine is seen, (n,).
        edge_spread: Their covariance, (n, n).
    """

    photograph: MeasuredPhotograph
    lengths: Numbers
    spread: Numbers
    edge: Numbers
    edge_spread: Numbers


# Of matrices this small, threads of the linear algebra only cost.
@threadpool_limits.wrap(limits=1)
def fit_straight(
    picture: NDArray[np.uint8], table: ChainTable, name: str, ruler: Ruler = NO_RULER
) -> StraightFit:
    """Fit heights, depths and places of all notches to a photograph, (height, width, 3)."""
    n = table.notches
    picture, factor = smaller(picture)
    reading = ruler.read(picture, factor)
    if isinstance(reading, str):
        return _refused(refused_photograph(name, table, reading), n)
    whole = reading.hidden(contrast(picture))
    located = locate(table, whole, reading)
    if located is None:
        return _refused(refused_photograph(name, table, NO_TUBE), n)
    if np.abs(located.fit.numbers[NUMBERS:]).max() > 1.5 * _MAX_ANGLE:
        return _refused(refused_photograph(name, table, _BENT), n)
    numbers = np.concatenate([located.fit.numbers, np.zeros(3 * n + 1)])
    wide = 2.0 * table.outer * math.exp(numbers[3]) / located.factor
    fine = min(1.0, _WIDTH / wide)
    numbers[:2] *= fine / located.factor
    numbers[3] += math.log(fine / located.factor)
    image = whole.reduced(fine)
    middle = (np.array(image.value.shape[::-1]) - 1.0) / 2.0
    reach = max(_LAST, _REACH * wide * fine)
    reaches = [reach, reach, reach, *(_ROUNDS * [_LAST])]
    view_prior = located.model.prior.smaller(fine / located.factor)
    model = replace(located.model, corner=_CORNER, shift=_SHIFT, prior=view_prior)
    fit = _best(
        [
            refine(model, image, start, reaches, middle, MAX_RESIDUAL)
            for start in _tilted(table, numbers)
        ],
        model,
    )
    result = located._replace(fit=fit, model=model, factor=fine)
    both, noise = covariance(fit, model)
    angles = slice(NUMBERS, NUMBERS + n)
    deviation = np.sqrt(np.maximum(np.diag(both)[angles], 0.0))
    reason = rejection_reason(result, deviation, noise)
    if not reason and np.abs(fit.numbers[angles]).max() > _MAX_ANGLE:
        reason = _BENT
    judged = (reason, noise, factor * fine)
    photograph = judged_photograph(name, result, both[angles, angles], judged, middle)
    rows, slopes = _lengths(n, len(numbers)), _edge_slopes(table, fit.numbers)
    return StraightFit(
        photograph,
        rows @ fit.numbers,
        rows @ both @ rows.T,
        _edges(table, fit.numbers),
        slopes @ both @ slopes.T,
    )


def _refused(photograph: MeasuredPhotograph, n: int) -> StraightFit:
    none, spread = np.full(n, np.nan), np.zeros((0, 0))
    return StraightFit(photograph, np.tile(none, 2), spread, none, spread)


def _tilted(table: ChainTable, numbers: Numbers) -> list[Numbers]:
    """Return starts whose views differ: edges of a straight robot hardly show them at first."""
    tilted: list[Numbers] = []
    roll, tilt = float(numbers[4]), float(numbers[5])
    mirrored = float(reversed_view(numbers)[4])
    for view in ((roll, tilt), (roll, -tilt), (roll, 0.0), (mirrored, 0.0)):
        start = numbers.copy()
        start[4:7] = *view, 0.003 / table.outer
        tilted.append(start)
    return tilted


def _best(fits: list[Fit], model: OutlineModel) -> Fit:
    noise = max(EDGE_NOISE, min(covariance(fit, model)[1] for fit in fits))
    return min(fits, key=lambda fit: misfit(fit, model, noise))


def _lengths(n: int, count: int) -> Numbers:
    """Return heights and uncut lengths as sums of the numbers that were fitted, (2 n, count)."""
    first, moved = NUMBERS + n, NUMBERS + 3 * n
    rows = np.zeros((2 * n, count))
    for notch in range(n):
        rows[notch, [7, first + notch]] = 1.0
    for notch in range(n):
        uncut = rows[n + notch]
        uncut[moved + notch + 1], uncut[moved + notch] = 1.0, -1.0
        uncut -= 0.5 * rows[notch]
        if notch + 1 < n:
            uncut -= 0.5 * rows[notch + 1]
    return rows


def _edges(table: ChainTable, numbers: Numbers) -> Numbers:
    n = table.notches
    cut = numbers[8] + numbers[NUMBERS + 2 * n : NUMBERS + 3 * n]
    return seen_edges(table, cut, float(numbers[4]))


def seen_edges(table: ChainTable, cut: Numbers, roll: float) -> Numbers:
    """Return how high over the axis the inner edges of spines are seen, (n,).

    Args:
        table: The robot.
        cut: What the notches are deeper than in the robot file, (n,).
        roll: Roll about the tube axis, rad.
    """
    x, y = np.full(len(cut), abs(math.cos(roll))), np.full(len(cut), abs(math.sin(roll)))
    return spine_edge(table, np.arange(table.notches), cut, x, y)


def _edge_slopes(table: ChainTable, numbers: Numbers) -> Numbers:
    steps = _STEP * np.eye(len(numbers))
    edges = _edges(table, numbers)
    return np.stack([_edges(table, numbers + step) - edges for step in steps], axis=1) / _STEP
