"""The load path to a target: direct, or through an overshoot that reverses friction.

At one tension a robot is bent more after unloading than after loading. A target can often be met on
either branch: by loading up to it, or by overshooting it and unloading.
"""

from __future__ import annotations

from functools import partial
from typing import Literal, NamedTuple

import numpy as np
from jaxtyping import Float

from notchflex.control.program.response import Response
from notchflex.control.search.iterative_search import search_iteratively, solve_directly
from notchflex.control.search.problem import Attempt, Problem
from notchflex.control.search.search_point import largest_violation, limit_rows
from notchflex.control.search.smaller import smaller_tensions
from notchflex.control.search.starts import corners, other_starts, taut_tendons_suffice
from notchflex.errors import Failure

Approach = Literal["direct", "loading", "unloading", "least"]

# Overshoot beyond the drives that reverse all contacts, relative.
_OVERSHOOT = 0.05
# Relative tolerance of limits.
_KEPT = 1e-6
# If all searches fail, one restarts from the best result without drives smaller than this part of
# the largest.
_SMALL = 0.2
# A target is out of reach if one of this number of last searches reduces the error by less than
# this part.
_LAST_SEARCHES, _NO_NEARER = 3, 1e-6
# Number of parts in which the target moves from the present values.
_PARTS = 6


_search = partial(search_iteratively, patient=False)


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
    # Where other tendons move, a tendon slides within its dead band too.
    alone = bool(np.count_nonzero(start[problem.driven]) < 2)
    taut = problem.driven & (start > problem.low)
    own, few = problem._replace(driven=taut), 0 < taut.sum() < problem.driven.sum()
    # Where a tendon turns round, one that is slack may seem to serve instead.
    tried = few and known is not None and taut_tendons_suffice(problem, taut, goal, known)
    best = first = solve_directly(own if tried else problem, before, start, goal, known)
    solves = best.solves
    if best.failure is not None and tried:
        best = first = solve_directly(problem, before, start, goal, known)
        solves += best.solves
    if best.failure is not None and few:
        best = best if tried else solve_directly(own, before, start, goal, known)
        solves += 0 if tried else best.solves
        if best.failure is not None:
            best = _search(own, before, start, goal, known, over_bands=alone)
            solves += best.solves
    if best.failure is None:
        return best._replace(solves=solves)
    best = _search(problem, before, start, goal, known, over_bands=alone)
    solves += best.solves
    if best.failure is not None:
        other = _search(problem, before, start, goal, known, over_bands=not alone)
        solves += other.solves
        best = min(best, other, key=_quality)
    others = [(best.drive, True), *other_starts(problem, before, start)]
    if best.failure is not None:
        other = _meet_from(problem, before, [drive for drive, _ in others], goal, first, best.error)
        solves += other.solves
        best = other if other.failure is None else best
    for other_start, over_bands in others[1:]:
        if best.failure is None:
            return best._replace(solves=solves)
        other = _search(problem, before, other_start, goal, over_bands=over_bands)
        solves += other.solves
        best = min(best, other, key=_quality)
    if best.failure is not None:
        other = _by_parts(problem, before, start, goal)
        solves += other.solves
        best = min(best, other, key=_quality)
    if best.failure is not None and problem.driven.sum() > 1:
        few = np.where(best.drive < _SMALL * best.drive.max(), problem.low, best.drive)
        other = _search(problem, before, few, goal)
        solves += other.solves
        best = min(best, other, key=_quality)
    if best.failure is not None and taut.sum() > 1:
        other = _from_corners(own, before, start, goal, best)
        solves += other.solves
        best = min(best, other, key=_quality)
    if best.failure is Failure.SEARCH_STOPPED:
        best = _settled(problem, before, best, goal)
        solves += best.solves
    return best._replace(solves=solves)


def _meet_from(
    problem: Problem,
    before: np.ndarray,
    starts: list[np.ndarray],
    goal: np.ndarray,
    nearest: Attempt,
    error: float,
) -> Attempt:
    """Solve from several starting drives, or continue from the nearest if its error is smaller."""
    solves = 0
    for start in starts:
        other = solve_directly(problem, before, start, goal)
        solves += other.solves
        if other.failure is None:
            return other._replace(solves=solves)
        if (other.drive >= problem.low).all() and (other.drive <= problem.high).all():
            nearest = min(nearest, other, key=_quality)
    for go_on in (solve_directly, _find_within) if nearest.error < error else ():
        # It had come near when its rounds were over.
        nearest = go_on(problem, before, nearest.drive, goal)
        solves += nearest.solves
        if nearest.failure is None:
            break
    return nearest._replace(solves=solves)


def _from_corners(
    problem: Problem, before: np.ndarray, start: np.ndarray, goal: np.ndarray, best: Attempt
) -> Attempt:
    """Search from just beyond all dead bands, on every side of them; return the best."""
    solves = 0
    for corner in corners(problem, before, start, problem.driven):
        other = _search(problem, before, corner, goal, over_bands=False)
        solves += other.solves
        best = min(best, other, key=_quality)
        if best.failure is None:
            break
    return best._replace(solves=solves)


def _find_within(
    problem: Problem, before: np.ndarray, start: np.ndarray, goal: np.ndarray
) -> Attempt:
    """Search with dead bands, from drives that are near the target."""
    return search_iteratively(problem, before, start, goal, over_bands=False)


def _settled(problem: Problem, before: np.ndarray, best: Attempt, goal: np.ndarray) -> Attempt:
    """Search on from where all searches ended, until that brings the target no nearer."""
    solves = 0
    for _ in range(_LAST_SEARCHES):
        other = _find_within(problem, before, best.drive, goal)
        solves += other.solves
        nearer = other.error < (1.0 - _NO_NEARER) * best.error
        if nearer or other.failure is None:  # else it stays where it is: drives may be stuck
            best = min(best, other, key=_quality)
        if best.failure is Failure.SEARCH_STOPPED and not nearer and _keeps_limits(best):
            best = best._replace(failure=Failure.TARGET_OUT_OF_REACH)
        if best.failure is not Failure.SEARCH_STOPPED:
            break
    return best._replace(solves=solves)


def _quality(attempt: Attempt) -> tuple[bool, bool, float]:
    return attempt.failure is not None, not _keeps_limits(attempt), attempt.error


def _allowed(problem: Problem, response: Response) -> bool:
    """Whether a state keeps the limits."""
    room = limit_rows(problem, response.values, response.jacobian)[1]
    return largest_violation(room) <= _KEPT


def _keeps_limits(attempt: Attempt) -> bool:
    return attempt.response.converged and attempt.excess <= _KEPT


def _by_parts(problem: Problem, before: np.ndarray, start: np.ndarray, goal: np.ndarray) -> Attempt:
    """Move the target from the present values to where it is; the memory stays that of before."""
    response = problem.model.solve(before, np.clip(start, problem.low, problem.high))
    values, solves = response.values[problem.entries], 1
    loose = problem._replace(search=problem.search.loose)
    attempt = Attempt(start, response, np.inf, 0.0, 1, Failure.SEARCH_STOPPED)
    for part in range(1, _PARTS + 1):
        aim = problem if part == _PARTS else loose
        towards = values + part / _PARTS * (goal - values)
        attempt = _search(aim, before, attempt.drive, towards)
        solves += attempt.solves
    return attempt._replace(solves=solves)
