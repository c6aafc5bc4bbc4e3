"""The search of a design: SLSQP from several starts, and what comes nearest where limits are missed."""

from __future__ import annotations

import itertools
import re
from collections import Counter
from collections.abc import Sequence
from copy import copy
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
from jaxtyping import Float
from scipy.optimize import least_squares

from notchflex import InputError
from notchflex.designing.model.quantities import Reading
from notchflex.designing.problem import DesignEvaluation, DesignProblem, Progress
from notchflex.designing.specification import SearchOptions
from notchflex.search.slsqp import TOLERANCE, Minimum, Vector, minimise
from notchflex.search.starts import sobol_points, spread_out

_NUMBER = re.compile(r"\[\d+\]")
# Penalty on a violation of one size, relative to the spread of the sums.
_WEIGHT = 10.0
# Largest difference of scaled variables of equal robots.
_SAME = 1e-3
# Lengths that are tried on both sides of where the search ended; of more, the nearest is taken.
_SIDES = 6
# Least squares: a residual where there is no robot, in sizes of those at the start; the start's
# distance from limits; precision; most evaluations; what SLSQP can go on from.
_PENALTY, _INSIDE, _PRECISION, _EVALUATIONS, _NEARLY = 1e2, 1e-9, 1e-5, 60, 1e-3


@dataclass(frozen=True, eq=False)
class SearchResult:
    """A robot that a search ended at.

    Attributes:
        problem: Robots of which form.
        number: Number of that form.
        evaluation: The robot.
        minimum: Which limits hold the best robot without a grid; None where SLSQP was not used.
    """

    problem: DesignProblem
    number: int
    evaluation: DesignEvaluation
    minimum: Minimum | None = None

    @property
    def is_stationary(self) -> bool:
        """Whether all constraints hold and no small change improves it, to first order."""
        return self.minimum is not None and self.minimum.is_stationary

    @property
    def merit(self) -> tuple[float, float]:
        """Largest violation, and the sum; less is better."""
        worst = self.problem.worst(self.evaluation)
        return (worst if worst > TOLERANCE else 0.0), self.evaluation.total


@dataclass(eq=False)
class Searches:
    """All searches of a design.

    Attributes:
        outcomes: Where they ended.
        interrupted: Whether they were stopped by Ctrl-C.
        rounded: The best robot on a grid, where one was asked for.
    """

    outcomes: list[SearchResult] = field(default_factory=list[SearchResult])
    interrupted: bool = False
    rounded: SearchResult | None = None

    @property
    def optimum(self) -> SearchResult:
        """The best of all."""
        return min(self.outcomes, key=lambda one: one.merit)

    @property
    def best(self) -> SearchResult:
        """The best on the grid, or of all."""
        return self.rounded or self.optimum

    @property
    def has_followed(self) -> bool:
        """Whether nothing but curves is asked, and a robot follows all well enough."""
        return any(one.problem.is_followed(one.evaluation) for one in self.outcomes)

    def has_agreed(self, number: int, count: int) -> bool:
        """Return whether nothing is to be gained from further searches of a form.

        So many have settled at the best robot that it has, or a curve is followed.
        """
        results = [one for one in self.outcomes if one.number == number and one.is_stationary]
        best = min(results, key=lambda one: one.merit, default=None)
        if best is None or self.has_followed:
            return best is not None
        apart = [np.abs(one.evaluation.z - best.evaluation.z).max(initial=0.0) for one in results]
        return bool((np.array(apart) < _SAME).sum() >= count)


def search(
    problems: Sequence[DesignProblem], options: SearchOptions, progress: Progress | None
) -> Searches:
    """Search robots of several forms.

    Args:
        problems: A problem for every form.
        options: How hard to try.
        progress: Called with what is done.

    Raises:
        InputError: No robot between the limits can be solved; the message says why.
    """
    searches = Searches()
    report: Progress = progress or (lambda stage, done, total: None)
    several = max(1, round(options.starts / len(problems)))
    candidates = max(4, options.candidates // len(problems))
    try:
        for number, problem in enumerate(problems):
            report("ranking robots", number, len(problems))
            firsts = starts(problem, several, candidates, options.seed)
            for done, first in enumerate(firsts):
                report("searching", number * several + done, several * len(problems))
                searches.outcomes += search_from(problem, number, first, options.iterations)
                if searches.has_agreed(number, max(2, (several + 1) // 2)):
                    break
            if searches.has_followed:
                break
        if searches.outcomes and searches.best.merit[0] > 0.0:
            report("searching what comes nearest", 0, 1)
            _approach(searches, options)
    except KeyboardInterrupt:
        searches.interrupted = True
        if not searches.outcomes:
            raise
    if not searches.outcomes:
        reasons = sum((problem.failures for problem in problems), Counter[str]())
        most = reasons.most_common(1)[0][0] if reasons else "no robot was tried"
        raise InputError.UNSUPPORTED(
            "no robot between the limits of the variables can be made and solved; most often: "
            f"{most.splitlines()[0]} Change the limits or the loads."
        )
    return searches


def search_from(
    problem: DesignProblem, number: int, first: DesignEvaluation, iterations: int
) -> list[SearchResult]:
    """Search from a robot by SLSQP, or by least squares; return where it ended, if it could begin."""
    settled = False
    if problem.is_least_squares:
        first, settled = _least_squares(problem, first)
        iterations = 0  # for the multipliers alone
    found = minimise(*problem.program(first), iterations)
    if found is None:
        return []
    found = found._replace(is_stationary=settled or found.is_stationary)
    return [SearchResult(problem, number, found.reached.source, found)]


def _approach(searches: Searches, options: SearchOptions) -> None:
    """Search from what misses least for what misses less, until nothing is missed."""
    for one in sorted(searches.outcomes, key=lambda one: one.merit):
        problem, number = one.problem, one.number
        near, _ = _least_squares(problem, one.evaluation)
        searches.outcomes.append(SearchResult(problem, number, near))
        if problem.worst(near) <= _NEARLY:
            searches.outcomes += search_from(problem, number, near, options.iterations)
        if searches.best.merit[0] == 0.0:
            return


def _least_squares(
    problem: DesignProblem, first: DesignEvaluation
) -> tuple[DesignEvaluation, bool]:
    """Search for the least residuals from a robot, and tell whether that settled.

    What misses limits counts by soft_l1: what is missed by far must not decide alone.
    """
    robots: dict[bytes, DesignEvaluation | None] = {}

    def residuals(z: Vector) -> Reading | None:
        if z.tobytes() not in robots:
            robots[z.tobytes()] = problem.evaluate(z)
        one = robots[z.tobytes()]
        return None if one is None else problem.residuals(one)

    start = np.clip(first.z, _INSIDE, 1.0 - _INSIDE)
    at_start = residuals(start)
    if at_start is None or not problem.count:
        return first, not problem.count
    large = _PENALTY * (1.0 + np.abs(at_start.values))

    def values(z: Vector) -> np.ndarray:
        reading = residuals(z)
        return large if reading is None else reading.values

    def slopes(z: Vector) -> np.ndarray:
        reading = residuals(z)
        return np.zeros_like(at_start.slopes) if reading is None else reading.slopes

    def stop(intermediate_result: Any) -> None:
        one = robots[intermediate_result.x.tobytes()]
        if one is not None and problem.is_followed(one):
            raise StopIteration

    found: Any = least_squares(
        values,
        start,
        slopes,  # pyright: ignore[reportArgumentType]
        (np.zeros(problem.count), np.ones(problem.count)),
        ftol=_PRECISION,
        xtol=_PRECISION,
        gtol=1e-12,
        loss="linear" if problem.is_least_squares else "soft_l1",
        max_nfev=_EVALUATIONS,
        callback=stop,
    )
    end = robots[found.x.tobytes()] or first
    return end, int(found.status) > 0 or problem.is_followed(end)


def starts(problem: DesignProblem, several: int, most: int, seed: int) -> list[DesignEvaluation]:
    """Return robots to start from: the robot as it is, and the best drawn ones far from each other."""
    initial = problem.initial
    if several == 1 and initial is not None:
        problem.set_sizes([initial])
        return [initial]
    drawn = ranked(problem, drawn_robots(problem, most, seed))
    if initial is None and not drawn:
        return []
    problem.set_sizes([one for one in (initial, *drawn) if one is not None])
    ordered = ([] if initial is None else [initial]) + drawn
    chosen = spread_out([one.z for one in ordered], several)
    by_vector = {one.z.tobytes(): one for one in reversed(ordered)}
    return [by_vector[z.tobytes()] for z in chosen]


def drawn_robots(problem: DesignProblem, most: int, seed: int) -> Float[np.ndarray, "most v"]:
    """Return scaled vectors: of Sobol's sequence, and in turn with values straight along the tube.

    Good designs are smooth, and among many values drawn one by one none is.
    """
    groups: dict[str, list[int]] = {}
    for number, column in enumerate(problem.solver.variables.columns):
        groups.setdefault(_NUMBER.sub("", column.name), []).append(number)
    half = max(1, most // 2)
    ends = sobol_points(half, 2 * len(groups), seed)
    smooth = np.zeros((len(ends), problem.count))
    for k, columns in enumerate(groups.values()):
        first, last = ends[:, 2 * k, None], ends[:, 2 * k + 1, None]
        # Every second has nearly one value.
        last = np.where(np.arange(len(ends))[:, None] % 2, last, first + 0.1 * (last - first))
        smooth[:, columns] = first + np.linspace(0.0, 1.0, len(columns)) * (last - first)
    drawn = np.stack([smooth, sobol_points(half, problem.count, seed)], axis=1)
    return drawn.reshape(-1, problem.count)


def ranked(problem: DesignProblem, vectors: Float[np.ndarray, "k v"]) -> list[DesignEvaluation]:
    """Return the robots of some vectors, the smallest sum with a penalty on violations first."""
    robots = [one for one in problem.evaluate_all(vectors) if one is not None]
    totals = np.array([one.total for one in robots])
    if not robots:
        return []
    spread = float(np.subtract(*np.quantile(totals, [0.75, 0.25]))) or 1.0
    missed = [np.minimum(np.abs(problem.violation(one)), 1.0).sum() for one in robots]
    order = np.argsort(totals / spread + _WEIGHT * np.array(missed), kind="stable")
    return [robots[number] for number in order]


def on_grid(searches: Searches, grid: float) -> Searches:
    """Return the searches with the best robot on a grid.

    Of the neighbours of the best robot it is the one that meets the constraints, or comes nearest,
    with the smallest sum.

    Args:
        searches: The searches.
        grid: Step of all lengths that are variables, mm; 0 for none.

    Raises:
        InputError: No robot on the grid lies within the limits and can be solved.
    """
    if not grid:
        return searches
    best = searches.optimum
    problem, solver = copy(best.problem), best.problem.solver
    variables = replace(solver.variables, grid=grid)
    problem.solver, problem.failures = replace(solver, variables=variables), Counter[str]()
    exact = problem.x(best.evaluation.z)
    steps = np.where(variables.lengths, exact / grid, 0.0)
    sides = [sorted({np.floor(one), np.ceil(one)}) for one in steps]
    if sum(map(len, sides)) > len(sides) + _SIDES:
        sides = [[np.round(one)] for one in steps]
    results: list[SearchResult] = []
    for places in itertools.product(*sides):
        x = np.where(variables.lengths, np.array(places) * grid, exact)
        z = (x - variables.lower) / variables.span
        one = problem.evaluate(z) if np.abs(z - 0.5).max(initial=0.0) <= 0.5 + 1e-9 else None
        if one is not None:
            results.append(replace(best, problem=problem, evaluation=one))
    if not results:
        reasons = "; ".join(problem.failures) or "all lie beyond the limits of the variables"
        raise InputError.UNSUPPORTED(
            f"no robot on a grid of {grid:g} mm beside the best one can be made: {reasons}; give a "
            "smaller grid."
        )
    return replace(searches, rounded=min(results, key=lambda one: one.merit))
