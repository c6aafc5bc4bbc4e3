"""Smaller tensions that meet the same target.

Friction lets a range of tensions hold one shape: between turning round and the first slip of a
contact nothing moves, nor do notches that are pressed together. A search stops at any of them, for
the target is met. The smallest lies at the lower end of the range. And where more tendons are
driven than the target needs, one that was slack may have been pulled though the others suffice.
"""

from __future__ import annotations

import numpy as np
from jaxtyping import Float

from notchflex import Failure
from notchflex.control.search.iterative_search import solve_directly, within_limits
from notchflex.control.search.problem import Attempt, Problem, size_of
from notchflex.control.search.starts import corners

# Relative accuracy of the lower end of a range of tensions.
_EXACT = 5e-7
# If a tension next to the end still holds, the next one is lower by this part; the part then grows
# by this factor.
_FURTHER, _MORE = 0.01, 4.0
# From below, slopes lead to the end; this part of the way, so as not to pass it.
_PART_OF_WAY = 0.9999
_MAX_SOLVES = 30
# Tendons that were slack, with at most this part of the largest tension, are left out on trial.
_SMALL = 0.1
# A tendon that slid by less than this since the state before, mm, sticks or is about to slip.
_NO_SLIP = 1e-6
# Notches count as closed if the target changes by less than this (mm, N or rad) for a change of the
# tension by about the closing tension of a notch.
_STUCK = 0.1
# The end of the range in which the first contact sticks is passed by this part of it: there slopes
# are those of a sliding tendon, and no lower tension holds.
_PASSED = 1e-9


def smaller_tensions(
    problem: Problem,
    before: Float[np.ndarray, " state"],
    start: Float[np.ndarray, " t"],
    goal: Float[np.ndarray, " m"],
    attempt: Attempt,
) -> Attempt:
    """Return the smallest tensions that meet a target as those that were found do.

    Args:
        problem: Target quantities and limits.
        before: The state before, packed.
        start: Its drives.
        goal: The target; NaN where an entry is free.
        attempt: What was found; returned as it is where the target is not met, or where strokes are
            driven, which friction leaves no range.
    """
    if attempt.failure is not None or not problem.by_tension:
        return attempt
    attempt = _without_others(problem, before, start, goal, attempt)
    low, _ = problem.model.dead_band(before)
    for tendon in np.flatnonzero(problem.driven & (attempt.drive > problem.low)):
        sticks = problem.model.slip(before, attempt.response.state)[tendon] <= _NO_SLIP
        if sticks or _holds(problem, goal, attempt, int(tendon)):
            attempt = _lowered(problem, before, goal, attempt, int(tendon), float(low[tendon]))
    return attempt


def _without_others(
    problem: Problem, before: np.ndarray, start: np.ndarray, goal: np.ndarray, attempt: Attempt
) -> Attempt:
    """Meet the target by the tendons that were taut, if that takes less."""
    taut = problem.driven & (start > problem.low)
    slack = problem.driven & ~taut & (attempt.drive > problem.low)
    drives = attempt.drive
    if not slack.any() or not taut.any() or drives[slack].max() > _SMALL * drives.max():
        return attempt
    own, least, solves = problem._replace(driven=taut), attempt, attempt.solves
    rest = np.where(problem.driven & ~taut, problem.low, attempt.drive)
    for begin in (rest, start, *corners(problem, before, start, taut)):
        other = solve_directly(own, before, begin, goal)
        solves += other.solves
        if other.failure is None and other.effort < least.effort:
            least = other
    return least._replace(solves=solves)


def _lowered(
    problem: Problem,
    before: np.ndarray,
    goal: np.ndarray,
    attempt: Attempt,
    tendon: int,
    edge: float,
) -> Attempt:
    """Lower one tension as far as the target stays met."""
    floor, best, solves = float(problem.low[tendon]), attempt, attempt.solves
    below, further = None, _FURTHER
    edge *= 1.0 - _PASSED
    guess = edge if floor < edge < attempt.drive[tendon] else _just_below(best, tendon)
    for _ in range(_MAX_SOLVES):
        guess = max(guess, floor)
        trial = _at(problem, before, goal, best, tendon, guess)
        solves += 1
        top = float(best.drive[tendon])
        if trial.failure is None:
            nudged = top - guess <= 2.0 * _EXACT * top
            best, top = trial, guess
            if guess <= floor or (guess == edge and not _holds(problem, goal, best, tendon)):
                break
            if not nudged:
                guess = _just_below(best, tendon)
            elif below is None:
                guess, further = top * (1.0 - further), _MORE * further
            else:
                guess = 0.5 * (below + top)
        else:
            below = guess
            # How much higher the tension must be to meet the target, by the slopes.
            steep = _steepness(problem, goal, trial, tendon)
            is_known = steep > 0.0 and trial.response.converged
            onward = below + _PART_OF_WAY * trial.error / steep if is_known else np.nan
            guess = onward if below < onward < top else 0.5 * (below + top)
        if below is not None and top - below <= _EXACT * top * (1.0 + 1e-6):
            break
        further = min(further, 0.5)
    return best._replace(solves=solves)


def _just_below(attempt: Attempt, tendon: int) -> float:
    return float(attempt.drive[tendon]) * (1.0 - _EXACT)


def _at(
    problem: Problem, before: np.ndarray, goal: np.ndarray, like: Attempt, tendon: int, value: float
) -> Attempt:
    """Solve with one tension changed."""
    drive = like.drive.copy()
    drive[tendon] = value
    response = problem.model.solve(before, drive)
    miss = problem.weights * (response.values[problem.entries] - goal)
    error = size_of(miss[~np.isnan(goal)])
    met = response.converged and error <= problem.search.tolerance
    failure = None if met else Failure.SEARCH_STOPPED
    return within_limits(problem, Attempt(drive, response, error, 0.0, 1, failure))


def _holds(problem: Problem, goal: np.ndarray, attempt: Attempt, tendon: int) -> bool:
    """Whether the slopes by a tension are those of notches that are pressed together."""
    return _steepness(problem, goal, attempt, tendon) * problem.unit <= _STUCK


def _steepness(problem: Problem, goal: np.ndarray, attempt: Attempt, tendon: int) -> float:
    """Size of the slopes of the target quantities by a tension, mm, N or rad by weights, per N."""
    slopes = problem.weights * attempt.response.jacobian[problem.entries, tendon]
    return size_of(slopes[~np.isnan(goal)])
