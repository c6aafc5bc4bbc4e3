"""Drives that may change by a rate only from target to target."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from jaxtyping import Float

from notchflex import Failure
from notchflex.control.program.drive_model import Response
from notchflex.control.search.iterative_search import search_iteratively, within_limits
from notchflex.control.search.problem import Attempt, Problem, size_of

# A drive that changes by less than this part of the largest counts as unchanged.
_STAYS = 1e-9


def limit_rate(problem: Problem, present: Float[np.ndarray, " t"], rate: float) -> Problem:
    """Return the problem with drives no farther from the present ones than the rate.

    Args:
        problem: Target quantities and limits.
        present: The present drives, N or mm.
        rate: Largest change, N or mm; infinite where there is none.
    """
    if not np.isfinite(rate):
        return problem
    low = np.maximum(problem.low, np.where(problem.driven, present - rate, -np.inf))
    high = np.minimum(problem.high, np.where(problem.driven, present + rate, np.inf))
    return problem._replace(
        low=np.minimum(low, high), high=high, chosen=np.ones_like(problem.chosen)
    )


def cross_dead_bands(
    problem: Problem,
    rate: float,
    before: Float[np.ndarray, " state"],
    present: Float[np.ndarray, " t"],
    goal: Float[np.ndarray, " m"],
    attempt: Attempt,
    known: Response | None = None,
) -> Attempt:
    """Go on through dead bands that are wider than the rate.

    Within its dead band a tendon moves nothing, so a search that may not go beyond finds no reason
    to turn it round. Here the target is sought without the rate, and tendons that stay in such a
    band go towards what that needs, as far as the rate lets them.

    Args:
        problem: Target quantities and limits, without the rate.
        rate: Largest change of a drive, N or mm.
        before: The state before, packed.
        present: Its drives.
        goal: The target; NaN where an entry is free.
        attempt: What was found within the rate.
        known: Values and slopes of the state before, where they are known.

    Returns:
        What was found, where no tendon has a dead band to cross; otherwise the state on the way,
        which fails as `LIMITS_PREVENT`.
    """
    left = problem.search.solves - attempt.solves - 1
    if attempt.failure is None or not np.isfinite(rate) or left <= 0:
        return attempt
    near = limit_rate(problem, present, rate)
    low, high = problem.model.dead_band(before)
    least = _STAYS * max(float(np.abs(present).max()), problem.unit)
    waits = problem.driven & (np.abs(attempt.drive - present) <= least)
    waits &= (near.low > low) | (near.high < high)
    if not waits.any():
        return attempt
    fewer = problem._replace(search=replace(problem.search, solves=left))
    ahead = search_iteratively(fewer, before, present, goal, known)
    attempt = attempt._replace(solves=attempt.solves + ahead.solves)
    drive = np.where(waits, np.clip(ahead.drive, near.low, near.high), attempt.drive)
    better = ahead.response.converged and ahead.error < attempt.error
    if not better or (np.abs(drive - present) <= least).all():
        return attempt
    response = problem.model.solve(before, drive)
    attempt = attempt._replace(solves=attempt.solves + 1)
    if not response.converged:
        return attempt
    rows = np.flatnonzero(~np.isnan(goal))
    miss = problem.weights[rows] * (response.values[problem.entries[rows]] - goal[rows])
    error = size_of(miss)
    failure = None if error <= problem.search.tolerance else Failure.LIMITS_PREVENT
    return within_limits(near, Attempt(drive, response, error, 0.0, attempt.solves, failure))
