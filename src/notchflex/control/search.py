"""The search for drives that meet one target, from one state.

The tip follows the drives smoothly but for kinks: where a tendon turns round its contacts stick
first, and a notch closes. Between turning round and the first slip a tendon moves nothing: there a
search takes the slopes with which it last slid, and leaps over the dead band.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Float

from notchflex import Failure
from notchflex.control.problem import (
    Attempt,
    Drives,
    Goal,
    PackedState,
    Problem,
    Response,
    Which,
)
from notchflex.search.least_squares import BoundedLeastSquares, SearchEnd, SearchPoint

# Smallest reach of a search, as a part of what about closes a notch.
_FIRST_PART = 0.05
# A tendon sticks where its slopes, squared, are this part of those with which it last slid; or,
# where these are not known, below this size (mm, N or rad per N or mm, squared).
_NO_SLOPE, _STUCK = 1e-12, 1e-18
# It slides just beyond its dead band, by this part of the drive.
_BEYOND = 1e-6
# Beyond the dead band a notch that is pressed together may hold on: the way so far tells how far it
# can be, until the tendon has slid once.
_ONWARD = 0.5
# Drives within this part of what about closes a notch of a limit, or of an edge, are at it.
_AT_LIMIT = 1e-10
# Beside others a tendon stays in its dead band if it must slide by less than this part of it.
_SMALL_LEAP = 1e-3
# A tendon that was slack is pulled above this part of what about closes a notch.
_PULLED = 1e-6
# Where the present drives lead nowhere, each tendon is pulled alone by this part of what about
# closes a notch: the two-axis wrist of `benchmarks/control.py accuracy` needs it.
_ALONE = 0.15
# Steps whose slopes promise less than this part of the squared error bring nothing.
_FLAT = 1e-6
# Notches hold on where the target changes by less than this (mm, N or rad, by weights) for a change
# of the tension by about the closing tension of a notch.
_HOLDS = 0.1
# Relative accuracy of the lower end of a range of tensions; an edge of a dead band is passed by the
# second part of it.
_EXACT, _PASSED = 5e-7, 1e-9


@dataclass(eq=False)
class DriveSearch:
    """A target that is searched from a state.

    Attributes:
        problem: Target quantities and limits.
        before: The state before.
        goal: The target; NaN where an entry is free.
    """

    problem: Problem
    before: PackedState
    goal: Goal

    def __post_init__(self) -> None:
        """Weigh the numbers that have a goal."""
        problem, has_goal = self.problem, self.goal == self.goal
        self._present = problem.present(self.before)
        self._goal = np.where(has_goal, self.goal, 0.0)
        self._weights = problem.weights * has_goal
        self._squares = np.square(self._weights)

    @property
    def least_squares(self) -> BoundedLeastSquares:
        """The problem for drives."""
        problem = self.problem  # kept in the search it would be a cycle of references
        return BoundedLeastSquares(
            self.move,
            problem.low,
            problem.high,
            problem.search.tolerance,
            reach=_FIRST_PART * problem.unit,
            small=bool(np.count_nonzero(problem.driven) > np.count_nonzero(self._weights)),
        )

    def present(self) -> tuple[Response, int]:
        """Solve the present drives, and others beyond dead bands for slopes; count the solves."""
        problem, present = self.problem, self._present
        response, solves = self.solve(present), 1
        if response is None:
            step = problem.stepper.step(self.before, present)
            return Response(step, problem.slopes(step), problem.driven, 0.0 * present), solves
        low, high = problem.stepper.dead_band(self.before).T
        for edges in ((1.0 + _BEYOND) * high, (1.0 - _BEYOND) * low):
            stuck = response.stuck
            if not stuck.any():
                break
            beyond, solves = self.solve(np.where(stuck, edges, present)), solves + 1
            if beyond is not None:
                slopes = np.where(stuck, beyond.slopes, response.slopes)
                response = response._replace(slopes=slopes, stuck=stuck & beyond.stuck)
        return response, solves

    def solve(self, drives: Drives, like: Response | None = None) -> Response | None:
        """Solve some drives; slopes of tendons that stick are those of another solution."""
        step = self.problem.stepper.step(self.before, drives)
        if not step.converged:
            return None
        slopes = self.problem.slopes(step)
        steep = self._steepness(slopes)
        if like is None:
            stuck = self.problem.driven & (steep <= _STUCK * self._squares.sum())
            return Response(step, np.nan_to_num(slopes), stuck, 0.0 * drives)
        slid = drives - self._present
        # After a step in parts slopes are not known: those of the other one are corrected.
        stuck = ~(steep > _NO_SLOPE * self._steepness(like.slopes))
        if stuck.any():
            slopes = np.where(stuck, like.slopes, slopes)
            stuck &= np.isfinite(steep)
            slid = np.where(stuck, like.slid, slid)
        return Response(step, slopes, stuck, slid)

    def _steepness(self, slopes: Float[np.ndarray, "m t"]) -> Drives:
        """Squares of the slopes of the target by every drive."""
        return self._squares @ np.square(slopes[: len(self._goal)])

    def point(self, response: Response, accepted: float = 0.0) -> SearchPoint:
        """Return a solution as a point of the search."""
        problem, step, count = self.problem, response.step, len(self._goal)
        residuals = self._weights * (step.flat_values[problem.entries] - self._goal)
        slopes = response.slopes * problem.driven
        limits, room = problem.limited.factors[:, None] * slopes[count:], problem.room(step)
        slopes = self._weights[:, None] * slopes[:count]
        return SearchPoint(step.drives, residuals, slopes, limits, room, response, accepted)

    def move(self, point: SearchPoint, step: Drives) -> SearchPoint | None:
        """Return the point after a step, over the dead bands of tendons that stick."""
        problem, response, drives = self.problem, point.solution, point.variables
        ahead, leapt = drives + step, False
        if response.stuck.any():
            leapt = self._leap(response, step, ahead)
        near = ahead <= problem.low + _AT_LIMIT * problem.unit
        ahead = np.where(near, problem.low, np.minimum(ahead, problem.high))
        if (ahead == drives).all():
            return point
        solved = self.solve(ahead, response)
        if solved is None:
            return None
        # Notches that are pressed together hold on, with or without a dead band on the way.
        holds = solved.stuck.any() and (response.stuck & solved.stuck & (ahead != drives)).any()
        # Beyond all that holds, slopes show the way back from however far.
        accepted = (1.0 + 1e-9) * point.error if holds else math.inf if leapt else 0.0
        return self.point(solved, accepted)

    def _leap(self, response: Response, step: Drives, ahead: Drives) -> bool:
        """Move drives of tendons that stick on to the end of the dead band; return if any does."""
        problem, drives = self.problem, response.step.drives
        sticks, again = response.stuck, response.slid * step > 0.0
        if response.step.state is self.before:
            sticks = sticks & ~again  # a tendon that goes on as it slid meets no dead band
        turning = np.flatnonzero(sticks).tolist()
        band = response.step.dead_band.tolist() if turning else []
        several, leapt = np.count_nonzero(problem.driven) > 1, False
        for tendon in turning:
            change = float(step[tendon])
            leap = band[tendon][change > 0.0] - float(drives[tendon])
            if abs(leap) <= _AT_LIMIT * problem.unit and not again[tendon]:
                leap = math.copysign(_ONWARD * (drives - self._present)[tendon], change)
            if several and abs(change) <= _SMALL_LEAP * abs(leap):
                ahead[tendon] = drives[tendon]
            elif change != 0.0 and leap != 0.0:
                ahead[tendon] += leap
                leapt = True
        return leapt

    def attempt(self, end: SearchEnd, solves: int) -> Attempt:
        """Return the end of a search, with why the target is not met."""
        point, failure = end.point, None
        if not end.met:
            failure = self._failure(point) if end.settled else Failure.SEARCH_STOPPED
        return Attempt(point.solution, point.error, point.excess, solves, failure)

    def _failure(self, point: SearchPoint) -> Failure:
        """Why no step brings the target nearer: limits of the user, or none."""
        low, high = self.problem.widest
        unlimited = replace(point, limits=point.limits[:0], room=point.room[:0])
        without = replace(self.least_squares, low=low, high=high)
        least = (1.0 - _FLAT) * unlimited.merit
        stops = unlimited.promised(self.least_squares.step(point)) >= least
        goes_on = unlimited.promised(without.step(unlimited)) < least
        return Failure.LIMITS_PREVENT if stops and goes_on else Failure.TARGET_OUT_OF_REACH

    def lowered(self, response: Response, tendon: int) -> tuple[Response, int]:
        """Lower the tension of a tendon as far as the target stays met; count the solves."""
        problem, solves = self.problem, 0
        steep = self._weights * response.step.flat_jacobian[problem.entries, tendon]
        slides = not response.stuck[tendon] and float(steep @ steep) > (_HOLDS / problem.unit) ** 2
        if slides:
            return response, solves
        below, top = float(problem.low[tendon]), float(response.step.drives[tendon])
        edge = (1.0 - _PASSED) * float(response.step.dead_band[tendon, 0])
        guess = max(below, edge)
        while top - below > _EXACT * top:
            drives = response.step.drives.copy()
            drives[tendon] = guess
            lower, solves = self.solve(drives, response), solves + 1
            if lower is not None and self.least_squares.is_met(self.point(lower)):
                response, top = lower, guess
                guess = (1.0 - _EXACT) * top if guess == edge else 0.5 * (below + top)
            else:
                below, guess = guess, 0.5 * (guess + top)
        return response, solves


def find(
    problem: Problem,
    before: PackedState,
    goal: Goal,
    known: Response | None = None,
    budget: int | None = None,
    elsewhere: bool = True,
) -> Attempt:
    """Search drives that meet a target, within the rate or towards what meets it beyond.

    Friction and notches that are pressed together hold a tip for longer than a step of the rate,
    and what is nearest within it may lead away (`benchmarks/control.py rate`).

    Args:
        problem: Target quantities and limits.
        before: The state before.
        goal: The target; NaN where an entry is free.
        known: Values and slopes of the state before, where they are known.
        budget: Largest number of solves; where None the number of the problem from every start.
        elsewhere: Whether other drives than the present ones are tried where these fail.
    """
    attempt = _find(problem, before, goal, known, budget, elsewhere)
    left = None if budget is None else budget - attempt.solves - 1
    limited = attempt.failure is not None and np.isfinite(problem.rate)
    if not limited or (left is not None and left <= 0):
        return attempt
    low, high = problem.allowed  # as far as the drives may be at all
    ahead = _find(problem._replace(low=low, high=high), before, goal, known, left, True)
    search, response = DriveSearch(problem, before, goal), None
    if ahead.failure is None:
        nearest = np.clip(ahead.drives, problem.low, problem.high)
        response = search.solve(nearest, ahead.response)
    attempt = attempt._replace(solves=attempt.solves + ahead.solves + 1)
    if response is None:
        return attempt
    point = search.point(response)
    return Attempt(response, point.error, point.excess, attempt.solves, Failure.LIMITS_PREVENT)


def _find(
    problem: Problem,
    before: PackedState,
    goal: Goal,
    known: Response | None,
    budget: int | None,
    elsewhere: bool,
) -> Attempt:
    """Search from the present drives, and where that fails from others."""
    solves, best = 0, None
    if known is None:
        known, solves = DriveSearch(problem, before, goal).present()
    if not known.step.converged:
        return Attempt(known, np.nan, np.inf, solves, Failure.NO_EQUILIBRIUM)
    present = known.step.drives
    slack = problem.driven & (present <= problem.low)
    start = known._replace(slid=np.where(known.stuck, 0.0, known.slid))
    for drives, moved in _starts(problem, present, slack, elsewhere):
        left = problem.search.solves if budget is None else budget - solves
        if best is not None and left <= 0:
            break
        low, high = (np.where(moved, end, drives) for end in (problem.low, problem.high))
        part = problem._replace(driven=moved, low=low, high=high)
        search, first = DriveSearch(part, before, goal), start._replace(stuck=moved)
        if drives is not present:
            first, solves = search.solve(drives, first), solves + 1
        if first is None:
            continue
        end = search.least_squares.search(search.point(first), left)
        solves += end.solves
        attempt = search.attempt(end, solves)
        best = attempt if best is None or attempt.rank < best.rank else best
        # Where a slack tendon was pulled the others may suffice.
        pulled = slack.any() and (best.drives - problem.low)[slack].max() > _PULLED * problem.unit
        if best.failure is None and not (pulled and moved is problem.driven):
            break
    assert best is not None
    return best._replace(solves=solves)


def _starts(
    problem: Problem,
    present: Drives,
    slack: Which,
    elsewhere: bool,
) -> Iterator[tuple[Drives, Which]]:
    """Yield drives to start from, and which tendons move."""
    yield present, problem.driven
    taut = problem.driven & ~slack
    if slack.any() and taut.any():
        yield present, taut
    if not elsewhere:
        return
    rest = np.where(problem.driven, 0.0, present)
    for pull in _ALONE * problem.unit * np.eye(len(present))[problem.driven]:
        yield np.clip(rest + pull, problem.low, problem.high), problem.driven


def smallest_tensions(
    problem: Problem, before: PackedState, goal: Goal, attempt: Attempt
) -> Attempt:
    """Return the smallest tensions that meet a target as those that were found do.

    Friction lets a range of tensions hold one shape: between turning round and the first slip of a
    contact nothing moves, nor do notches that are pressed together. The search stops at any.
    """
    if attempt.failure is not None or not problem.by_tension:
        return attempt
    search, response, solves = DriveSearch(problem, before, goal), attempt.response, attempt.solves
    for tendon in np.flatnonzero(problem.driven & (attempt.drives > problem.low)):
        response, more = search.lowered(response, int(tendon))
        solves += more
    point = search.point(response)
    return Attempt(response, point.error, point.excess, solves, None)
