"""The whole search: starts drawn between the limits, one search from each, the best of all."""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
from jaxtyping import Bool, Float
from scipy.optimize import least_squares
from scipy.stats import qmc

from notchflex import InputError, LoadPath, Robot, batch
from notchflex.designing.model.point import Point, Solver
from notchflex.designing.search.local import LocalOptimum, is_followed, search_from, search_on
from notchflex.designing.search.problem import (
    TOLERANCE,
    DesignEvaluation,
    DesignProblem,
    Progress,
    Vector,
)
from notchflex.designing.specification import SearchOptions

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
    arrays, converged = solved(solver, every, [problem.x(vectors[i]) for i in valid], {})
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
    solver: Solver,
    robots: Robot | Sequence[Robot],
    vectors: Sequence[Vector],
    numbers: Mapping[str, np.ndarray],
) -> tuple[dict[str, np.ndarray], Bool[np.ndarray, " robots"]]:
    """Solve robots by batches.

    Args:
        solver: The solver.
        robots: The robots.
        vectors: The vector of each, or one for all, of which the loads are.
        numbers: Numbers of each by name, where they are not those of `robots`.

    Returns:
        Quantities of every step of all robots, and whether all their steps converged.
    """
    paths = solver.paths
    if robots == [] or not paths.pieces:
        return {}, np.ones(len(next(iter(numbers.values()), vectors)), bool)
    same = all(column.load is None for column in solver.variables.columns)
    loads = [solver.path_at(x) for x in (vectors[:1] if same else vectors)]
    pieces: list[dict[str, np.ndarray]] = []
    start = 0
    for length in paths.lengths:
        parts: list[LoadPath] = [path[start : start + length] for path in loads]
        names = solver.outputs
        common = parts[0] if len(parts) == 1 else parts
        pieces.append(dict(batch(robots, numbers, common, outputs=names)))
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


_EVALUATIONS = 60
_INSIDE = 1e-10


def nearest(
    problem: DesignProblem, z: Vector, first: DesignEvaluation
) -> tuple[Vector, DesignEvaluation]:
    """Search for the smallest sum of squares of what constraints are missed by, in their sizes.

    Args:
        problem: The problem.
        z: The start, scaled.
        first: The robot there.

    Returns:
        The best robot met, and its vector.
    """
    span = problem.solver.variables.span
    best = [z, first]
    last: list[Any] = [z, first]

    def at(vector: Vector) -> DesignEvaluation:
        if not np.array_equal(vector, last[0]):
            found = problem.evaluate(vector)
            if found is None:
                return last[1]
            last[:] = [vector.copy(), found]
            if problem.worst(found) < problem.worst(best[1]):  # pyright: ignore
                best[:] = [vector.copy(), found]
        return last[1]

    def residuals(vector: Vector) -> np.ndarray:
        found = at(vector)
        penalty = 0.0 if np.array_equal(vector, last[0]) else 1e3
        return problem.violation(found) + penalty

    def jacobian(vector: Vector) -> np.ndarray:
        found = at(vector)
        full = problem.with_slopes(found, last[0])
        if full is None:
            return np.zeros((len(problem.rows), problem.count))
        found = last[1] = full
        missed = problem.violation(found) != 0.0
        assert found.rows.slopes is not None
        return np.where(missed[:, None], found.rows.slopes * span / problem.sizes[:, None], 0.0)

    if problem.count and problem.rows:
        least_squares(
            residuals,
            np.clip(z, _INSIDE, 1.0 - _INSIDE),
            jacobian,  # pyright: ignore[reportArgumentType]
            (np.zeros(problem.count), np.ones(problem.count)),
            ftol=1e-10,
            xtol=1e-10,
            gtol=1e-12,
            max_nfev=_EVALUATIONS,
        )
    full = problem.with_slopes(best[1], best[0])  # pyright: ignore
    return (z, first) if full is None else (best[0], full)  # pyright: ignore


# Largest violation of a robot from which another search starts.
_MAX_VIOLATION = 1e-3
# Largest difference of scaled variables of equal robots.
_MAX_DIFFERENCE = 1e-3


@dataclass(frozen=True, eq=False)
class SearchResult:
    """Result of one search.

    Attributes:
        problem: Robots of which form.
        number: Number of that form.
        start: Where it began, scaled.
        found: Where it ended.
    """

    problem: DesignProblem
    number: int
    start: Vector
    found: LocalOptimum

    @property
    def merit(self) -> tuple[float, float]:
        """Largest violation, and the sum; less is better."""
        one = self.found.evaluation
        assert one is not None
        worst = self.problem.worst(one)
        return (worst if worst > TOLERANCE else 0.0), one.total


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

    def of(self, number: int) -> list[SearchResult]:
        """Return where the searches of a form ended."""
        return [one for one in self.outcomes if one.number == number]

    def settled(self, number: int) -> list[LocalOptimum]:
        """Return the searches of a form that settled at different robots."""
        optima: list[LocalOptimum] = []
        for one in self.of(number):
            same = any(_same(one.found, other) for other in optima)
            if one.found.stationary and one.found.trajectory and not same:
                optima.append(one.found)
        return optima

    def has_agreed(self, number: int, count: int) -> bool:
        """Return whether nothing is to be gained from further searches of a form.

        So many have settled at the best robot that it has, or a curve is followed.
        """
        best = min(self.of(number), key=lambda one: one.merit, default=None)
        if best is None or best.merit[0] > 0.0:
            return False
        near = [one for one in self.of(number) if _same(one.found, best.found)]
        return sum(one.found.stationary for one in near) >= count or self.has_followed(number)

    def has_followed(self, number: int) -> bool:
        """Whether nothing but curves is asked, and a robot of a form follows all well enough."""
        return any(is_followed(one.problem, one.merit[1]) for one in self.of(number))


def _same(one: LocalOptimum, other: LocalOptimum) -> bool:
    return bool(np.abs(one.z - other.z).max(initial=0.0) < _MAX_DIFFERENCE)


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
    each = max(4, options.candidates // len(problems))
    try:
        for number, problem in enumerate(problems):
            report("ranking robots", number, len(problems))
            for done, z in enumerate(starts(problem, several, each, options.seed)):
                report("searching", number * several + done, several * len(problems))
                settled = searches.settled(number)
                optimum = search_from(problem, z, options.iterations, settled)
                if optimum.evaluation is not None:
                    searches.outcomes.append(SearchResult(problem, number, z, optimum))
                if searches.has_agreed(number, max(2, (several + 1) // 2)):
                    break
            if searches.has_followed(number):
                break
        if searches.outcomes and searches.best.merit[0] > 0.0:
            report("searching what comes nearest", 0, 1)
            _approach(searches, options)
        if searches.outcomes and not searches.best.found.stationary:
            report("searching on", 0, 1)
            best = searches.best
            if best.merit[0] == 0.0:
                optimum = search_on(best.problem, best.found, options.iterations)
                searches.outcomes.append(replace(best, found=optimum))
    except KeyboardInterrupt:
        searches.interrupted = True
        if not searches.outcomes:
            raise
    if not searches.outcomes:
        raise _nothing(problems)
    return searches


def _approach(searches: Searches, options: SearchOptions) -> None:
    """Search what misses least, and from there once more if nothing is missed."""
    ordered = sorted(searches.outcomes, key=lambda one: one.merit)[: max(2, options.starts // 2)]
    for one in ordered:
        evaluation = one.found.evaluation
        assert evaluation is not None
        z, near = nearest(one.problem, one.found.z, evaluation)
        if one.problem.worst(near) <= _MAX_VIOLATION:
            optimum = search_from(one.problem, z, options.iterations)
        else:
            optimum = LocalOptimum(z, near, False, 0)
        if optimum.evaluation is not None:
            searches.outcomes.append(SearchResult(one.problem, one.number, one.start, optimum))
        if searches.best.merit[0] == 0.0:
            return


def _nothing(problems: Sequence[DesignProblem]) -> InputError:
    """Make the error that says why no robot could be solved."""
    reasons: dict[str, int] = {}
    for problem in problems:
        for reason, count in problem.failures.items():
            reasons[reason] = reasons.get(reason, 0) + count
    most = max(reasons, key=lambda one: reasons[one], default="no robot was tried")
    first = most.splitlines()[0]
    return InputError.UNSUPPORTED(
        "no robot between the limits of the variables can be made and solved; most often: "
        f"{first} Change the limits or the loads."
    )
