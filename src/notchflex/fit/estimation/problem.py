"""The objective of a fit as a function of its constants, and the search for its minimum."""

from __future__ import annotations

from collections.abc import Callable
from copy import copy
from dataclasses import replace

import numpy as np
from jaxtyping import Float
from scipy.stats import qmc

from notchflex import InputError
from notchflex.fit.estimation.intervals import Cost, Minimum, Vector, minimise, unit_free
from notchflex.fit.estimation.objective import FitObjective, Noise, first_noise
from notchflex.fit.model.constants import Unknown
from notchflex.fit.model.samples import Samples

Progress = Callable[[str, int, int], None]
"""Called with the name of the task, how much of it is done, and how much there is."""

# How often a search hops from where it ended, by how much (of the objective) the hop goes up, and
# what is a gain worth hopping on from.
_HOPS, _HOP, _SETTLED = 3, 3e-3, 1e-6
# Number of candidates for each start, some of which have no solution.
_DRAWS = 8


class FitProblem:
    """An objective as a function of constants.

    Attributes:
        samples: The measurements.
        objective: The objective.
        unknowns: The constants.
        drawing: What else may deviate, within the tolerances of the drawings (`deviations_of`).
        noise: Standard deviations of the measurements; None before the first call.
        lower: Least values allowed.
        upper: Greatest values allowed.
    """

    def __init__(
        self, samples: Samples, objective: FitObjective, drawing: tuple[Unknown, ...] = ()
    ) -> None:
        objective.check(samples.quantities)
        if not objective.takes_priors and any(one.prior for one in samples.unknowns):
            raise InputError.UNSUPPORTED(
                "a prior needs LeastSquares() or SumOfRobotErrors(); other objectives take none"
            )
        self.samples, self.objective, self.unknowns = samples, objective, samples.unknowns
        self.drawing = drawing
        self.noise: Noise | None = None
        self._spread: tuple[np.ndarray, np.ndarray] | None = None
        self.lower = np.array([one.lower for one in self.unknowns], float)
        self.upper = np.array([one.upper for one in self.unknowns], float)

    def __call__(self, values: Vector) -> Cost | None:
        """Return the objective; None if the model has no solution, or no finite derivatives."""
        residuals = self.samples.residuals(values)
        if residuals is None:
            return None
        if not (np.isfinite(residuals.values).all() and np.isfinite(residuals.slopes).all()):
            return None
        if self.noise is None:
            self.noise = first_noise(self.samples, residuals)
        if self._spread is not None:
            residuals = replace(residuals, spread=self._spread[0], expected=self._spread[1])
        cost = self.objective.cost(residuals, self.noise.deviation)
        for number, unknown in enumerate(self.unknowns):
            if unknown.prior is not None:  # as a measurement of the constant itself
                mean, deviation = unknown.prior
                weight = self.objective.weight_of_one(residuals, self.noise.deviation)
                off = (float(values[number]) - mean) / deviation
                cost = cost._replace(value=cost.value + 0.5 * weight * off**2)
                cost.gradient[number] += weight * off / deviation
                more = np.zeros_like(cost.curvature)
                more[number, number] = weight / deviation**2
                cost = cost._replace(
                    curvature=cost.curvature + more,
                    scatter=cost.scatter + weight * more,
                    hessian=None if cost.hessian is None else cost.hessian + more,
                )
        return cost

    def linearised(self, values: Vector, deviations: Vector) -> FitProblem | None:
        """Return the problem with the model linearised about deviations from the drawing.

        Deviations by which the model cannot be varied are left out; None if no robot deviates so.
        """
        at = tuple(
            replace(one, start=float(start))
            for one, start in zip(self.drawing, deviations, strict=True)
        )
        other = copy(self)
        try:
            other.samples = self.samples.deviated(at)
        except InputError:
            return None
        slopes = [(one, other.samples.slopes_of(one, values)) for one in at]
        other.drawing = tuple(one for one, by_one in slopes if by_one is not None)
        spread = np.array([by_one for _, by_one in slopes if by_one is not None]).T
        start = np.array([one.start for one in other.drawing])
        other._spread = (spread, spread @ (other.means - start)) if other.drawing else None
        return other

    @property
    def means(self) -> Float[np.ndarray, " m"]:
        """Means of the deviations from the drawings, in standard deviations."""
        return np.array([one.prior[0] for one in self.drawing if one.prior is not None])

    def minimum(self, start: Vector) -> Minimum:
        """Return the minimum that a search from a start ends at."""
        return minimise(self, start, self.lower, self.upper)

    def held(self, start: Vector, lower: Vector, upper: Vector) -> Minimum:
        """Return the minimum with a constant held by equal limits.

        Deviations from the drawing are linearised there anew: those at the estimate would put the
        ends of wide intervals too near.
        """
        minimum = minimise(self, start, lower, upper, tolerance=1e-7)
        if self.drawing and minimum.cost is not None:
            deviations = self.means + minimum.cost.deviations
            linearised = self.linearised(minimum.values, deviations)
            if linearised is not None:
                return minimise(linearised, minimum.values, lower, upper, tolerance=1e-7)
        return minimum


def search(
    problem: FitProblem, starts: int, seed: int, progress: Progress | None
) -> tuple[Minimum, ...]:
    """Search from several starts; another one replaces a start without a solution."""
    minima: list[Minimum] = []
    for number, point in enumerate(starting_points(problem, starts, seed)):
        minimum = search_from(problem, point, number, starts, seed)
        if minimum.cost is None and minima:
            continue
        minima.append(minimum)
        if progress is not None:
            progress("searching", len(minima), starts)
        if len(minima) == starts:
            break
    return tuple(minima)


def search_from(problem: FitProblem, point: Vector, number: int, starts: int, seed: int) -> Minimum:
    """Search from one starting point; what it finds does not depend on the other searches.

    Args:
        problem: The objective.
        point: The starting point.
        number: Its number, from 0.
        starts: Number of starts of the fit.
        seed: Seed of the starting points.
    """
    return _lowest_nearby(problem, point, _HOPS if starts > 1 else 0, seed + number)


def starting_points(problem: FitProblem, starts: int, seed: int) -> Float[np.ndarray, "s k"]:
    """Return the robots as they are and, for several starts, candidates of Sobol's sequence.

    Args:
        problem: The objective.
        starts: Number of starts.
        seed: Seed of the sequence.
    """
    start = np.array([[one.start for one in problem.unknowns]])
    if starts <= 1:
        return start
    first = np.array([one.first for one in problem.unknowns])
    last = np.array([one.last for one in problem.unknowns])
    sobol = qmc.Sobol(len(first), rng=np.random.default_rng(seed))
    drawn = sobol.random_base2(int(np.ceil(np.log2((starts - 1) * _DRAWS))))
    return np.concatenate([start, first + drawn * (last - first)])


def _lowest_nearby(problem: FitProblem, start: Vector, hops: int, seed: int) -> Minimum:
    """Search from a start, and again from points near the minimum.

    The objective has kinks where notches close and branches of the material begin, and so shallow
    minima beside each other. A hop leads where a parabola would be a little higher.
    """
    best = problem.minimum(start)
    random = np.random.default_rng(seed)
    tries = 0
    while best.cost is not None and tries < hops:
        tries += 1
        sizes, curvature = unit_free(best.cost.curvature)
        stiffness, axes = np.linalg.eigh(curvature)
        along = random.standard_normal(len(stiffness))
        along *= np.sqrt(2.0 * _HOP * abs(best.cost.value)) / np.linalg.norm(along)
        is_known = stiffness > 1e-9
        step = axes[:, is_known] @ (along[is_known] / np.sqrt(stiffness[is_known])) / sizes
        other = problem.minimum(best.values + step)
        calls = best.calls + other.calls
        gain = np.inf if other.cost is None else other.cost.value - best.cost.value
        if gain < -1e-9 * abs(best.cost.value):
            tries = tries if gain > -_SETTLED * abs(best.cost.value) else 0
            best = other
        best = best._replace(calls=calls)
    return best
