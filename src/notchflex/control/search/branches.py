"""The load path to a target: direct, or through an overshoot that reverses friction.

At one tension a robot is bent more after unloading than after loading. A target can often be met on
either branch: by loading up to it, or by overshooting it and unloading.
"""

from __future__ import annotations

from collections.abc import Iterator
from functools import partial
from typing import Literal, NamedTuple

import numpy as np
from jaxtyping import Float

from notchflex import Failure
from notchflex.control.program.drive_model import Response
from notchflex.control.search.iterative_search import (
    largest_violation,
    limit_rows,
    search_iteratively,
    solve_directly,
)
from notchflex.control.search.problem import Attempt, Problem
from notchflex.control.search.smaller import smaller_tensions
from notchflex.control.search.starts import corners, other_starts, taut_tendons_suffice

Approach = Literal["direct", "loading", "unloading", "least"]

# Overshoot beyond the drives that reverse all contacts, relative.
_OVERSHOOT = 0.05
# Relative tolerance of limits.
KEPT = 1e-6
# A target is out of reach if one of this number of last searches reduces the error by less than
# this part.
_LAST_SEARCHES, _NO_NEARER = 3, 1e-6


class ApproachPath(NamedTuple):
    """Load path to a target.

    Attributes:
        via: Drives of the overshoot before the last load; None where there is none.
        last: Where the search ended.
        solves: How many loads were solved, those of the other paths included.
    """

    via: Float[np.ndarray, " t"] | None
    last: Attempt
    solves: int


def approach_target(
    problem: Problem,
    before: Float[np.ndarray, " state"],
    start: Float[np.ndarray, " t"],
    goal: Float[np.ndarray, " m"],
    approach: Approach = "direct",
    known: Response | None = None,
) -> ApproachPath:
    """Find drives that meet a target, and the way to them.

    Args:
        problem: Target quantities and limits.
        before: The state before, packed.
        start: Its drives.
        goal: The target; NaN where an entry is free.
        approach: "direct", with the last load rising ("loading") or falling ("unloading"), or
            by the path that needs the smallest drives ("least").
        known: Values and slopes of the state before, where they are known.
    """
    direct = find_anyhow(problem, before, start, goal, known)
    direct = smaller_tensions(problem, before, start, goal, direct)
    paths = [ApproachPath(None, direct, direct.solves)]
    if approach == "direct" or not direct.response.converged:
        return paths[0]
    change = _change(problem, start, direct.drive)
    if (approach == "loading" and change > 0.0) or (approach == "unloading" and change < 0.0):
        return paths[0]
    friction = problem.model.friction(direct.response.state)
    for over in (True, False):
        if (over and approach == "loading") or (not over and approach == "unloading"):
            continue
        via = _via(problem, direct.drive, friction, over, change > 0.0)
        between = problem.model.solve(before, via)
        if not between.converged or not _allowed(problem, between):
            continue
        last = find_anyhow(problem, between.state, via, goal, None)
        last = smaller_tensions(problem, between.state, via, goal, last)
        right_way = (_change(problem, via, last.drive) < 0.0) is over
        if right_way or last.failure is not None:
            paths.append(ApproachPath(via, last, last.solves + 1))
    solves = sum(path.solves for path in paths)
    candidates = paths if approach == "least" else paths[1:] or paths
    return min(candidates, key=_rank)._replace(solves=solves)


def _rank(path: ApproachPath) -> tuple[bool, bool, float, float]:
    failed = path.last.failure is not None
    broken = not _keeps_limits(path.last)
    return failed, broken, path.last.error if failed else 0.0, path.last.effort


def _change(problem: Problem, start: np.ndarray, end: np.ndarray) -> float:
    """Sum of the changes of the drives."""
    return float(np.sum((end - start)[problem.driven]))


def _via(
    problem: Problem, drive: np.ndarray, friction: np.ndarray, over: bool, rises: bool
) -> np.ndarray:
    """Drives above or below those of the target, from which all contacts turn round on the way."""
    if not problem.by_tension:
        friction = np.zeros_like(friction)
    # The same shape needs a tension that is about the friction of all contacts (as a logarithm)
    # smaller after unloading than after loading; to turn all contacts round takes twice that.
    other = friction if rises is over else 2.0 * friction
    factor = np.exp(other) * (1.0 + _OVERSHOOT) if over else np.exp(-other) * (1.0 - _OVERSHOOT)
    via = np.where(problem.driven, drive * factor, drive)
    return np.clip(via, problem.low, problem.high)


def find_anyhow(
    problem: Problem,
    before: Float[np.ndarray, " state"],
    start: Float[np.ndarray, " t"],
    goal: Float[np.ndarray, " m"],
    known: Response | None,
) -> Attempt:
    """Search from the present drives, and where that fails from others; return the best.

    The tip of a robot that bends far moves to and fro: from afar a search may end in a trough that
    is not the deepest.
    """
    attempts = _attempts(problem, before, start, goal, known)
    best = next(attempts)
    solves = best.solves
    while best.failure is not None and (other := next(attempts, None)):
        solves += other.solves
        best = min(best, other, key=_quality)
    if best.failure is Failure.SEARCH_STOPPED:
        best = _settled(problem, before, best, goal)
        solves += best.solves
    return best._replace(solves=solves)


def _attempts(
    problem: Problem,
    before: np.ndarray,
    start: np.ndarray,
    goal: np.ndarray,
    known: Response | None,
) -> Iterator[Attempt]:
    """Yield what one search after the other finds, the cheapest and most promising first."""
    search = partial(search_iteratively, patient=False)
    taut = problem.driven & (start > problem.low)
    own, few = problem._replace(driven=taut), 0 < taut.sum() < problem.driven.sum()
    # Where a tendon turns round, one that is slack may seem to serve instead.
    suffice = few and known is not None and taut_tendons_suffice(problem, taut, goal, known)
    moved = (own, problem) if suffice else (problem, own)
    for some in moved if few else (problem,):
        yield solve_directly(some, before, start, goal, known)
    # Where other tendons move, a tendon slides within its dead band too.
    alone = bool(np.count_nonzero(start[problem.driven]) < 2)
    if few:
        yield search(own, before, start, goal, known, over_bands=alone)
    for over_bands in (alone, not alone):
        yield search(problem, before, start, goal, known, over_bands=over_bands)
    starts = list(other_starts(problem, before, start))
    for other_start, _ in starts:
        yield solve_directly(problem, before, other_start, goal)
    for other_start, over_bands in starts:
        yield search(problem, before, other_start, goal, over_bands=over_bands)
    if taut.sum() > 1:
        for corner in corners(own, before, start, taut):
            yield search(own, before, corner, goal, over_bands=False)


def _settled(problem: Problem, before: np.ndarray, best: Attempt, goal: np.ndarray) -> Attempt:
    """Search on from where all searches ended, until that brings the target no nearer."""
    solves = 0
    for _ in range(_LAST_SEARCHES):
        other = search_iteratively(problem, before, best.drive, goal, over_bands=False)
        solves += other.solves
        nearer = other.error < (1.0 - _NO_NEARER) * best.error
        if nearer or other.failure is None:  # else it stays where it is: drives may be stuck
            best = min(best, other, key=_quality)
        if best.failure is Failure.SEARCH_STOPPED and not nearer and _keeps_limits(best):
            stopped = other.failure is Failure.SEARCH_STOPPED
            failure = Failure.TARGET_OUT_OF_REACH if stopped else other.failure
            best = best._replace(failure=failure)
        if best.failure is not Failure.SEARCH_STOPPED:
            break
    return best._replace(solves=solves)


def _quality(attempt: Attempt) -> tuple[bool, bool, float]:
    return attempt.failure is not None, not _keeps_limits(attempt), attempt.error


def _allowed(problem: Problem, response: Response) -> bool:
    """Whether a state keeps the limits."""
    room = limit_rows(problem, response.values, response.jacobian)[1]
    return largest_violation(room) <= KEPT


def _keeps_limits(attempt: Attempt) -> bool:
    return attempt.response.converged and attempt.excess <= KEPT
