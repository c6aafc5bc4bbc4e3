"""Starting points of searches: robots drawn between the limits, ranked by one batch."""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float
from scipy.stats import qmc

from notchflex.analysis.batch import simulate_batch
from notchflex.designing.model.point import Point
from notchflex.designing.model.solver import Solver
from notchflex.designing.search.problem import DesignEvaluation, DesignProblem, Vector
from notchflex.errors import InputError
from notchflex.loads import LoadPath
from notchflex.robot import Robot

_NUMBER = re.compile(r"\[\d+\]")
# Penalty on a violation of one size, relative to the spread of the sums.
_WEIGHT = 10.0
# Number of robots drawn before the first search; at least two for every variable.
_FEW = 8
# Smallest distance between starts, relative to the diagonal of the box.
_APART = 0.1


@dataclass(frozen=True, eq=False)
class StartingPoint:
    """A robot that a search may start from."""

    z: Vector
    evaluation: DesignEvaluation


def draw(count: int, variables: int, seed: int) -> Float[np.ndarray, "count variables"]:
    """Return vectors between 0 and 1 of Sobol's sequence."""
    if variables == 0:
        return np.zeros((1, 0))
    power = int(np.ceil(np.log2(max(count, 2))))
    sobol = qmc.Sobol(variables, rng=np.random.default_rng(seed))
    return sobol.random_base2(power)[:count]


def smooth(problem: DesignProblem, count: int, seed: int) -> Float[np.ndarray, "count variables"]:
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


def starts(problem: DesignProblem, several: int, most: int, seed: int) -> Iterator[Vector]:
    """Yield starts, far from each other, the most promising first.

    The first two are chosen from the robot as it is and a few drawn ones, by one batch. The others
    are drawn when they are asked for: where the first two searches agree they are not needed.

    Args:
        problem: The problem.
        several: Most starts.
        most: Most robots that are drawn.
        seed: Seed of the draws.
    """
    initial = problem.start
    own = problem.evaluate(initial)
    candidates = [] if own is None else [StartingPoint(initial, own)]
    if several == 1 and own is not None:
        problem.set_sizes([own])
        yield initial
        return
    few = min(most, max(_FEW, 2 * problem.count))
    half = max(1, most // 2)
    drawn = np.stack([smooth(problem, half, seed), draw(half, problem.count, seed)], axis=1)
    drawn = drawn.reshape(-1, problem.count)  # either kind in turn
    used: list[StartingPoint] = []
    for part, count in ((drawn[:few], min(2, several)), (drawn[few:], several)):
        more = [StartingPoint(z, one) for z, one in evaluate_all(problem, part) if one is not None]
        candidates += more
        if candidates and not used:
            problem.set_sizes([one.evaluation for one in candidates])
        must = candidates[:1] if own is not None and not used else []
        order = [one for one in ranked(problem, candidates) if one not in (*must, *used)]
        chosen = spread_out(order, count, [*must, *used])[len(used) :]
        used += chosen
        yield from (one.z for one in ranked(problem, chosen))


def evaluate_all(
    problem: DesignProblem, vectors: Float[np.ndarray, "k v"]
) -> list[tuple[Vector, DesignEvaluation | None]]:
    """Evaluate many vectors by batches, without derivatives."""
    solver = problem.solver
    robots: list[Robot | None] = []
    for z in vectors:
        try:
            robots.append(solver.variables.robot_at(problem.x(z)))
        except InputError as error:
            problem.failures[str(error)] = problem.failures.get(str(error), 0) + 1
            robots.append(None)
    valid = [number for number, robot in enumerate(robots) if robot is not None]
    every = [robot for robot in robots if robot is not None]
    arrays, converged = solved(solver, every, [problem.x(vectors[i]) for i in valid])
    solver.counts["solves"] += len(valid)
    evaluations: list[tuple[Vector, DesignEvaluation | None]] = [(z, None) for z in vectors]
    for row, number in enumerate(valid):
        robot = robots[number]
        if robot is None or not converged[row]:
            continue
        own = {name: values[row] for name, values in arrays.items()}
        point = Point(solver.variables, problem.x(vectors[number]), robot, solver.paths, own)
        try:
            evaluations[number] = vectors[number], problem.read(point, vectors[number])
        except InputError as error:
            problem.failures[str(error)] = problem.failures.get(str(error), 0) + 1
    return evaluations


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


def ranked(problem: DesignProblem, candidates: Sequence[StartingPoint]) -> list[StartingPoint]:
    """Sort candidates by penalised objective: the sum plus a penalty on violated limits."""
    if not candidates:
        return []
    totals = np.array([one.evaluation.total for one in candidates])
    spread = float(np.quantile(totals, 0.75) - np.quantile(totals, 0.25)) or 1.0
    violation = np.array(
        [np.minimum(np.abs(problem.violation(one.evaluation)), 1.0).sum() for one in candidates]
    )
    penalised_objective = (totals - totals.min()) / spread + _WEIGHT * violation
    return [candidates[number] for number in np.argsort(penalised_objective, kind="stable")]


def spread_out(
    candidates: Sequence[StartingPoint], count: int, chosen: Sequence[StartingPoint]
) -> list[StartingPoint]:
    """Add to chosen candidates the best that are not too near to them and to each other."""
    selected, rest = list(chosen), []
    for one in candidates:
        apart = _APART * np.sqrt(max(len(one.z), 1))
        near = any(np.linalg.norm(one.z - other.z) < apart for other in selected)
        (rest if near else selected).append(one)
        if len(selected) >= count:
            break
    return [*selected, *rest][: max(count, len(chosen))]
