"""Drives to start a search from, where that from the present drives fails."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import product

import numpy as np
from jaxtyping import Bool, Float

from notchflex.control.program.drive_model import Response
from notchflex.control.search.problem import Problem, size_of

# Just beyond the dead bands of the present drives, by this part of them,
_BEYOND_BAND = 1e-3
# from these parts of them,
_STARTS = (0.5, 0.1, 0.0)
# from each tendon pulled alone by this part of what about closes a notch.
_ALONE = 0.15
# The part of the way to a target that slopes may leave, for drives to be worth trying.
_MAY_DO = 0.5
# Of more tendons than these not all combinations of sides are tried.
_MAX_CORNERS = 3


def other_starts(
    problem: Problem, before: Float[np.ndarray, " state"], start: Float[np.ndarray, " t"]
) -> Iterator[tuple[Float[np.ndarray, " t"], bool]]:
    """Yield drives to start from, and whether the search leaves dead bands out.

    Drives just beyond the dead band of each tendon, parts of all, and each tendon pulled alone.
    """
    driven = np.flatnonzero(problem.driven)
    taut = [tendon for tendon in driven if start[tendon] > 0.0]
    low, high = problem.model.dead_band(before)
    for tendon in taut if len(taut) > 1 else ():
        for side, edge in ((-1.0, low), (1.0, high)):
            beyond = start.copy()
            beyond[tendon] = (1.0 + side * _BEYOND_BAND) * edge[tendon]
            yield beyond, False
    for part in _STARTS:
        yield part * start, True
    for tendon in driven:
        alone = np.maximum(problem.low, 0.0)
        alone[tendon] += _ALONE * problem.unit
        yield alone, True


def taut_tendons_suffice(
    problem: Problem,
    taut: Bool[np.ndarray, " t"],
    goal: Float[np.ndarray, " m"],
    known: Response,
) -> bool:
    """Whether slopes promise that tendons that are taut come near a target without the others.

    Args:
        problem: Target quantities.
        taut: Which tendons those are.
        goal: The target; NaN where an entry is free.
        known: Values and slopes of the state before.
    """
    rows = ~np.isnan(goal)
    weights, entries = problem.weights[rows], problem.entries[rows]
    miss = weights * (goal[rows] - known.values[entries])
    slopes = weights[:, None] * known.sliding[entries][:, taut]
    if not np.isfinite(slopes).all():
        return False
    step = np.linalg.lstsq(slopes, miss, rcond=None)[0]
    return size_of(miss - slopes @ step) <= _MAY_DO * size_of(miss)


def corners(
    problem: Problem,
    before: Float[np.ndarray, " state"],
    start: Float[np.ndarray, " t"],
    moved: Bool[np.ndarray, " t"],
) -> Iterator[Float[np.ndarray, " t"]]:
    """Yield drives just beyond the dead bands of some tendons, on every side of them.

    Args:
        problem: The limits.
        before: The state before, packed.
        start: Its drives.
        moved: Which tendons are moved; the others stay.
    """
    low, high = problem.model.dead_band(before)
    edges = np.where([[True], [False]], low * (1.0 - _BEYOND_BAND), high * (1.0 + _BEYOND_BAND))
    tendons = np.flatnonzero(moved)
    many = len(tendons) > _MAX_CORNERS
    sides = (
        product((0, 1), repeat=len(tendons))
        if not many
        else ((one,) * len(tendons) for one in (0, 1))
    )
    for side in sides:
        corner = start.copy()
        corner[tendons] = edges[list(side), tendons]
        yield np.clip(corner, problem.low, problem.high)
