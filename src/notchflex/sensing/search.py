"""The force of one reading: the best one, and how far others fit."""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from jaxtyping import Float

from notchflex.search.least_squares import BoundedLeastSquares, SearchPoint
from notchflex.sensing.model import Force, Numbers, SensingModel, SensingStep, SolvedState

BAD_FIT = 12.0
"""Largest accepted misfit, in squares of the noise for each number read."""

# Part of the range over which differences approximate slopes that are not known.
_NARROW_STEP = 1e-5
# A force fits exactly with this misfit; a search has at most this number of solves.
_EXACT, _MAX_SOLVES = 1e-9, 60
# A bad fit is repeated from the best of this number of forces along each component.
_STARTS = 9
# Weight of a prior that keeps an unobservable force near the range.
_WEAK = 1e-3
# The end of an interval: the first move, as a part of the range, where slopes predict none, and the
# accuracy, as a part of the interval and of the range.
_FIRST_MOVE, _SMALL_MOVE, _NARROW = 1e-4, 1e-3, 1e-7
# Lengths of the moves that are solved together, as parts of what slopes predict, and the number of
# solves in which other components follow.
_LENGTHS, _FEW_SOLVES = np.array([0.9, 0.98, 1.02, 1.2, 2.0, 4.0]), 3


@dataclass(frozen=True, eq=False)
class ReadingProblem:
    """Problem of one reading: the force from the state after the reading before.

    A point of the search has a force, N, the whitened deviations of what the model would read
    from what was measured, and the solved path of one step.

    Attributes:
        model: The robot.
        step: The reading.
        start: The state before; None for rest.
        whitening: Matrix that makes the deviations independent of unit variance, (m, m).
    """

    model: SensingModel
    step: SensingStep
    start: SolvedState
    whitening: Float[np.ndarray, "m m"]

    @cached_property
    def least_squares(self) -> BoundedLeastSquares:
        """The problem for forces within the range."""
        largest = self.model.largest
        range_ = np.full(self.model.size, largest)
        return BoundedLeastSquares(
            lambda point, step: self.point(point.variables + step),
            -range_,
            range_,
            math.sqrt(_EXACT),
            reach=0.5 * largest,
            weak=_WEAK / largest,
        )

    def point(self, force: Force, *, with_slopes: bool = True) -> SearchPoint | None:
        """Solve a force."""
        path = self.model.solve(self.start, self.step.number, force[None])
        if not path.converged[0]:
            return None
        slopes = np.zeros((len(self.step.entries), self.model.size))
        if with_slopes:
            slopes = self.model.slopes(path)[0][self.step.entries]
        if not np.isfinite(slopes).all():
            slopes = self._differences(force)
        none = np.zeros((0, self.model.size))
        residuals = self._residuals(self.model.values(path)[0])
        return SearchPoint(force, residuals, self.whitening @ slopes, none, none[:, 0], path)

    def misfits(self, forces: Float[np.ndarray, "k d"]) -> Float[np.ndarray, " k"]:
        """Return sums of squares of the whitened deviations; infinite without an equilibrium."""
        path = self.model.solve(self.start, self.step.number, forces)
        squares = [float((self._residuals(row) ** 2).sum()) for row in self.model.values(path)]
        return np.nan_to_num(np.where(path.converged, squares, np.inf), nan=np.inf)

    def _residuals(self, values: Float[np.ndarray, " outputs"]) -> Numbers:
        return self.whitening @ (values[self.step.entries] - self.step.measured)

    def _differences(self, force: Force) -> Float[np.ndarray, "m d"]:
        """Slopes by differences."""
        width = _NARROW_STEP * self.model.largest
        moves = width * np.eye(len(force))
        path = self.model.solve(
            self.start, self.step.number, np.concatenate([force + moves, force - moves])
        )
        ahead, behind = np.split(self.model.values(path)[:, self.step.entries], 2)
        return np.nan_to_num((ahead - behind).T / (2.0 * width))


def best(problem: ReadingProblem, forces: Iterable[Force]) -> SearchPoint | None:
    """Find the force that fits best, from the best of some; None without an equilibrium.

    Where several fit equally well, it stays near the one it began at.
    """
    points = [point for force in forces if (point := problem.point(force)) is not None]
    if not points:
        return None
    point = min(points, key=lambda point: point.merit)
    return problem.least_squares.search(point, _MAX_SOLVES).point


def fits_badly(point: SearchPoint | None) -> bool:
    """Return whether a force misses the readings by far more than their noise."""
    return point is None or point.merit > BAD_FIT * max(len(point.residuals), 1)


def best_of_all(problem: ReadingProblem, forces: list[Force]) -> SearchPoint | None:
    """Find the force that fits best near some, and, if none fits, from all over the range."""
    near = best(problem, forces)
    if not fits_badly(near):
        return near
    largest = problem.model.largest
    axes = np.eye(problem.model.size)
    scan = np.concatenate([np.outer(np.linspace(-largest, largest, _STARTS), row) for row in axes])
    far = best(problem, [scan[int(np.argmin(problem.misfits(scan)))]])
    points = [point for point in (near, far) if point is not None]
    return min(points, key=lambda point: point.merit, default=None)


@dataclass(frozen=True, eq=False)
class Extreme:
    """The end of what fits along a direction.

    Attributes:
        inside: The last force found that fits.
        force: The first beyond it that does not, N, (d,); at the range of the search the last one.
        limited: Whether the range of the search ends it.
    """

    inside: SearchPoint
    force: Force
    limited: bool


def extreme(
    problem: ReadingProblem, point: SearchPoint, component: int, side: float, most: float
) -> Extreme:
    """Go as far along a component as forces fit, while the other components follow.

    Args:
        problem: The reading.
        point: A force that fits.
        component: Component of the force.
        side: 1.0 for its largest value, -1.0 for its smallest.
        most: The largest misfit that fits.

    Returns:
        The end of the connected part around the force.
    """
    largest, origin = problem.model.largest, float(point.variables[component])
    # How far the component can move in the linearised problem, where slopes tell it.
    slopes = point.slopes
    normal = slopes.T @ slopes + problem.least_squares.weak**2 * np.eye(slopes.shape[1])
    lean = float(np.linalg.inv(normal)[component, component])
    move = math.sqrt(max(most - point.merit, 0.0) * lean)
    move = max(move if move < largest else 0.0, _FIRST_MOVE * largest)
    beyond = None
    while not side * (here := float(point.variables[component])) >= largest * (1.0 - 1e-9):
        if beyond is None:
            values = here + side * move * _LENGTHS
            move *= _LENGTHS[-1]
        else:
            gap = abs(float(beyond[component]) - here)
            if gap <= max(_SMALL_MOVE * abs(here - origin), _NARROW * largest):
                break
            values = np.linspace(here, beyond[component], len(_LENGTHS) + 2)[1:-1]
        values = np.clip(values, -largest, largest)
        point, beyond = _farthest(problem, point, beyond, component, values, most)
    inside = problem.point(point.variables, with_slopes=False) or point
    limited = side * here >= largest * (1.0 - 1e-9)
    return Extreme(inside, inside.variables if limited or beyond is None else beyond, limited)


def _farthest(
    problem: ReadingProblem,
    point: SearchPoint,
    beyond: Force | None,
    component: int,
    values: Float[np.ndarray, " k"],
    most: float,
) -> tuple[SearchPoint, Force | None]:
    """Return the last of some values of a component that fits, and the first that does not."""
    others = np.arange(problem.model.size) != component
    forces = np.tile(point.variables, (len(values), 1))
    forces[:, component] = values
    if others.any():  # the others follow, to first order
        slopes, weak = point.slopes[:, others], problem.least_squares.weak
        normal = slopes.T @ slopes + weak**2 * np.eye(int(others.sum()))
        behind = point.residuals[:, None] + point.slopes @ (forces - point.variables).T
        forces[:, others] -= np.linalg.solve(normal, slopes.T @ behind).T
        largest = problem.model.largest
        forces[:, others] = np.clip(forces[:, others], -largest, largest)
    fits = np.append(problem.misfits(forces) <= most, False)
    count = int(np.argmin(fits))
    if count < len(forces):
        beyond = failing = forces[count]
        trial = problem.point(failing) if others.any() and not count else None
        if trial is not None:
            low, high = (
                np.where(others, end, trial.variables)
                for end in (problem.least_squares.low, problem.least_squares.high)
            )
            search = replace(problem.least_squares, low=low, high=high, tolerance=math.sqrt(most))
            trial = search.search(trial, _FEW_SOLVES).point
            if trial.merit <= most:
                return trial, None
    if count and others.any():
        point = problem.point(forces[count - 1]) or point
    elif count:  # one component needs no slopes
        point = replace(point, variables=forces[count - 1])
    return point, beyond
