"""The search of a design: from several starts, for the best robot or for what comes nearest."""

from __future__ import annotations

import itertools
import re
from collections import Counter
from collections.abc import Sequence
from copy import copy
from dataclasses import dataclass, field, replace
from functools import cache

import numpy as np
from jaxtyping import Float
from scipy.optimize import least_squares

from notchflex import InputError
from notchflex.designing.problem import DesignEvaluation, DesignProblem, Progress
from notchflex.designing.specification import SearchOptions
from notchflex.pieces import sobol_points
from notchflex.search.slsqp import SearchMinimum, Vector, minimise
from notchflex.search.starts import spread_out

_NUMBER = re.compile(r"\[\d+\]")
# Largest difference of scaled variables of equal robots.
_SAME = 1e-3
# Lengths that are tried on both sides of where the search ended; of more, the nearest is taken.
_SIDES = 6
# Least squares: a residual where there is no robot, precision, and most evaluations. Many robots
# follow a curve equally well, and among them a search hardly settles more precisely.
_PENALTY, _PRECISION, _EVALUATIONS = 1e3, 1e-3, 60
# Largest violation of a robot from which SLSQP begins once more.
_NEARLY = 0.05


@dataclass(frozen=True, eq=False)
class SearchResult:
    """A robot that a search ended at.

    Attributes:
        problem: Robots of which form.
        evaluation: The robot.
        minimum: Which limits hold the best robot without a grid; None where nothing says so.
    """

    problem: DesignProblem
    evaluation: DesignEvaluation
    minimum: SearchMinimum | None = None

    @property
    def is_stationary(self) -> bool:
        """Whether all constraints hold and no small change improves it, to first order."""
        return self.minimum is not None and self.minimum.is_stationary

    @property
    def merit(self) -> tuple[float, float]:
        """Largest violation, and the sum; less is better."""
        return self.problem.merit(self.evaluation)


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
        return min(self.outcomes, key=lambda result: result.merit)

    @property
    def best(self) -> SearchResult:
        """The best on the grid, or of all."""
        return self.rounded or self.optimum


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
            settled: list[SearchResult] = []
            for done, first in enumerate(firsts):
                report("searching", number * several + done, several * len(problems))
                ends = search_from(problem, first, options.iterations)
                searches.outcomes += ends
                settled += [end for end in ends if end.is_stationary]
                # How many have settled at the best robot.
                places = [end.evaluation.z for end in sorted(settled, key=lambda end: end.merit)]
                agreed = sum(np.abs(z - places[0]).max(initial=0.0) < _SAME for z in places)
                if agreed >= max(2, (several + 1) // 2):
                    break
    except KeyboardInterrupt:
        searches.interrupted = True
        if not searches.outcomes:
            raise
    if not searches.outcomes:
        reasons = sum((problem.failures for problem in problems), Counter[str]())
        most = reasons.most_common(1)[0][0] if reasons else "no robot was tried"
        raise InputError.UNSUPPORTED(
            "no robot between the limits of the variables can be made and solved; most often: "
            f"{most.splitlines()[0].rstrip('.')}. Change the limits or the loads."
        )
    return searches


def search_from(
    problem: DesignProblem, first: DesignEvaluation, iterations: int
) -> list[SearchResult]:
    """Search from a robot; return where that ended, if it could begin."""
    if problem.is_least_squares:  # SLSQP hardly settles among the many robots that follow a curve
        end, settled = _least_squares(problem, first)
        return _descended(problem, end, 0, settled)  # for the multipliers
    results = _descended(problem, first, iterations)
    if results and results[0].merit[0] > 0.0:
        near, _ = _least_squares(problem, first)
        can_be_met = problem.worst(near) <= _NEARLY
        results += _descended(problem, near, iterations if can_be_met else 0)
    return results


def _descended(
    problem: DesignProblem, first: DesignEvaluation, iterations: int, settled: bool = False
) -> list[SearchResult]:
    """Return where SLSQP ended, if it could begin."""
    minimum = minimise(*problem.program(first), iterations)
    if minimum is None:
        return []
    minimum = minimum._replace(is_stationary=minimum.is_stationary or settled)
    return [SearchResult(problem, minimum.reached.source, minimum)]


def _least_squares(
    problem: DesignProblem, first: DesignEvaluation
) -> tuple[DesignEvaluation, bool]:
    """Search for the least residuals from a robot, and tell whether that settled.

    What misses limits counts by soft_l1: what is missed by far must not decide alone.
    """
    if not problem.count:
        return first, True
    size = len(problem.residuals(first))
    failed = np.column_stack([np.full(size, _PENALTY), np.zeros((size, problem.count))])

    @cache
    def evaluated(key: bytes) -> DesignEvaluation | None:
        return problem.evaluate(np.frombuffer(key))

    def table(z: Vector) -> np.ndarray:
        here = evaluated(z.tobytes())
        return failed if here is None else problem.residuals(here)

    result = least_squares(
        lambda z: table(z)[:, 0],
        first.z,
        lambda z: table(z)[:, 1:],  # pyright: ignore[reportArgumentType]
        bounds=(0.0, 1.0),
        ftol=_PRECISION,
        xtol=_PRECISION,
        gtol=1e-12,
        loss="linear" if problem.is_least_squares else "soft_l1",
        max_nfev=_EVALUATIONS,
    )
    end = evaluated(result.x.tobytes()) or first
    return end, int(result.status) > 0


def starts(problem: DesignProblem, several: int, most: int, seed: int) -> list[DesignEvaluation]:
    """Return robots to start from: the robot as it is, then the best drawn ones, far apart."""
    firsts = [] if problem.initial is None else [problem.initial]
    if len(firsts) < several:
        candidates = problem.evaluate_all(drawn_robots(problem, most, seed))
        firsts += sorted(filter(None, candidates), key=problem.merit)
    problem.set_sizes(firsts)
    return [firsts[number] for number in spread_out([first.z for first in firsts], several)]


def drawn_robots(problem: DesignProblem, most: int, seed: int) -> Float[np.ndarray, "most v"]:
    """Return scaled vectors, values of notches in turn one by one and straight along the tube.

    Good designs are smooth, and among many values drawn one by one none is.
    """
    names = [_NUMBER.sub("", column.title) for column in problem.solver.variables.columns]
    groups = list(dict.fromkeys(names))
    group = [groups.index(name) for name in names]
    place = [names[:number].count(name) for number, name in enumerate(names)]
    along = np.divide(place, np.maximum([names.count(name) - 1 for name in names], 1))
    half = max(1, most // 2) if groups else 1
    first, last = np.split(sobol_points(2 * len(groups), seed, 0, half, half), 2, axis=1)
    last = np.where(np.arange(len(first))[:, None] % 2, last, first)
    smooth = first[:, group] + along * (last - first)[:, group]
    return np.concatenate([smooth, sobol_points(problem.count, seed, 0, half, half)])


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
    sides = [sorted({np.floor(step), np.ceil(step)}) for step in steps]
    if sum(map(len, sides)) > len(sides) + _SIDES:
        sides = [[np.round(step)] for step in steps]
    places = np.array([*itertools.product(*sides)])
    z = (np.where(variables.lengths, places * grid, exact) - variables.lower) / variables.span
    inside = z[(np.abs(z - 0.5) <= 0.5 + 1e-9).all(axis=1)]
    robots = list(filter(None, map(problem.evaluate, inside)))
    if not robots:
        reasons = "; ".join(problem.failures) or "all lie beyond the limits of the variables"
        raise InputError.UNSUPPORTED(
            f"no robot on a grid of {grid:g} mm beside the best one can be made: {reasons}; give a "
            "smaller grid."
        )
    rounded = replace(best, problem=problem, evaluation=min(robots, key=problem.merit))
    return replace(searches, rounded=rounded)
