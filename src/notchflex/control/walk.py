"""The points of a search for a target, and the steps between them."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Bool, Float, Int

from notchflex.control.drive_model import Response
from notchflex.control.problem import Attempt, Problem, size_of
from notchflex.control.quadratic import least_step
from notchflex.errors import Failure

# Where drives are redundant the smallest meet the target. This weight decides among those that
# meet it equally well, and is too small to act against the target.
_LEAST_DRIVES = 1e-10
# A step may change a drive by so many times the largest one, or the first by a part of what closes
# a notch.
_GROWTH, _FIRST_PART = 1.0, 0.05
# Limits count as kept within this part of them; those smaller than the second number (N, mm, or a
# strain) within parts of it.
KEPT, _LEAST_LIMIT = 1e-7, 1e-3
# What a violation of limits, as parts of them, counts beside the error.
_PENALTY = 1e4
# A column of the slopes that is this part of the target over the drives is that of a tendon that
# sticks.
_STUCK = 1e-8
# Changes by these parts of the drives tell what a tendon does that slides.
_ASIDE = (1e-6, -1e-6, 0.3, -0.3)
# Where a step moves nothing the next one is so many times longer; where it then moves something it
# may increase the error so many times.
_STRIDE, _ACROSS = 4.0, 30.0
# Tensions below this part of what about closes a notch are none.
_SLACK = 1e-10
# An error whose slope by the drives is this part of what it could be is as small as it gets.
_FLAT = 1e-6


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
        return max(0.0, -float(self.room.min())) if self.room.size else 0.0

    @property
    def merit(self) -> float:
        """What a step must lessen: the squared error, and that of broken limits."""
        if not self.response.converged:
            return np.inf
        return self.error**2 + _penalty(self.room)


class Walk:
    """One search: its points one after the other.

    Within a dead band, between turning round and the first slip of a contact, a tendon moves
    nothing, if the others stay as they are. A search can leave these bands out: its variables are
    what the drives move beyond.

    Args:
        problem: What is aimed at, and the limits.
        before: The state before, packed.
        entries: Which numbers of a response are aimed at.
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
        here = self.point
        met = here.error <= self.problem.search.tolerance and here.response.converged
        return met and here.excess <= KEPT

    def step(self, damping: float) -> Float[np.ndarray, " t"]:
        """Return the next step of all drives.

        Args:
            damping: What the step is weighted with, as a part of the slopes.
        """
        here, free = self.point, self.free
        slopes = self.weights[:, None] * here.slopes[self.entries]
        normal = slopes.T @ slopes
        size = float(normal.trace()) / len(free)
        step = np.zeros(len(here.drive))
        if not size > 0.0:
            return step
        small = _LEAST_DRIVES * size
        hessian = normal + (damping * size + small) * self._eye
        gradient = slopes.T @ here.miss + small * here.drive[free]
        reach = _GROWTH * self.scale
        low = np.maximum((self._low - here.moved)[free], -reach)
        high = np.minimum((self._high - here.moved)[free], reach)
        least = least_step(hessian, gradient, low, high, here.limits, here.room)
        step[free] = np.minimum(np.maximum(self._stride * least, low), high)
        return step

    def go(self, step: Float[np.ndarray, " t"], least: float) -> float:
        """Try a step and keep it if it helps.

        Args:
            step: The step.
            least: The part of what it promises that it must bring.

        Returns:
            What it brought of what it promised.
        """
        here, moved = self.point, self.point.moved + step
        response = self._solve(moved)
        if not response.converged:
            return -1.0
        there = self._at(moved, response, here)
        promised = here.merit - self._predicted(step[self.free])
        gain = (here.merit - there.merit) / promised if promised > 0.0 else -1.0
        on_its_way = bool(there.stuck[step[self.free] != 0.0].any())
        on_its_way = on_its_way and there.merit <= here.merit * (1.0 + 1e-9)
        if here.stuck.any() and not there.stuck.any() and there.error <= _ACROSS * here.error:
            # Beyond the band, and too far: from there slopes show the way back.
            self.point, self.scale, self._stride = there, self._scale(moved), 1.0
            return max(gain, least)
        if gain >= least or on_its_way or there.error <= self.problem.search.tolerance:
            self.point, self.scale = there, self._scale(moved)
            # A notch that is pressed together moves as little as a tendon that sticks.
            self._stride = _STRIDE * self._stride if on_its_way else 1.0
            return max(gain, 1.0 if on_its_way else least)
        self._stride = 1.0
        # A kink lies between: what the step has shown turns the next one along it.
        self.point = replace(here, slopes=self._secant(moved, response, here))
        return gain

    def jump(self, step: Float[np.ndarray, " t"]) -> None:
        """Take a step, whatever it brings."""
        moved = self.point.moved + step
        response = self._solve(moved)
        if response.converged:
            self.point = self._at(moved, response, self.point)

    def result(self) -> Attempt:
        """Return where the search is, and why it went no further."""
        here, failure = self.point, None if self.done else self._failure()
        return Attempt(here.drive, here.response, here.error, here.excess, self.solves, failure)

    def _outside(self, drive: np.ndarray) -> np.ndarray:
        """What drives move beyond the dead bands."""
        low, high = self._band
        return np.maximum(drive - high, 0.0) + np.minimum(drive - low, 0.0)

    def _drive(self, moved: np.ndarray) -> np.ndarray:
        low, high = self._band
        drive = np.where(moved > 0.0, high, np.where(moved < 0.0, low, self._present)) + moved
        drive = np.minimum(np.maximum(drive, self.problem.low), self.problem.high)
        if self.problem.by_tension:  # rounding leaves tensions that are none, but not slack
            drive[drive < _SLACK * self.problem.unit] = 0.0
        return drive

    def _scale(self, moved: np.ndarray) -> float:
        """Size of the drives, that of the first step at least."""
        return max(float(np.abs(self._drive(moved)).max()), _FIRST_PART * self.problem.unit)

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
        least = (_STUCK * self._usual / self.scale) ** 2
        stuck = (slopes[self.entries] ** 2).sum(axis=0) <= least
        if not stuck.any():
            return slopes, stuck
        if self._sliding is None:
            self._sliding = self._slopes_when_sliding(np.zeros_like(slopes), least)
        return np.where(stuck, self._sliding, slopes), stuck

    def _slopes_when_sliding(self, slopes: np.ndarray, least: float) -> np.ndarray:
        """Slopes near the present state of a tendon that slides, whichever way it does."""
        for part in _ASIDE:
            aside = part * self.scale * self.problem.driven
            found = self._solve(np.minimum(np.maximum(aside, self._low), self._high))
            if not (found.converged and np.isfinite(found.jacobian).all()):
                continue
            stuck = (slopes[self.entries] ** 2).sum(axis=0) <= least
            slopes = np.where(stuck, found.jacobian[:, self.free], slopes)
            if ((slopes[self.entries] ** 2).sum(axis=0) > least).all():
                break
        return slopes

    def _predicted(self, step: np.ndarray) -> float:
        """The merit that the slopes promise after a step."""
        here = self.point
        miss = here.miss + self.weights * (here.slopes[self.entries] @ step)
        return float(miss @ miss) + _penalty(here.room - here.limits @ step)

    def _failure(self) -> Failure:
        here, free = self.point, self.free
        if not here.response.converged:
            return Failure.SEARCH_STOPPED
        slopes = self.weights[:, None] * here.slopes[self.entries]
        down = -(slopes.T @ here.miss)
        flat = _FLAT * float(np.linalg.norm(slopes)) * here.error
        if np.abs(down).max() <= flat:
            return Failure.TARGET_OUT_OF_REACH
        edge, drive = 1e-9 * self.scale, here.drive[free]
        low, high = self.problem.low[free], self.problem.high[free]
        at_low, at_high = (
            (drive <= low + edge) & (down < 0.0),
            (drive >= high - edge) & (down > 0.0),
        )
        # What of the way down is left where limits forbid the rest of it.
        left = np.where(at_low | at_high, 0.0, down)
        tight = here.limits[here.room <= KEPT]
        if len(tight):
            along = left - tight.T @ np.linalg.lstsq(tight.T, left, rcond=None)[0]
            if np.abs(along).max() <= flat:
                return Failure.LIMITS_PREVENT
        if np.abs(left).max() > flat:
            return Failure.TARGET_OUT_OF_REACH if self.settled else Failure.SEARCH_STOPPED
        # A tendon cannot push, and cannot be pulled for ever: these are not limits of anybody.
        chosen = (at_low & (low > 0.0)) | (at_high & self.problem.chosen[free])
        return Failure.LIMITS_PREVENT if chosen.any() else Failure.TARGET_OUT_OF_REACH


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
        scale = np.maximum(np.abs(bound.limit[given]), _LEAST_LIMIT)
        left = bound.side * (bound.limit - values[at])[given] / scale
        seen = np.isfinite(left)
        rows.append((bound.side * slopes[at][given] / scale[:, None])[seen])
        room.append(left[seen])
    return np.concatenate(rows), np.concatenate(room)


def _penalty(room: np.ndarray) -> float:
    if not room.size:
        return 0.0
    broken = np.minimum(room, 0.0)
    return _PENALTY * float(broken @ broken)
