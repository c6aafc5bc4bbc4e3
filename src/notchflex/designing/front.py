"""Fronts between objectives: robots of which none is better in one without being worse in another.

A genetic search (NSGA-II of pymoo, one batch a generation) spreads over the front; every point is
then polished by SLSQP: the first objective least, the others no worse.
"""

from __future__ import annotations

import os
from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from jaxtyping import Float

from notchflex import InputError, Robot
from notchflex.designing.design_robot import made_of, problems_of, specification_of
from notchflex.designing.problem import (
    DesignEvaluation,
    DesignProblem,
    Progress,
    objective_reading,
)
from notchflex.designing.result import Design
from notchflex.designing.search import Searches, SearchResult, drawn_robots
from notchflex.designing.specification import DesignSpec
from notchflex.search.slsqp import TOLERANCE, minimise
from notchflex.support import Displayed, Summary, need, short

_MAX_OBJECTIVES = 3
# Objectives and violations of a robot that cannot be solved.
_UNSOLVED = 1e6
# Largest violation of a robot of the genetic search that is polished.
_NEARLY = 1e-3
# A point is kept beside another if it differs by this part of the range of an objective.
_APART = 1e-3


@dataclass(frozen=True, eq=False, repr=False)
class DesignFront(Displayed):
    """Designs of which none is better in one objective without being worse in another.

    Attributes:
        spec: What was asked.
        points: The designs, by the first objective.
        reason: Why the search ended early, "" if it did not.
    """

    spec: DesignSpec
    points: tuple[Design, ...]
    reason: str

    @property
    def objectives(self) -> Float[np.ndarray, "points objectives"]:
        """Values of the objectives, in their units."""
        count = len(self.spec.objective)
        rows = [[one.achieved[0] for one in point.wishes[:count]] for point in self.points]
        return np.array(rows).reshape(-1, count)

    @property
    def titles(self) -> tuple[str, ...]:
        """Names of the objectives, with units."""
        wishes = self.points[0].wishes[: len(self.spec.objective)]
        return tuple(f"{one.title} [{one.unit}]" if one.unit else one.title for one in wishes)

    def save(self, folder: str | os.PathLike[str]) -> tuple[Path, ...]:
        """Write a robot file for every point, the table and the picture into a folder.

        Raises:
            InputError: A file cannot be written.
        """
        from notchflex.designing.result import write_front

        return write_front(self, folder)

    def _summary(self) -> Summary:
        rows = [
            (f"point {number}", ", ".join(short(value) for value in values))
            for number, values in enumerate(self.objectives.tolist(), start=1)
        ]
        return Summary(f"Front of {len(self.points)} designs: {', '.join(self.titles)}", rows)


def design_front(
    spec: DesignSpec | Mapping[str, Any] | str | os.PathLike[str],
    *,
    robot: Robot | None = None,
    points: int = 12,
    generations: int = 20,
    progress: Progress | None = None,
) -> DesignFront:
    """Find the front between two or three objectives of a design.

    Args:
        spec: As for `design`.
        robot: As for `design`.
        points: Most points of the front.
        generations: Generations of the genetic search, each of four times as many robots.
        progress: Called with the stage, what is done of it and how much there is.

    Returns:
        The front; every point is a `Design`.

    Raises:
        InputError: Not two or three objectives, pymoo is not installed, or as for `design`.
    """
    need("pymoo", "design", "a front between objectives")
    asked, first = specification_of(spec, robot)
    if not 2 <= len(asked.objective) <= _MAX_OBJECTIVES or asked.curve:
        raise InputError.UNSUPPORTED(
            f"a front needs 2 or {_MAX_OBJECTIVES} objectives, and curves as one of them; got "
            f"{len(asked.objective)}"
        )
    if asked.is_robust:
        raise InputError.UNSUPPORTED(
            "a front is of robots as drawn: leave out `robust` and `wanted_yield`, then name the "
            "point that you choose as `robot` of the design file and make that one robust."
        )
    if points < 2 or generations < 1:
        raise InputError.OUT_OF_RANGE("a front needs 2 points and 1 generation or more")
    problems = problems_of(asked, first)
    report: Progress = progress or (lambda stage, done, total: None)
    spread: list[SearchResult] = []
    polished: list[SearchResult] = []
    reason = ""
    try:
        for number, problem in enumerate(problems):
            report("spreading over the front", number, len(problems))
            spread += _spread(problem, points, generations, asked.search.seed)
        chosen = _chosen(spread, points)
        for number, one in enumerate(chosen):
            report("polishing", number, len(chosen))
            polished += _polished(one, asked.search.iterations)
    except KeyboardInterrupt:
        reason = "interrupted; these are the robots so far"
    best = _chosen(polished, points)
    if not best:
        raise InputError.UNSUPPORTED("no robot meets all constraints; try `notchflex design` first")
    designs = (made_of(asked, first, problems, Searches([one])) for one in best)
    return DesignFront(asked, tuple(replace(one, explanation=()) for one in designs), reason)


def sums(problem: DesignProblem, one: DesignEvaluation) -> Float[np.ndarray, " m"]:
    """Return what each objective adds to the sum that is minimised."""
    return np.array([objective_reading(w, one.point).values[0] for w in problem.objectives])


def _spread(problem: DesignProblem, points: int, generations: int, seed: int) -> list[SearchResult]:
    """Return the last generation of a genetic search of one form of robots."""
    from pymoo.algorithms.moo.nsga2 import NSGA2
    from pymoo.core.problem import Problem as PymooProblem
    from pymoo.optimize import minimize

    size = 4 * points
    start: Any = drawn_robots(problem, size, seed)
    problem.set_sizes([one for one in problem.evaluate_all(start) if one is not None])

    class Batched(PymooProblem):  # pyright: ignore[reportUntypedBaseClass]
        """One batch a generation."""

        def __init__(self) -> None:
            objectives, rows = len(problem.objectives), len(problem.rows)
            super().__init__(problem.count, objectives, n_ieq_constr=rows, xl=0.0, xu=1.0)

        def _evaluate(self, x: np.ndarray, out: dict[str, Any], *_: Any, **__: Any) -> None:
            robots = problem.evaluate_all(x)
            out["F"] = np.full((len(x), len(problem.objectives)), _UNSOLVED)
            out["G"] = np.full((len(x), len(problem.rows)), _UNSOLVED)
            out["robot"] = np.array(robots, object)
            for row, robot in enumerate(robots):
                if robot is not None:
                    out["F"][row] = sums(problem, robot)
                    out["G"][row] = np.abs(problem.violation(robot)) - _NEARLY

    algorithm: Any = NSGA2(pop_size=size, sampling=start)
    result: Any = minimize(Batched(), algorithm, ("n_gen", generations), seed=seed, verbose=False)
    robots = result.pop.get("robot")
    return [SearchResult(problem, robot) for robot in robots if robot is not None]


def _polished(one: SearchResult, iterations: int) -> list[SearchResult]:
    """Make the first objective least, the others no worse; none where no constraints are met."""
    problem, wishes = one.problem, one.problem.objectives
    most = sums(problem, one.evaluation)
    most += 1e-9 * np.maximum(np.abs(most), 1.0)
    caps = tuple(zip(wishes[1:], most[1:].tolist(), strict=True))
    capped = replace(problem, wishes=(wishes[0], *problem.constraints), caps=caps)
    capped.sizes[: len(problem.sizes)] = problem.sizes
    first = capped.read(one.evaluation.point, one.evaluation.z)
    found = minimise(*capped.program(first), iterations)
    if found is None or capped.worst(found.reached.source) > TOLERANCE:
        return []
    end: DesignEvaluation = found.reached.source
    settled = found._replace(is_stationary=True)
    return [replace(one, evaluation=problem.read(end.point, end.z), minimum=settled)]


def _chosen(candidates: list[SearchResult], points: int) -> list[SearchResult]:
    """Choose points that none of the others beats, spread evenly, by the first objective."""
    from pymoo.util.nds.non_dominated_sorting import NonDominatedSorting

    feasible = [one for one in candidates if one.merit[0] <= 2.0 * _NEARLY]
    if not feasible:
        return []
    values = np.array([sums(one.problem, one.evaluation) for one in feasible])
    span = np.ptp(values, axis=0)
    scaled = (values - values.min(axis=0)) / np.where(span > 0.0, span, 1.0)
    # By the first objective, each of those that are nearly alike once.
    _, apart = np.unique(np.round(scaled / _APART), axis=0, return_index=True)
    best = NonDominatedSorting().do(scaled[apart], only_non_dominated_front=True)
    kept = apart[np.sort(best)]
    spread = np.linspace(0, len(kept) - 1, min(points, len(kept)))
    return [feasible[number] for number in kept[spread.round().astype(int)]]
