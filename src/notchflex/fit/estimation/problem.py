"""The objective of a fit as a function of its constants, and the search for its least value."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from jaxtyping import Float
from scipy.stats import qmc

from notchflex.errors import InputError
from notchflex.fit.estimation.curvature import unit_free
from notchflex.fit.estimation.minimise import Cost, Minimum, minimise
from notchflex.fit.estimation.noise import Noise, first_noise
from notchflex.fit.estimation.objective import FitObjective
from notchflex.fit.model.constants import Unknown
from notchflex.fit.model.samples import Samples

Progress = Callable[[str, int, int], None]
"""Called with what is being done, how much of it is done, and how much there is."""

# How often a search hops from where it ended, by how much (of the objective) the hop goes up, and
# what is a gain worth hopping on from.
_HOPS, _HOP, _SETTLED = 3, 3e-3, 1e-6
# A start that has no solution is drawn again, so often.
_DRAWS = 8


class Problem:
    """An objective of the values of some constants.

    Attributes:
        samples: The measurements.
        objective: What is made small.
        unknowns: The constants.
        noise: Standard deviations of what was measured.
        lower: Least values allowed.
        upper: Greatest values allowed.
    """

    def __init__(self, samples: Samples, objective: FitObjective) -> None:
        """Put them together; noise is told later."""
        objective.check(samples.quantities)
        if not objective.is_likelihood and any(one.prior for one in samples.unknowns):
            raise InputError.UNSUPPORTED(
                "a prior needs LeastSquares(); other objectives are no likelihoods"
            )
        self.samples, self.objective = samples, objective
        self.unknowns: tuple[Unknown, ...] = samples.unknowns
        self.noise: Noise | None = None
        self.lower = np.array([one.lower for one in self.unknowns])
        self.upper = np.array([one.upper for one in self.unknowns])

    def __call__(self, values: Float[np.ndarray, " k"]) -> Cost | None:
        """The objective; None where the model has no solution, or nobody knows its slopes."""
        residuals = self.samples.residuals(values)
        if residuals is None or not np.isfinite(residuals.values).all():
            return None
        if not np.isfinite(residuals.slopes).all():
            return None
        if self.noise is None:
            self.noise = first_noise(self.samples, residuals)
        return self._with_priors(self.objective.cost(residuals, self.noise.deviation), values)

    def _with_priors(self, cost: Cost, values: Float[np.ndarray, " k"]) -> Cost:
        """Add what is known beforehand, as measurements of the constants themselves."""
        for number, unknown in enumerate(self.unknowns):
            if unknown.prior is None:
                continue
            mean, deviation = unknown.prior
            off = (float(values[number]) - mean) / deviation
            cost = cost._replace(value=cost.value + 0.5 * off**2)
            cost.gradient[number] += off / deviation
            cost.curvature[number, number] += 1.0 / deviation**2
        return cost


def starting_points(problem: Problem, starts: int, seed: int) -> Float[np.ndarray, "s k"]:
    """The robots as they are, and a spread of other values: one candidate per row, many a start."""
    first = np.array([one.first for one in problem.unknowns])
    last = np.array([one.last for one in problem.unknowns])
    here = np.array([[one.start for one in problem.unknowns]])
    if starts <= 1:
        return here
    sobol = qmc.Sobol(len(first), rng=np.random.default_rng(seed))
    drawn = sobol.random_base2(int(np.ceil(np.log2((starts - 1) * _DRAWS))))
    return np.concatenate([here, first + drawn * (last - first)])


def search(
    problem: Problem, starts: int, seed: int, progress: Progress | None
) -> tuple[Minimum, ...]:
    """Search from several starts; a start where the model has no solution gives way to another."""
    found: list[Minimum] = []
    points = iter(starting_points(problem, starts, seed))
    while len(found) < starts:
        point = next(points, None)
        if point is None:
            break
        hops = _HOPS if starts > 1 else 0
        one = lowest_nearby(problem, point, hops, seed + len(found))
        if one.cost is None and found:
            continue
        found.append(one)
        if progress is not None:
            progress("searching", len(found), starts)
    return tuple(found)


def lowest_nearby(
    problem: Problem, start: Float[np.ndarray, " k"], hops: int, seed: int
) -> Minimum:
    """Search from a start, and again from beside where that ended.

    Where notches close and branches of the material begin the objective has kinks, and so shallow
    minima beside each other. A hop leads where a parabola would be a little higher.
    """
    best = minimise(problem, start, problem.lower, problem.upper)
    random = np.random.default_rng(seed)
    tries = 0
    while best.cost is not None and tries < hops:
        tries += 1
        plain = unit_free(best.cost.curvature)
        size, axes = np.linalg.eigh(plain.curvature)
        along = random.standard_normal(len(size))
        along *= np.sqrt(2.0 * _HOP * abs(best.cost.value)) / np.linalg.norm(along)
        known = size > 1e-9
        step = axes[:, known] @ (along[known] / np.sqrt(size[known])) / plain.size
        other = minimise(problem, best.values + step, problem.lower, problem.upper)
        calls = best.calls + other.calls
        gain = np.inf if other.cost is None else other.cost.value - best.cost.value
        if gain < -1e-9 * abs(best.cost.value):
            tries = tries if gain > -_SETTLED * abs(best.cost.value) else 0
            best = other
        best = best._replace(calls=calls)
    return best


__all__ = ["Problem", "Progress", "search"]
