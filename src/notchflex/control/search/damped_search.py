"""The steps of a search for a target, damped as Levenberg and Marquardt do."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from jaxtyping import Float, Int

from notchflex.control.program.drive_step import FIRST_PART, GROWTH, MIN_DRIVES
from notchflex.control.program.response import Response
from notchflex.control.search.problem import Attempt, Problem, size_of
from notchflex.control.search.quadratic import least_step
from notchflex.control.search.search_point import KEPT, SearchPoint, limit_rows, penalty
from notchflex.control.search.unmet import why_unmet

# A column of the slopes that is this part of the target over the drives is that of a tendon that
# sticks.
_STUCK = 1e-8
# Drive changes, as parts of the drives, that make a tendon slide and show its slopes.
_SIDE_STEPS = (1e-6, -1e-6, 0.3, -0.3)
# Factor on the step length after a step without motion, and the factor by which the error may then
# increase.
_STRIDE, _ACROSS = 4.0, 30.0
# The error is minimal if its slope by the drives is below this part of the largest possible one.
_FLAT = 1e-6


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
        least = (_STUCK * self._usual / self.scale) ** 2
        stuck = (slopes[self.entries] ** 2).sum(axis=0) <= least
        if not stuck.any():
            return slopes, stuck
        if self._sliding is None:
            self._sliding = self._slopes_when_sliding(np.zeros_like(slopes), least)
        return np.where(stuck, self._sliding, slopes), stuck

    def _slopes_when_sliding(self, slopes: np.ndarray, least: float) -> np.ndarray:
        """Slopes near the present state of a tendon that slides, whichever way it does."""
        for part in _SIDE_STEPS:
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
