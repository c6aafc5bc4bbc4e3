"""The search for drives that meet one target, from one state: Levenberg-Marquardt with limits.

The tip follows the drives smoothly but for kinks: where a tendon turns round its contacts stick
first, and a notch closes. There derivatives hold for one side only. A step is therefore judged by
what it brings, and derivatives are taken at every point anew.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
from jaxtyping import Float

from notchflex.control.drive_model import DriveModel, Response
from notchflex.control.limits import Bound
from notchflex.control.quadratic import least_step
from notchflex.errors import Failure, InputError


@dataclass(frozen=True, kw_only=True)
class TargetSearch:
    """Tolerance and budget of a search for a target.

    Attributes:
        tolerance: Weighted error (mm, N, rad) at which a target counts as met.
        solves: Largest number of solves for one target.

    Raises:
        InputError: A number that is not positive.
    """

    tolerance: float = 1e-7
    solves: int = 80

    @property
    def loose(self) -> TargetSearch:
        """For a target on the way to another."""
        return TargetSearch(tolerance=max(self.tolerance, 1e-3), solves=self.solves)

    def __post_init__(self) -> None:
        """Check the numbers."""
        if not self.tolerance > 0.0 or not self.solves >= 1:
            raise InputError.OUT_OF_RANGE(
                "a search needs a positive tolerance and at least one solve; "
                f"got {self.tolerance!r} and {self.solves!r}"
            )


class Problem(NamedTuple):
    """What a search is for: one target, and what may not be exceeded.

    Attributes:
        model: The robot.
        entries: Which numbers of a response are aimed at.
        weights: What an error of one unit counts.
        driven: Which tendons are driven; the others keep what the load commands.
        low: Lowest drive of every tendon, N or mm.
        high: Highest drive.
        chosen: Whether each drive has a highest value, or one above which nothing is sought.
        bounds: Limits on other quantities.
        unit: Drive that about closes a notch, N or mm.
        by_tension: Whether drives are tensions; otherwise they are strokes.
        search: Tolerance and budget.
    """

    model: DriveModel
    entries: np.ndarray
    weights: np.ndarray
    driven: np.ndarray
    low: np.ndarray
    high: np.ndarray
    chosen: np.ndarray
    bounds: tuple[Bound, ...]
    unit: float
    by_tension: bool
    search: TargetSearch


class Attempt(NamedTuple):
    """Where a search ended.

    Attributes:
        drive: Drives of all tendons, N or mm.
        response: The solved state there.
        error: Weighted distance from the target.
        excess: Largest violation of a limit, as a part of it; 0 where all are kept.
        solves: How many loads were solved.
        failure: Why the target is not met; None where it is.
    """

    drive: Float[np.ndarray, " t"]
    response: Response
    error: float
    excess: float
    solves: int
    failure: Failure | None

    @property
    def effort(self) -> float:
        """Size of the drives."""
        return float(np.linalg.norm(self.drive))


# Damping: where a step fails, its factor after one that did, and the part of the promised
# improvement that a step must bring.
_FIRST, _FACTOR, _LEAST_GAIN = 1e-3, 8.0, 1e-3
# Where drives are redundant the smallest meet the target. This weight decides among those that
# meet it equally well, and is too small to act against the target.
_LEAST_DRIVES = 1e-10
# A step may change a drive by so many times the largest one, or the first by a part of what closes
# a notch.
_GROWTH, _FIRST_PART = 1.0, 0.05
# A step that changes drives by less than this part of them is none.
_NO_STEP = 1e-11
# Limits count as kept within this part of them.
_KEPT = 1e-7
# Drives that are redundant are made smaller in so many rounds of so many corrections, while a round
# changes them and their size by more than these parts.
_MOST_RELAXATIONS, _CORRECTIONS, _SMALL_RELAXATION, _SMALL_GAIN = 6, 5, 1e-3, 1e-4
# Damping above which no step is worth trying.
_MOST_DAMPING = 1e12
# A column of the slopes that is this part of the largest, or of the target over the drives, is
# that of a tendon that sticks.
_STUCK = 1e-8
# Changes by these parts of the drives tell what a tendon does that slides.
_ASIDE = (1e-6, -1e-6, 0.3, -0.3)
# An error whose slope by the drives is this part of what it could be is as small as it gets.
_FLAT = 1e-6


def find(
    problem: Problem,
    before: Float[np.ndarray, " state"],
    start: Float[np.ndarray, " t"],
    goal: Float[np.ndarray, " m"],
    known: Response | None = None,
) -> Attempt:
    """Search drives that meet a target.

    Args:
        problem: What is aimed at, and the limits.
        before: The state before, packed.
        start: Drives to start from.
        goal: The target; NaN where an entry is free.
        known: Values and slopes at `start`, where they are known.

    Returns:
        The best that was found within the budget.
    """
    rows = ~np.isnan(goal)
    walk = _Walk(problem, before, rows, goal[rows])
    walk.begin(np.clip(start, problem.low, problem.high), known)
    damping = 0.0
    while walk.solves < problem.search.solves and not walk.done:
        step = walk.step(damping)
        if np.abs(step).max(initial=0.0) <= _NO_STEP * walk.scale or damping > _MOST_DAMPING:
            walk.settled = True
            break
        gain = walk.go(step)
        if gain >= 0.5:
            damping = 0.0 if damping <= _FIRST else damping / _FACTOR
        elif gain < _LEAST_GAIN:
            damping = max(_FIRST, damping * _FACTOR)
    if walk.done and len(walk.driven) > np.count_nonzero(rows):
        _relax(walk)
    return walk.result()


def _relax(walk: _Walk) -> None:
    """Go on to the smallest drives that meet the target."""
    for _ in range(_MOST_RELAXATIONS):
        step = walk.step(0.0)
        if np.abs(step).max() <= _SMALL_RELAXATION * walk.scale:
            return
        kept, effort = walk.point(), float(np.linalg.norm(walk.drive))
        walk.jump(step)
        for _ in range(_CORRECTIONS):
            if walk.done or walk.solves >= walk.problem.search.solves:
                break
            walk.go(walk.step(0.0))
        if not walk.done or float(np.linalg.norm(walk.drive)) > (1.0 - _SMALL_GAIN) * effort:
            walk.restore(kept)
            return


# What `_Walk` knows of the point at which it is.
_OF_POINT = (
    *("drive", "response", "slopes", "stuck", "miss", "error", "limits", "room", "excess"),
    "has_point",
)


class _Walk:
    """The points of one search."""

    def __init__(self, problem: Problem, before: np.ndarray, rows: np.ndarray, goal: np.ndarray):
        self.problem, self.before, self.goal, self.solves = problem, before, goal, 0
        self.index, self.weights = problem.entries[rows], problem.weights[rows]
        self.driven = np.flatnonzero(problem.driven)
        self.first_step = _FIRST_PART * problem.unit
        self.has_point = self.settled = False
        self._sliding: np.ndarray | None = None

    def begin(self, start: np.ndarray, known: Response | None) -> None:
        """Take the first point."""
        self.drive = start
        self.start = start
        if known is None:
            known = self._solve(start)
        self._take(start, known)

    def _solve(self, drive: np.ndarray) -> Response:
        self.solves += 1
        return self.problem.model.solve(self.before, drive)

    def _take(self, drive: np.ndarray, response: Response) -> None:
        jacobian = response.jacobian
        if not np.isfinite(jacobian[self.index]).all():  # too hard a step: those before, corrected
            jacobian = self._secant(drive, response)
        jacobian = np.nan_to_num(jacobian, nan=0.0)  # of limited quantities at a kink
        self.drive, self.response = drive, response
        self.slopes, self.stuck = self._unstuck(jacobian)
        self.miss = self.weights * (response.values[self.index] - self.goal)
        self.error = float(np.linalg.norm(self.miss))
        self.limits, self.room = self._limits()
        self.excess = float(-np.min(self.room, initial=0.0))
        self.has_point = response.converged

    def _secant(self, drive: np.ndarray, response: Response) -> np.ndarray:
        if not self.has_point:
            return np.zeros_like(response.jacobian)
        moved = drive - self.drive
        square = float(moved @ moved)
        if square == 0.0:
            return self.slopes
        missing = response.values - self.response.values - self.slopes @ moved
        return self.slopes + np.multiply.outer(missing, moved) / square

    def _unstuck(self, jacobian: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Slopes in which tendons that stick are taken to slide, and which those are.

        A tendon that turns round moves nothing until its first contact slides. Its slope is zero
        there, which says nothing about the way on.
        """
        size = np.linalg.norm(jacobian, axis=0)
        usual = (1.0 + float(np.linalg.norm(self.goal))) / self.scale
        stuck = self.problem.driven & (size <= _STUCK * max(usual, size.max(initial=0.0)))
        if not stuck.any():
            return jacobian, stuck
        if self._sliding is None:
            self._sliding = self._slopes_when_sliding(usual)
        return np.where(stuck, self._sliding, jacobian), stuck

    def _slopes_when_sliding(self, usual: float) -> np.ndarray:
        """Slopes at the start of a tendon that slides, whichever way it does."""
        slopes = np.zeros_like(self.response.jacobian)
        for part in _ASIDE:
            aside = self.start + part * self.scale_at(self.start) * self.problem.driven
            found = self._solve(np.clip(aside, self.problem.low, self.problem.high))
            if not (found.converged and np.isfinite(found.jacobian).all()):
                continue
            stuck = np.linalg.norm(slopes, axis=0) <= _STUCK * usual
            slopes = np.where(stuck, found.jacobian, slopes)
            stuck = np.linalg.norm(slopes, axis=0) <= _STUCK * usual
            if not (stuck & self.problem.driven).any():
                break
        return slopes

    def _limits(self) -> tuple[np.ndarray, np.ndarray]:
        """Slopes of limited quantities, and how far each is from its limit, scaled."""
        rows, room = [], []
        for bound in self.problem.bounds:
            at = self.problem.model.slices[bound.quantity]
            given = np.isfinite(bound.limit)
            scale = np.maximum(np.abs(bound.limit[given]), 1e-3)
            left = bound.side * (bound.limit - self.response.values[at])[given] / scale
            seen = np.isfinite(left)
            rows.append((bound.side * self.slopes[at][given] / scale[:, None])[seen])
            room.append(left[seen])
        if not rows:
            return np.zeros((0, len(self.drive))), np.zeros(0)
        return np.concatenate(rows), np.concatenate(room)

    @property
    def scale(self) -> float:
        """Size of the drives, that of the first step at least."""
        return self.scale_at(self.drive)

    def scale_at(self, drive: np.ndarray) -> float:
        """The same of other drives."""
        return max(float(np.abs(drive).max(initial=0.0)), self.first_step)

    @property
    def done(self) -> bool:
        """Whether the target is met within the limits."""
        good = self.response.converged and self.excess <= _KEPT
        return good and self.error <= self.problem.search.tolerance

    def step(self, damping: float) -> np.ndarray:
        """Return the next step of all drives."""
        free, drive, problem = self.driven, self.drive, self.problem
        slopes = self.weights[:, None] * self.slopes[np.ix_(self.index, free)]
        normal = slopes.T @ slopes
        size = float(np.trace(normal)) / max(len(free), 1)
        step = np.zeros_like(drive)
        if not size > 0.0:
            return step
        small = _LEAST_DRIVES * size
        hessian = normal + (damping * size + small) * np.eye(len(free))
        gradient = slopes.T @ self.miss + small * drive[free]
        reach = _GROWTH * self.scale
        low = np.maximum(problem.low[free] - drive[free], -reach)
        high = np.minimum(problem.high[free] - drive[free], reach)
        eye = np.eye(len(free))
        limits = np.concatenate([eye, -eye, self.limits[:, free]])
        room = np.concatenate([high, -low, self.room])
        step[free] = np.clip(least_step(hessian, gradient, limits, room), low, high)
        return step

    def go(self, step: np.ndarray) -> float:
        """Try a step and keep it if it helps; return what it brought of what was promised."""
        drive = self.drive + step
        response = self._solve(drive)
        if not response.converged or not np.isfinite(response.values[self.index]).all():
            return -1.0
        old = self.point()
        merit, promised = self.merit, self.merit - self._predicted(step)
        self._take(drive, response)
        gain = (merit - self.merit) / promised if promised > 0.0 else -1.0
        on_its_way = bool(self.stuck[step != 0.0].any()) and self.merit <= merit * (1.0 + 1e-9)
        if self.done or gain >= _LEAST_GAIN or on_its_way:
            return max(gain, 0.5 if on_its_way else _LEAST_GAIN)
        self.restore(old)
        return gain

    def jump(self, step: np.ndarray) -> None:
        """Take a step, whatever it brings."""
        drive = self.drive + step
        response = self._solve(drive)
        if response.converged:
            self._take(drive, response)

    def point(self) -> dict[str, Any]:
        """Return what is known of the present point."""
        return {name: getattr(self, name) for name in _OF_POINT}

    def restore(self, point: dict[str, Any]) -> None:
        """Go back to a point."""
        vars(self).update(point)

    @property
    def merit(self) -> float:
        """What a step must lessen: the squared error, and that of broken limits."""
        if not self.response.converged:
            return np.inf
        return self.error**2 + self._penalty * float(np.sum(np.minimum(self.room, 0.0) ** 2))

    def _predicted(self, step: np.ndarray) -> float:
        miss = self.miss + self.weights * (self.slopes[self.index] @ step)
        room = np.minimum(self.room - self.limits @ step, 0.0)
        return float(miss @ miss) + self._penalty * float(room @ room)

    @property
    def _penalty(self) -> float:
        return 1e4

    def result(self) -> Attempt:
        """Return where the search is, and why it went no further."""
        failure = None if self.done else self._failure()
        at = (self.drive, self.response, self.error, self.excess)
        return Attempt(*at, self.solves, failure)

    def _failure(self) -> Failure:
        if not self.response.converged:
            return Failure.SEARCH_STOPPED
        free, problem = self.driven, self.problem
        slopes = self.weights[:, None] * self.slopes[np.ix_(self.index, free)]
        down = -(slopes.T @ self.miss)
        flat = _FLAT * float(np.linalg.norm(slopes)) * self.error
        if np.abs(down).max(initial=0.0) <= flat:
            return Failure.TARGET_OUT_OF_REACH
        edge = 1e-9 * self.scale
        drive, low, high = self.drive[free], problem.low[free], problem.high[free]
        stopped = ((drive <= low + edge) & (down < 0.0)) | ((drive >= high - edge) & (down > 0.0))
        tight = self.limits[self.room <= _KEPT][:, free]
        # What of the way down is left where limits forbid the rest of it.
        left = np.where(stopped, 0.0, down)
        if len(tight):
            along = left - tight.T @ np.linalg.lstsq(tight.T, left, rcond=None)[0]
            if np.abs(along).max(initial=0.0) <= flat:
                return Failure.LIMITS_PREVENT
        if np.abs(left).max(initial=0.0) > flat:
            return Failure.TARGET_OUT_OF_REACH if self.settled else Failure.SEARCH_STOPPED
        # A tendon cannot push, and cannot be pulled for ever: these are not limits of anybody.
        free_of_choice = np.where(down < 0.0, (drive <= edge) & (low <= 0.0), ~problem.chosen[free])
        by_nature = (free_of_choice | ~stopped).all()
        return Failure.TARGET_OUT_OF_REACH if by_nature else Failure.LIMITS_PREVENT
