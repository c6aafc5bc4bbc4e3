"""The search for drives that meet one target, from one state: Levenberg-Marquardt with limits.

The tip follows the drives smoothly but for kinks: where a tendon turns round its contacts stick
first, and a notch closes. There derivatives hold for one side only. A step is therefore judged by
what it brings, and derivatives are taken at every point anew.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Bool, Float, Int
from scipy.optimize import nnls

from notchflex import Failure
from notchflex.control.program.drive_model import DriveAim, Response
from notchflex.control.program.drive_step import FIRST_PART, GROWTH, MIN_DRIVES
from notchflex.control.search.problem import Attempt, Problem, size_of

# Weight of limits that cannot all be met, relative to the target.
_VIOLATION = 1e6


def least_step(
    hessian: Float[np.ndarray, "t t"],
    gradient: Float[np.ndarray, " t"],
    low: Float[np.ndarray, " t"],
    high: Float[np.ndarray, " t"],
    limits: Float[np.ndarray, "c t"],
    room: Float[np.ndarray, " c"],
) -> Float[np.ndarray, " t"]:
    r"""Minimise $d^T H d / 2 + g^T d$ where $l \le d \le h$ and $C d \le b$.

    The problem is turned into one of least distance and that into non-negative least squares
    (Lawson and Hanson 1974, *Solving Least Squares Problems*, ch. 23): exact, and some ten
    microseconds for few drives.

    Args:
        hessian: H, positive definite.
        gradient: g.
        low: l.
        high: h.
        limits: C.
        room: b.

    Returns:
        The step. Where the limits contradict each other it is within l and h, and violates the
        others little.
    """
    one = len(gradient) == 1
    free = -gradient / hessian[0, 0] if one else np.linalg.solve(hessian, -gradient)
    inside = (free >= low).all() and (free <= high).all()
    if inside and (not room.size or (limits @ free <= room).all()):
        return free
    if one and not room.size:
        return np.minimum(np.maximum(free, low), high)
    eye = np.eye(len(gradient))
    every = np.concatenate([eye, -eye, limits])
    excess = np.concatenate([free - high, low - free, limits @ free - room])
    factor = np.linalg.cholesky(hessian)
    inward = -np.linalg.solve(factor, every.T)  # columns: limits in the metric of the Hessian
    size = np.sqrt((inward**2).sum(axis=0))
    size[size == 0.0] = 1.0
    least = _least_distance(inward / size, excess / size)
    if least is None:
        broken = every[excess > 0.0]
        weight = _VIOLATION * np.trace(hessian) / max(float(np.sum(broken**2)), 1e-300)
        stiffer = hessian + weight * broken.T @ broken
        pull = weight * broken.T @ (broken @ free - excess[excess > 0.0])
        step = np.linalg.solve(stiffer, pull - gradient)
    else:
        step = free + np.linalg.solve(factor.T, least)
    return np.minimum(np.maximum(step, low), high)


def _least_distance(
    inward: Float[np.ndarray, "t c"], excess: Float[np.ndarray, " c"]
) -> Float[np.ndarray, " t"] | None:
    """Return the shortest z with inward^T z >= excess; None where there is none."""
    scale = float(np.abs(excess).max())
    rows = np.vstack([inward, excess / scale])
    goal = np.zeros(len(rows))
    goal[-1] = 1.0
    try:
        multipliers = nnls(rows, goal)[0]
    except RuntimeError:  # the iteration does not end
        return None
    left = goal - rows @ multipliers
    if left[-1] < 1e-14:
        return None
    return -scale * left[:-1] / left[-1]


# Limits count as kept within this part of them; those smaller than the second number (N, mm, or a
# strain) within parts of it.
KEPT, _MIN_LIMIT = 1e-7, 1e-3
# What a violation of limits, as parts of them, counts beside the error.
_PENALTY = 1e4


@dataclass(frozen=True, eq=False)
class SearchPoint:
    """A point of a search; f driven tendons.

    Attributes:
        moved: What the drives have moved beyond the dead bands, (t,).
        drive: The drives, (t,).
        response: The state there.
        slopes: Slopes of all asked quantities by the driven tendons, (all, f).
        stuck: Which driven tendons stick.
        miss: Weighted differences from the target.
        error: Its size.
        limits: Slopes of limited quantities, as parts of the limits, (c, f).
        room: How far each is from its limit.
    """

    moved: Float[np.ndarray, " t"]
    drive: Float[np.ndarray, " t"]
    response: Response
    slopes: Float[np.ndarray, "all f"]
    stuck: Bool[np.ndarray, " f"]
    miss: Float[np.ndarray, " m"]
    error: float
    limits: Float[np.ndarray, "c f"]
    room: Float[np.ndarray, " c"]

    @property
    def excess(self) -> float:
        """Largest violation of a limit, as a part of it."""
        return largest_violation(self.room)

    @property
    def merit(self) -> float:
        """Merit function: the squared error, plus a penalty for violated limits."""
        if not self.response.converged:
            return np.inf
        return self.error**2 + penalty(self.room)


def limit_rows(
    problem: Problem, values: Float[np.ndarray, " all"], slopes: Float[np.ndarray, "all f"]
) -> tuple[Float[np.ndarray, "c f"], Float[np.ndarray, " c"]]:
    """Return slopes of limited quantities and their distances from the limits, as parts of them.

    Args:
        problem: The limits.
        values: Quantities of a state.
        slopes: Their slopes.
    """
    if not problem.bounds:
        return slopes[:0], slopes[:0, 0]
    rows, room = [], []
    for bound in problem.bounds:
        at = problem.model.slices[bound.quantity]
        given = np.isfinite(bound.limit)
        scale = np.maximum(np.abs(bound.limit[given]), _MIN_LIMIT)
        left = bound.side * (bound.limit - values[at])[given] / scale
        is_limited = np.isfinite(left)
        rows.append((bound.side * slopes[at][given] / scale[:, None])[is_limited])
        room.append(left[is_limited])
    return np.concatenate(rows), np.concatenate(room)


def largest_violation(room: Float[np.ndarray, " c"]) -> float:
    """Return by how much the most violated limit is broken, as a part of it; 0 if none is."""
    return max(0.0, -float(room.min())) if room.size else 0.0


def penalty(room: Float[np.ndarray, " c"]) -> float:
    """Return what broken limits count beside the squared error."""
    if not room.size:
        return 0.0
    broken = np.minimum(room, 0.0)
    return _PENALTY * float(broken @ broken)


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


# A column of the slopes that is this part of the target over the drives is that of a tendon that
# sticks.
_STALLED = 1e-8
# Drive changes, as parts of the drives, that make a tendon slide and show its slopes.
_DAMPED_SIDE_STEPS = (1e-6, -1e-6, 0.3, -0.3)
# Factor on the step length after a step without motion, and the factor by which the error may then
# increase.
_STRIDE, _ACROSS = 4.0, 30.0
# The error is minimal if its slope by the drives is below this part of the largest possible one.


class DampedSearch:
    """One search: its points one after the other.

    Within a dead band, between turning round and the first slip of a contact, a tendon moves
    nothing, if the others stay as they are. A search can leave these bands out: its variables are
    what the drives move beyond.

    Args:
        problem: Target quantities and limits.
        before: The state before, packed.
        entries: Entries of a response that have a target.
        weights: What an error of each counts.
        goal: What they are to become.
        over_bands: Whether dead bands are left out.
    """

    point: SearchPoint

    def __init__(
        self,
        problem: Problem,
        before: Float[np.ndarray, " state"],
        entries: Int[np.ndarray, " m"],
        weights: Float[np.ndarray, " m"],
        goal: Float[np.ndarray, " m"],
        over_bands: bool,
    ) -> None:
        """Take the target; nothing is solved."""
        self.problem, self.before, self.goal = problem, before, goal
        self.entries, self.weights = entries, weights
        self.free = np.flatnonzero(problem.driven)
        self.solves, self.settled, self._stride = 0, False, 1.0
        self._sliding: np.ndarray | None = None
        model, driven = problem.model, problem.driven
        self._present = np.where(driven, model.drives(before), problem.low)
        self._band = self._present, self._present
        if over_bands:
            low, high = model.dead_band(before)
            self._band = np.where(driven, low, self._present), np.where(driven, high, self._present)
        self._low, self._high = self._outside(problem.low), self._outside(problem.high)
        self._eye = np.eye(len(self.free))
        self._usual = 1.0 + size_of(weights * goal)

    def begin(self, start: Float[np.ndarray, " t"], known: Response | None) -> None:
        """Take the first point.

        Args:
            start: Its drives.
            known: Values and slopes there, if they are known.
        """
        moved = np.minimum(np.maximum(self._outside(start), self._low), self._high)
        self.scale = self._scale(moved)
        self.point = self._at(moved, known or self._solve(moved), None)

    @property
    def done(self) -> bool:
        """Whether the target is met within the limits."""
        point = self.point
        met = point.error <= self.problem.search.tolerance and point.response.converged
        return met and point.excess <= KEPT

    def step(self, damping: float) -> Float[np.ndarray, " t"]:
        """Return the next step of all drives.

        Args:
            damping: What the step is weighted with, as a part of the slopes.
        """
        point, free = self.point, self.free
        slopes = self.weights[:, None] * point.slopes[self.entries]
        normal = slopes.T @ slopes
        size = float(normal.trace()) / len(free)
        step = np.zeros(len(point.drive))
        if not size > 0.0:
            return step
        small = MIN_DRIVES * size
        hessian = normal + (damping * size + small) * self._eye
        gradient = slopes.T @ point.miss + small * point.drive[free]
        reach = GROWTH * self.scale
        low = np.maximum((self._low - point.moved)[free], -reach)
        high = np.minimum((self._high - point.moved)[free], reach)
        least = least_step(hessian, gradient, low, high, point.limits, point.room)
        step[free] = np.minimum(np.maximum(self._stride * least, low), high)
        return step

    def try_step(self, step: Float[np.ndarray, " t"], least: float) -> float:
        """Try a step and accept it if the merit decreases enough.

        Args:
            step: The step.
            least: Smallest accepted ratio of actual to predicted reduction of the merit.

        Returns:
            Ratio of actual to predicted reduction.
        """
        point, moved = self.point, self.point.moved + step
        response = self._solve(moved)
        if not response.converged:
            return -1.0
        trial = self._at(moved, response, point)
        promised = point.merit - self._predicted(step[self.free])
        gain = (point.merit - trial.merit) / promised if promised > 0.0 else -1.0
        on_its_way = bool(trial.stuck[step[self.free] != 0.0].any())
        on_its_way = on_its_way and trial.merit <= point.merit * (1.0 + 1e-9)
        if point.stuck.any() and not trial.stuck.any() and trial.error <= _ACROSS * point.error:
            # Beyond the band, and too far: from there slopes show the way back.
            self.point, self.scale, self._stride = trial, self._scale(moved), 1.0
            return max(gain, least)
        if gain >= least or on_its_way or trial.error <= self.problem.search.tolerance:
            self.point, self.scale = trial, self._scale(moved)
            # A notch that is pressed together moves as little as a tendon that sticks.
            self._stride = _STRIDE * self._stride if on_its_way else 1.0
            return max(gain, 1.0 if on_its_way else least)
        self._stride = 1.0
        # A kink lies between: what the step has shown turns the next one along it.
        self.point = replace(point, slopes=self._secant(moved, response, point))
        return gain

    def accept_step(self, step: Float[np.ndarray, " t"]) -> None:
        """Accept a step without a test of the merit."""
        moved = self.point.moved + step
        response = self._solve(moved)
        if response.converged:
            self.point = self._at(moved, response, self.point)

    def result(self) -> Attempt:
        """Return where the search is, and why it went no further."""
        point, failure = self.point, None
        if not self.done:
            aim = self.entries, self.weights, self.scale, self.settled
            failure = why_unmet(self.problem, point, *aim)
        return Attempt(point.drive, point.response, point.error, point.excess, self.solves, failure)

    def _outside(self, drive: np.ndarray) -> np.ndarray:
        """Drive changes beyond the dead bands."""
        low, high = self._band
        return np.maximum(drive - high, 0.0) + np.minimum(drive - low, 0.0)

    def _drive(self, moved: np.ndarray) -> np.ndarray:
        low, high = self._band
        drive = np.where(moved > 0.0, high, np.where(moved < 0.0, low, self._present)) + moved
        return np.minimum(np.maximum(drive, self.problem.low), self.problem.high)

    def _scale(self, moved: np.ndarray) -> float:
        """Size of the drives, that of the first step at least."""
        return max(float(np.abs(self._drive(moved)).max()), FIRST_PART * self.problem.unit)

    def _solve(self, moved: np.ndarray) -> Response:
        self.solves += 1
        return self.problem.model.solve(self.before, self._drive(moved))

    def _at(self, moved: np.ndarray, response: Response, last: SearchPoint | None) -> SearchPoint:
        """The point of a solved load."""
        slopes = response.jacobian[:, self.free]
        if not np.isfinite(slopes).all():
            # The aim: too hard a step, and the slopes are those before, corrected. Of limited
            # quantities some have none at a kink.
            if not np.isfinite(slopes[self.entries]).all():
                slopes = self._secant(moved, response, last)
            slopes = np.nan_to_num(slopes, nan=0.0)
        slopes, stuck = self._unstuck(slopes)
        miss = self.weights * (response.values[self.entries] - self.goal)
        limits, room = limit_rows(self.problem, response.values, slopes)
        drive = self._drive(moved)
        return SearchPoint(moved, drive, response, slopes, stuck, miss, size_of(miss), limits, room)

    def _secant(
        self, moved: np.ndarray, response: Response, last: SearchPoint | None
    ) -> np.ndarray:
        """The slopes of a point, corrected by what another one shows."""
        if last is None:
            return np.zeros((len(response.values), len(self.free)))
        step = (moved - last.moved)[self.free]
        square = float(step @ step)
        if square == 0.0:
            return last.slopes
        missing = response.values - last.response.values - last.slopes @ step
        return last.slopes + np.multiply.outer(missing, step) / square

    def _unstuck(self, slopes: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Slopes in which tendons that stick are taken to slide, and which those are.

        Such a slope is zero, which says nothing about the way on.
        """
        least = (_STALLED * self._usual / self.scale) ** 2
        stuck = (slopes[self.entries] ** 2).sum(axis=0) <= least
        if not stuck.any():
            return slopes, stuck
        if self._sliding is None:
            self._sliding = self._slopes_when_sliding(np.zeros_like(slopes), least)
        return np.where(stuck, self._sliding, slopes), stuck

    def _slopes_when_sliding(self, slopes: np.ndarray, least: float) -> np.ndarray:
        """Slopes near the present state of a tendon that slides, whichever way it does."""
        for part in _DAMPED_SIDE_STEPS:
            aside = part * self.scale * self.problem.driven
            response = self._solve(np.minimum(np.maximum(aside, self._low), self._high))
            if not (response.converged and np.isfinite(response.jacobian).all()):
                continue
            stuck = (slopes[self.entries] ** 2).sum(axis=0) <= least
            slopes = np.where(stuck, response.jacobian[:, self.free], slopes)
            if ((slopes[self.entries] ** 2).sum(axis=0) > least).all():
                break
        return slopes

    def _predicted(self, step: np.ndarray) -> float:
        """The merit that the slopes promise after a step."""
        point = self.point
        miss = point.miss + self.weights * (point.slopes[self.entries] @ step)
        return float(miss @ miss) + penalty(point.room - point.limits @ step)


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
    found = Attempt(start, known, error, 0.0, solves, Failure.SEARCH_STOPPED)
    if not known.converged or not np.isfinite(known.jacobian[entries]).all():
        return within_limits(problem, found)
    if error <= search.tolerance and not redundant:
        return within_limits(problem, found._replace(failure=None))
    aim = DriveAim(
        entries, target, weights, problem.low, problem.high, problem.driven,
        search.tolerance, problem.unit, min(_ROUNDS, search.solves),
    )  # fmt: skip
    response, drive, nearest, met, more = model.search(before, start, known, aim)
    found = found._replace(solves=solves + more)
    if met or (response.converged and nearest < error):
        failure = None if met else Failure.SEARCH_STOPPED
        found = Attempt(drive, response, nearest, 0.0, found.solves, failure)
    return within_limits(problem, found)


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
    response, drive = attempt.response, attempt.drive
    room = limit_rows(problem, response.values, response.jacobian)[1]
    beyond = (drive < problem.low).any() or (drive > problem.high).any()
    excess = np.inf if beyond else largest_violation(room)
    failure = Failure.SEARCH_STOPPED if excess > KEPT else attempt.failure
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
