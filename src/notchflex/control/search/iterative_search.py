"""The search for drives that meet one target, from one state: Levenberg-Marquardt with limits.

The tip follows the drives smoothly but for kinks: where a tendon turns round its contacts stick
first, and a notch closes. There derivatives hold for one side only. A step is therefore judged by
what it brings, and derivatives are taken at every point anew.
"""

from __future__ import annotations

import numpy as np
from jaxtyping import Float

from notchflex.control.program.response import DriveAim, Response
from notchflex.control.search.damped_search import DampedSearch
from notchflex.control.search.problem import Attempt, Problem, size_of
from notchflex.control.search.search_point import KEPT, largest_violation, limit_rows
from notchflex.errors import Failure

# Damping after a failed step, its factor after further ones, the gain ratio above which it
# decreases, and its maximum.
_FIRST, _FACTOR, _GOOD_GAIN, _MAX_DAMPING = 1e-3, 8.0, 0.5, 1e12
# Smallest accepted ratio of actual to predicted reduction.
_MIN_GAIN = 1e-3
# Tendons with slopes (mm, N or rad per N or mm) below this stick. They slide at drives that
# differ by these parts.
_STUCK = 1e-9
_SIDE_STEPS = (1e-6, -1e-6)
# Largest number of loads that the program solves for a target.
_ROUNDS = 6
# Smallest relative change of drives by a step.
_NO_STEP = 1e-11
# A search ends if this number of solves leaves more than this part of the squared error.
_IMPATIENT, _PATIENT = (8, 0.98), (16, 1.0 - 1e-8)
# Redundant drives are reduced in at most this number of rounds, each with at most this number of
# corrections, while a round changes them and their size by more than these parts.
_MAX_RELAXATIONS, _CORRECTIONS, _SMALL_RELAXATION, _SMALL_GAIN = 6, 5, 1e-3, 1e-4


def search_iteratively(
    problem: Problem,
    before: Float[np.ndarray, " state"],
    start: Float[np.ndarray, " t"],
    goal: Float[np.ndarray, " m"],
    known: Response | None = None,
    *,
    over_bands: bool = True,
    patient: bool = True,
) -> Attempt:
    """Search drives that meet a target.

    Args:
        problem: Target quantities and limits.
        before: The state before, packed.
        start: Drives to start from.
        goal: The target; NaN where an entry is free.
        known: Values and slopes at `start`, where they are known.
        over_bands: Whether dead bands of the drives are left out.
        patient: Whether it continues with little progress, until the budget is spent.

    Returns:
        The best that was found within the budget.
    """
    rows = np.flatnonzero(~np.isnan(goal))
    aim = problem.entries[rows], problem.weights[rows], goal[rows]
    search = DampedSearch(problem, before, *aim, over_bands)
    search.begin(start, known)
    damping, budget = 0.0, problem.search.solves
    checked, merit = search.solves, search.point.merit
    every, slow = _PATIENT if patient else _IMPATIENT
    while not search.done and search.solves < budget:
        if search.solves >= checked + every:
            if search.point.merit > slow * merit:
                search.settled = patient
                break
            checked, merit = search.solves, search.point.merit
        step = search.step(damping)
        if np.abs(step).max() <= _NO_STEP * search.scale or damping > _MAX_DAMPING:
            search.settled = True
            break
        gain = search.try_step(step, _MIN_GAIN)
        if gain >= _GOOD_GAIN:
            damping = 0.0 if damping <= _FIRST else damping / _FACTOR
        elif gain < _MIN_GAIN:
            damping = max(_FIRST, damping * _FACTOR)
    if search.done and len(search.free) > len(rows):
        _relax(search, budget)
    return search.result()


def solve_directly(
    problem: Problem,
    before: Float[np.ndarray, " state"],
    start: Float[np.ndarray, " t"],
    goal: Float[np.ndarray, " m"],
    known: Response | None = None,
) -> Attempt:
    """Search drives from the present ones by one compiled program; this suffices in most cases.

    Returns:
        What was found, or the present drives where that is no nearer; where the target is not met
        within the limits, `failure` says that the search stopped.
    """
    model, search = problem.model, problem.search
    rows = np.flatnonzero(goal == goal)
    entries, weights, target = problem.entries[rows], problem.weights[rows], goal[rows]
    solves = 0
    if known is None:
        known, solves = _present(problem, before, start)
    error = size_of(weights * (known.values[entries] - target))
    redundant = len(start) > len(rows) and int(problem.driven.sum()) > len(rows)
    if not known.converged or not np.isfinite(known.jacobian[entries]).all():
        return Attempt(start, known, error, 0.0, solves, Failure.SEARCH_STOPPED)
    if error <= search.tolerance and not redundant:
        return within_limits(problem, Attempt(start, known, error, 0.0, solves, None))
    aim = DriveAim(
        entries, target, weights, problem.low, problem.high, problem.driven,
        search.tolerance, problem.unit, min(_ROUNDS, search.solves),
    )  # fmt: skip
    response, drive, nearest, met, more = model.search(before, start, known, aim)
    solves += more
    if not met and not (response.converged and nearest < error):
        return Attempt(start, known, error, 0.0, solves, Failure.SEARCH_STOPPED)
    failure = None if met else Failure.SEARCH_STOPPED
    return within_limits(problem, Attempt(drive, response, nearest, 0.0, solves, failure))


def _present(problem: Problem, before: np.ndarray, start: np.ndarray) -> tuple[Response, int]:
    """Solve the present drives, and drives beside them for slopes of tendons that stick."""
    model, driven = problem.model, problem.driven
    known, solves = model.solve(before, start), 1
    sliding = known.sliding
    for part in _SIDE_STEPS:
        stuck = driven & (np.abs(sliding[problem.entries]).max(axis=0) <= _STUCK)
        if not stuck.any():
            break
        aside = model.solve(before, np.where(driven, (1.0 + part) * start, start))
        solves += 1
        if aside.converged and np.isfinite(aside.jacobian).all():
            sliding = np.where(stuck, aside.jacobian, sliding)
    return known._replace(sliding=sliding), solves


def within_limits(problem: Problem, attempt: Attempt) -> Attempt:
    """Return an attempt, which has failed where a limit is broken.

    Args:
        problem: The limits.
        attempt: What was found.
    """
    response = attempt.response
    room = limit_rows(problem, response.values, response.jacobian)[1]
    excess = largest_violation(room)
    broken = excess > KEPT or not (attempt.drive >= problem.low).all()
    broken = broken or not (attempt.drive <= problem.high).all()
    failure = Failure.SEARCH_STOPPED if broken else attempt.failure
    return attempt._replace(excess=excess, failure=failure)


def _relax(search: DampedSearch, budget: int) -> None:
    """Go on to the smallest drives that meet the target."""
    for _ in range(_MAX_RELAXATIONS):
        step = search.step(0.0)
        if search.solves >= budget or np.abs(step).max() <= _SMALL_RELAXATION * search.scale:
            return
        kept, effort = search.point, size_of(search.point.drive)
        search.accept_step(step)
        for _ in range(_CORRECTIONS):
            if search.done or search.solves >= budget:
                break
            search.try_step(search.step(0.0), _MIN_GAIN)
        if not search.done or size_of(search.point.drive) > (1.0 - _SMALL_GAIN) * effort:
            search.point = kept
            return
