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
from notchflex.designing.design_robot import given, made_of, problems_of
from notchflex.designing.model.wishes import Wish
from notchflex.designing.result import Design
from notchflex.designing.search.local import search_from
from notchflex.designing.search.problem import (
    TOLERANCE,
    DesignEvaluation,
    DesignProblem,
    Progress,
    Vector,
    objective_reading,
)
from notchflex.designing.search.search import Searches, SearchResult, draw, evaluate_all, smooth
from notchflex.designing.specification import DesignSpec
from notchflex.support import Displayed, Summary, need, short

_MAX_OBJECTIVES = 3
_UNSOLVED = 1e6
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
    asked, first = given(spec, robot)
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
    found: list[tuple[DesignProblem, Vector, DesignEvaluation]] = []
    reason = ""
    try:
        for number, problem in enumerate(problems):
            if progress is not None:
                progress("spreading over the front", number, len(problems))
            found += _spread(problem, points, generations, asked.search.seed)
        chosen = _chosen(found, points)
        polished: list[tuple[DesignProblem, Vector, DesignEvaluation]] = []
        for number, one in enumerate(chosen):
            if progress is not None:
                progress("polishing", number, len(chosen))
            polished.append(_polished(*one, asked.search.iterations))
        found = polished
    except KeyboardInterrupt:
        reason = "interrupted; these are the robots so far"
        found = [one for one in found if one[2].has_slopes] or found[:1]
    best = _chosen([one for one in found if one[2].has_slopes], points)
    if not best:
        raise InputError.UNSUPPORTED("no robot meets all constraints; try `notchflex design` first")
    designs = tuple(_design(asked, first, problems, one) for one in best)
    return DesignFront(asked, designs, reason)


def sums(problem: DesignProblem, one: DesignEvaluation) -> Float[np.ndarray, " m"]:
    """Return what each objective adds to the sum that is minimised."""
    wishes = problem.objectives
    return np.array([float(objective_reading(w, one.point.plain).values.sum()) for w in wishes])


def _spread(
    problem: DesignProblem, points: int, generations: int, seed: int
) -> list[tuple[DesignProblem, Vector, DesignEvaluation]]:
    """Return the front of a genetic search of one form of robots."""
    from pymoo.algorithms.moo.nsga2 import NSGA2
    from pymoo.core.problem import Problem as PymooProblem
    from pymoo.optimize import minimize

    size = 4 * points
    count = len(problem.objectives)
    evaluations = [
        one for _, one in evaluate_all(problem, smooth(problem, size, seed)) if one is not None
    ]
    if evaluations:
        problem.set_sizes(evaluations)
    evaluated: dict[bytes, DesignEvaluation] = {}

    class Batched(PymooProblem):  # pyright: ignore[reportUntypedBaseClass]
        """One batch a generation."""

        def __init__(self) -> None:
            rows = len(problem.rows)
            super().__init__(n_var=problem.count, n_obj=count, n_ieq_constr=rows, xl=0.0, xu=1.0)

        def _evaluate(self, x: np.ndarray, out: dict[str, Any], *_: Any, **__: Any) -> None:
            objectives = np.full((len(x), count), _UNSOLVED)
            violation = np.full((len(x), len(problem.rows)), _UNSOLVED)
            for row, (z, one) in enumerate(evaluate_all(problem, x)):
                if one is not None:
                    evaluated[np.asarray(z).tobytes()] = one
                    objectives[row] = sums(problem, one)
                    violation[row] = np.abs(problem.violation(one)) - 1e-3
            out["F"], out["G"] = objectives, violation

    half = size // 2
    start: Any = np.concatenate(
        [smooth(problem, half, seed), draw(size - half, problem.count, seed)]
    )
    algorithm: Any = NSGA2(pop_size=size, sampling=start)
    result: Any = minimize(Batched(), algorithm, ("n_gen", generations), seed=seed, verbose=False)
    population = result.pop.get("X")
    every = [(problem, z, evaluated[z.tobytes()]) for z in population if z.tobytes() in evaluated]
    return sorted(every, key=lambda one: problem.worst(one[2]))


def _polished(
    problem: DesignProblem, z: Vector, one: DesignEvaluation, iterations: int
) -> tuple[DesignProblem, Vector, DesignEvaluation]:
    """Make the first objective least, the others no worse."""
    wishes = problem.objectives
    values = sums(problem, one)
    limited = [
        (wish, float(value) + 1e-9 * max(1.0, abs(float(value))))
        for wish, value in zip(wishes[1:], values[1:], strict=True)
    ]
    first = replace_problem(problem, wishes[0], limited)
    optimum = search_from(first, z, iterations)
    if optimum.evaluation is None or first.worst(optimum.evaluation) > TOLERANCE:
        return problem, z, one
    whole = problem.evaluate(optimum.z)
    full = None if whole is None else problem.with_slopes(whole, optimum.z)
    return (problem, z, one) if full is None else (problem, optimum.z, full)


def replace_problem(
    problem: DesignProblem, kept: Wish, limited: list[tuple[Wish, float]]
) -> DesignProblem:
    """Return a problem of one objective, with limits on the others."""
    replaced = DesignProblem(problem.solver, (kept, *problem.constraints), tuple(limited))
    sizes = [problem.sizes, np.array([max(abs(most), 1e-12) for _, most in limited])]
    vars(replaced)["sizes"] = np.concatenate(sizes)
    vars(replaced)["total_size"] = problem.total_size
    return replaced


def _chosen(
    candidates: list[tuple[DesignProblem, Vector, DesignEvaluation]], points: int
) -> list[tuple[DesignProblem, Vector, DesignEvaluation]]:
    """Choose points that none of the others beats, spread evenly, by the first objective."""
    feasible = [one for one in candidates if one[0].worst(one[2]) <= max(TOLERANCE, 2e-3)]
    if not feasible:
        return []
    values = np.array([sums(problem, one) for problem, _, one in feasible])
    span = np.ptp(values, axis=0)
    scaled = (values - values.min(axis=0)) / np.where(span > 0.0, span, 1.0)
    best = [
        k
        for k, one in enumerate(scaled)
        if not ((scaled <= one + 1e-12).all(axis=1) & (scaled < one - 1e-9).any(axis=1)).any()
    ]
    kept: list[int] = []
    for k in sorted(best, key=lambda number: tuple(scaled[number])):
        if all(np.abs(scaled[k] - scaled[other]).max() > _APART for other in kept):
            kept.append(k)
    if len(kept) > points:  # evenly along the front
        steps = np.linalg.norm(np.diff(scaled[kept], axis=0), axis=1)
        along = np.concatenate([[0.0], np.cumsum(steps)])
        targets = np.linspace(0.0, along[-1], points)
        kept = [kept[int(np.argmin(np.abs(along - one)))] for one in targets]
        kept = list(dict.fromkeys(kept))
    return [feasible[k] for k in kept]


def _design(
    spec: DesignSpec,
    first: Robot,
    problems: list[DesignProblem],
    one: tuple[DesignProblem, Vector, DesignEvaluation],
) -> Design:
    problem, z, evaluation = one
    from notchflex.designing.search.local import LocalOptimum

    optimum = LocalOptimum(z, evaluation, True, 0)
    outcome = SearchResult(problem, problems.index(problem), z, optimum)
    design = made_of(spec, first, problems, Searches([outcome]))
    return replace(design, explanation=())
