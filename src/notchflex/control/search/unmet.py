"""Why a search for a target went no further."""

from __future__ import annotations

import numpy as np
from jaxtyping import Float, Int

from notchflex.control.search.problem import Problem
from notchflex.control.search.search_point import KEPT, SearchPoint
from notchflex.errors import Failure

# An error whose slope by the drives is this part of what it could be is as small as it gets.
_FLAT = 1e-6


def why_unmet(
    problem: Problem,
    point: SearchPoint,
    entries: Int[np.ndarray, " m"],
    weights: Float[np.ndarray, " m"],
    scale: float,
    settled: bool,
) -> Failure:
    """Return why a target is not met.

    Args:
        problem: Target quantities and limits.
        point: Where the search ended.
        entries: Entries of a response that have a target.
        weights: What an error of each counts.
        scale: Size of the drives.
        settled: Whether no step helped; otherwise the budget was spent.
    """
    free = np.flatnonzero(problem.driven)
    if not point.response.converged:
        return Failure.SEARCH_STOPPED
    slopes = weights[:, None] * point.slopes[entries]
    down = -(slopes.T @ point.miss)
    flat = _FLAT * float(np.linalg.norm(slopes)) * point.error
    if np.abs(down).max() <= flat:
        return Failure.TARGET_OUT_OF_REACH
    edge, drive = 1e-9 * scale, point.drive[free]
    low, high = problem.low[free], problem.high[free]
    at_low, at_high = (
        (drive <= low + edge) & (down < 0.0),
        (drive >= high - edge) & (down > 0.0),
    )
    # What of the way down is left where limits forbid the rest of it.
    left = np.where(at_low | at_high, 0.0, down)
    tight = point.limits[point.room <= KEPT]
    if len(tight):
        along = left - tight.T @ np.linalg.lstsq(tight.T, left, rcond=None)[0]
        if np.abs(along).max() <= flat:
            return Failure.LIMITS_PREVENT
    if np.abs(left).max() > flat:
        return Failure.TARGET_OUT_OF_REACH if settled else Failure.SEARCH_STOPPED
    # A tendon cannot push, and cannot be pulled for ever: these are not limits of anybody.
    chosen = (at_low & (low > 0.0)) | (at_high & problem.chosen[free])
    return Failure.LIMITS_PREVENT if chosen.any() else Failure.TARGET_OUT_OF_REACH
