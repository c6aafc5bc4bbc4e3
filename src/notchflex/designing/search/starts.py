"""Where searches start: robots drawn between the limits, ranked by one batch."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float
from scipy.stats import qmc

from notchflex.analysis.batch import simulate_batch
from notchflex.designing.model.point import Point, Solver
from notchflex.designing.search.problem import Evaluation, Problem, Vector
from notchflex.errors import InputError
from notchflex.loads import LoadPath
from notchflex.robot import Robot

_NUMBER = re.compile(r"\[\d+\]")
# What a limit that is missed by its own size weighs against the spread of the sums.
_WEIGHT = 10.0
# Starts lie this far from each other, in parts of the whole diagonal.
_APART = 0.1


@dataclass(frozen=True, eq=False)
class Candidate:
    """A robot that a search may start from."""

    z: Vector
    evaluation: Evaluation


def draw(count: int, variables: int, seed: int) -> Float[np.ndarray, "count variables"]:
    """Return vectors between 0 and 1 of Sobol's sequence."""
    if variables == 0:
        return np.zeros((1, 0))
    power = int(np.ceil(np.log2(max(count, 2))))
    sobol = qmc.Sobol(variables, rng=np.random.default_rng(seed))
    return sobol.random_base2(power)[:count]


def smooth(problem: Problem, count: int, seed: int) -> Float[np.ndarray, "count variables"]:
    """Return vectors whose values run straight along the tube where each notch has its own.

    Good designs are smooth, and among many values drawn one by one none is.
    """
    groups: dict[str, list[int]] = {}
    for number, column in enumerate(problem.solver.variables.columns):
        groups.setdefault(_NUMBER.sub("", column.name), []).append(number)
    ends = draw(count, 2 * len(groups), seed)
    vectors = np.zeros((len(ends), problem.count))
    for k, columns in enumerate(groups.values()):
        first, last = ends[:, 2 * k, None], ends[:, 2 * k + 1, None]
        # Every second has nearly one value.
        last = np.where(np.arange(len(ends))[:, None] % 2, last, first + 0.1 * (last - first))
        vectors[:, columns] = first + np.linspace(0.0, 1.0, len(columns)) * (last - first)
    return vectors


def evaluate_all(
    problem: Problem, vectors: Float[np.ndarray, "k v"]
) -> list[tuple[Vector, Evaluation | None]]:
    """Evaluate many vectors by batches, without derivatives."""
    solver = problem.solver
    robots: list[Robot | None] = []
    for z in vectors:
        try:
            robots.append(solver.variables.robot_at(problem.x(z)))
        except InputError as error:
            problem.failures[str(error)] = problem.failures.get(str(error), 0) + 1
            robots.append(None)
    good = [number for number, robot in enumerate(robots) if robot is not None]
    every = [robot for robot in robots if robot is not None]
    arrays, converged = solved(solver, every, [problem.x(vectors[i]) for i in good])
    solver.counts["solves"] += len(good)
    found: list[tuple[Vector, Evaluation | None]] = [(z, None) for z in vectors]
    for row, number in enumerate(good):
        robot = robots[number]
        if robot is None or not converged[row]:
            continue
        own = {name: values[row] for name, values in arrays.items()}
        point = Point(solver.variables, problem.x(vectors[number]), robot, solver.paths, own)
        try:
            found[number] = vectors[number], problem.read(point, vectors[number])
        except InputError as error:
            problem.failures[str(error)] = problem.failures.get(str(error), 0) + 1
    return found


def solved(
    solver: Solver, robots: Sequence[Robot], vectors: Sequence[Vector]
) -> tuple[dict[str, np.ndarray], Bool[np.ndarray, " robots"]]:
    """Solve robots by batches.

    Args:
        solver: The solver.
        robots: The robots.
        vectors: The vector of each, or one for all, of which the loads are.

    Returns:
        Quantities of every step of all robots, and whether all their steps converged.
    """
    paths = solver.paths
    if not len(robots) or not paths.pieces:
        return {}, np.ones(len(robots), bool)
    same = all(column.load is None for column in solver.variables.columns)
    loads = [solver.path_at(x) for x in (vectors[:1] if same else vectors)]
    pieces: list[dict[str, np.ndarray]] = []
    start = 0
    for length in paths.lengths:
        parts: list[LoadPath] = [one.part(start, length) for one in loads]
        names = (*solver.outputs, "converged")
        common = parts[0] if len(parts) == 1 else parts
        pieces.append(dict(simulate_batch(robots, common, outputs=names)))
        start += length
    joined = {name: np.concatenate([one[name] for one in pieces], axis=1) for name in pieces[0]}
    return joined, np.asarray(joined["converged"].all(axis=1))


def ranked(problem: Problem, found: Sequence[Candidate]) -> list[Candidate]:
    """Sort candidates: first those that miss least and whose sum is least."""
    if not found:
        return []
    totals = np.array([one.evaluation.total for one in found])
    spread = float(np.quantile(totals, 0.75) - np.quantile(totals, 0.25)) or 1.0
    missed = np.array(
        [np.minimum(np.abs(problem.violation(one.evaluation)), 1.0).sum() for one in found]
    )
    merit = (totals - totals.min()) / spread + _WEIGHT * missed
    return [found[number] for number in np.argsort(merit, kind="stable")]


def spread_out(candidates: Sequence[Candidate], count: int) -> list[Candidate]:
    """Choose the best candidates that are not too near to each other."""
    chosen: list[Candidate] = []
    rest: list[Candidate] = []
    for one in candidates:
        apart = _APART * np.sqrt(max(len(one.z), 1))
        near = any(np.linalg.norm(one.z - other.z) < apart for other in chosen)
        (rest if near else chosen).append(one)
        if len(chosen) == count:
            return chosen
    return [*chosen, *rest][:count]
