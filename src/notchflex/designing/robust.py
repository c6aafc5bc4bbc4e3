"""Designs whose limits hold for robots made within tolerances.

A number q whose derivatives by the deviations (each in its standard deviations) are g has the mean
q + g m, with the means m of the deviations, and the standard deviation |g|. A limit holds for a
part of the robots where it is so many standard deviations away from the mean.

The search holds first-order quantiles. How many standard deviations they need is found by counting:
robots are drawn at each design, always at the same levels, until the part that meets the limits is
the one wanted, with the lower end of its 95 % interval.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import NamedTuple

import numpy as np
from jaxtyping import Bool, Float
from scipy.special import log_ndtr, ndtri

from notchflex import ErrorCode, InputError
from notchflex.analysis.closing_loads import closing_tensions_of
from notchflex.designing.problem import (
    ConstraintWish,
    DesignProblem,
    ObjectiveWish,
    Progress,
    Row,
    limits_of,
)
from notchflex.designing.search import Searches, SearchResult, search_from
from notchflex.designing.solver import CLOSING, Point, Reading
from notchflex.designing.specification import DesignSpec, RobustOptions
from notchflex.search.slsqp import TOLERANCE, Vector, violation
from notchflex.support import Tolerance, sources_of
from notchflex.tolerancing import drawn_levels, drawn_numbers, yield_of

# Derivatives of a standard deviation are differences of exact derivatives, over this part of the
# range of each variable.
_STEP = 1e-4
# A number whose standard deviation is less than this part of its limit does not deviate.
_NOTHING = 1e-12
# Searches from the best of the plain ones, and how often their standard deviations are corrected.
_STARTS, _ROUNDS = 2, 6
# The lower end of a yield may exceed its target by this part of the allowed failures.
_ABOVE = 0.1


class Hold(NamedTuple):
    """The part of robots that a constraint must hold for, and the standard deviations for it."""

    part: float
    factor: float


@dataclass(eq=False)
class RobustProblem(DesignProblem):
    """A design whose limits robots made within tolerances must meet.

    Attributes:
        holds: How constraints are to hold, by number; the others hold for the robot of the drawing.
            Where it is empty, the yield is made as great as possible.
    """

    holds: Mapping[int, Hold] = field(default_factory=dict[int, Hold])

    @cached_property
    def objectives(self) -> list[ObjectiveWish]:
        """The objectives; none where the yield is made as great as possible."""
        return super().objectives if self.holds else []

    @cached_property
    def rows(self) -> list[Row]:
        """Every limit: of one number, or of its quantile."""
        return [row for row, *_ in self._quantiles]

    @cached_property
    def _quantiles(self) -> list[tuple[Row, int, tuple[float, float, float]]]:
        """The rows, where their numbers stand in the rows of the drawing, and three weights.

        These are of that number, of the shift of its mean and of its standard deviation.
        """
        quantiles: list[tuple[Row, int, tuple[float, float, float]]] = []
        for place, (number, row) in enumerate(self._plain):
            if number not in self.holds:
                quantiles.append((row, place, (1.0, 0.0, 0.0)))
                continue
            part, factor = self.holds[number]
            label = f"{row.label}, " * bool(row.label) + f"for {100.0 * part:g} % of the robots"
            for side, limit in _sides(row):
                low, high = (-np.inf, limit) if side > 0.0 else (limit, np.inf)
                held = Row(row.wish, label, low, high)
                quantiles.append((held, place, (1.0, 1.0, side * factor)))
        return quantiles

    @cached_property
    def _plain(self) -> list[tuple[int, Row]]:
        """The rows for the robot of the drawing, with the numbers of their constraints."""
        return [(k, row) for k, wish in enumerate(self.constraints) for row in wish.rows]

    def _row_numbers(self, point: Point) -> Iterable[Reading]:
        if not self.holds:
            return super()._row_numbers(point)
        moments, (_, places, weights) = self._moments(point), zip(*self._quantiles, strict=True)
        return [np.einsum("mk,kmv->mv", weights, moments[:, places])]

    def _terms(self, point: Point, z: Vector) -> tuple[list[Reading], float]:
        if self.holds:
            return super()._terms(point, z)
        missing = self._missing(point)
        return [missing], float(missing[0, 0])

    def _missing(self, point: Point) -> Reading:
        """Logarithm of the sum of the parts of robots that miss each limit: all that can miss."""
        numbers, shift, sd = self._moments(point)
        mean, counted = numbers + shift, set(limited(self))
        distances = [np.zeros((0, 1 + self.count))]
        for place, (number, row) in enumerate(self._plain):
            for side, limit in _sides(row) if number in counted else ():
                if sd[place, 0] > _NOTHING * abs(limit):
                    distance = side * (limit - mean[place, 0]) / sd[place, 0]
                    by = -side * mean[place, 1:] - distance * sd[place, 1:]
                    distances.append(np.append(distance, by / sd[place, 0])[None])
        table = np.concatenate(distances)
        beta = table[:, 0]
        total = float(np.logaddexp.reduce(log_ndtr(-beta))) if len(beta) else 0.0
        density = np.exp(-0.5 * beta**2 - 0.5 * np.log(2.0 * np.pi) - total)
        return np.append(total, -density @ table[:, 1:])[None]

    def _moments(self, point: Point) -> Float[np.ndarray, "3 m 1+v"]:
        """Numbers of the drawing, shifts of their means and standard deviations, with slopes."""
        numbers, spread = self._spread(point)
        z = (point.x - self.solver.variables.lower) / self.solver.variables.span
        slopes: list[np.ndarray] = []
        for unit, inward in zip(np.eye(len(z)), np.where(z < 0.5, _STEP, -_STEP), strict=True):
            _, moved = self._spread(self.solver.point(self.x(z + inward * unit)))
            slopes.append((moved - spread) / inward)
        return np.concatenate([numbers[None], np.stack([spread, *slopes], axis=-1)])

    def _spread(self, point: Point) -> tuple[np.ndarray, Float[np.ndarray, "2 m"]]:
        """Numbers of the drawing, and shifts of their means and standard deviations."""
        deviations = self.solver.variables.deviations(point.robot)
        table = np.concatenate([wish.row_numbers(point) for wish in self.constraints])
        numbers, by = np.split(table, [1 + self.count], axis=1)
        mean = by @ np.array([deviation.mean for deviation in deviations])
        return numbers, np.stack([mean, np.linalg.norm(by, axis=1)])


def limited(problem: DesignProblem) -> list[int]:
    """Return the numbers of the constraints that have limits, not a value."""
    numbers = range(len(problem.constraints))
    return [k for k in numbers if all(row.lower < row.upper for row in problem.constraints[k].rows)]


def _sides(row: Row) -> list[tuple[float, float]]:
    """Return the limits of a row: 1 with its greatest value, -1 with the least."""
    return [side for side in ((1.0, row.upper), (-1.0, row.lower)) if np.isfinite(side[1])]


def check_limits(problems: Sequence[DesignProblem], tolerances: Sequence[Tolerance]) -> None:
    """Raise if there is nothing to make robust.

    Raises:
        InputError: No constraint has a limit, or nothing deviates.
    """
    if not any(map(limited, problems)):
        raise InputError.MISSING_VALUE(
            "a robust design needs a [[constraint]] with a limit: no robot made within tolerances "
            "has exactly one value; give `lower` or `upper`."
        )
    variables = replace(problems[0].solver.variables, tolerances=tuple(tolerances))
    if not any(any(one.sd.values()) for one in variables.deviations(variables.robot)):
        raise InputError.NO_DATA("nothing deviates: all tolerances are 0; give one that is not.")


def met_by(
    result: SearchResult,
    tolerances: Sequence[Tolerance],
    levels: Float[np.ndarray, "draws d"],
    wishes: Sequence[ConstraintWish],
) -> Bool[np.ndarray, "draws k"]:
    """Solve robots within tolerances, and return which meet which constraints.

    Args:
        result: The robot of the drawing.
        tolerances: What deviates.
        levels: Levels of what deviates, each between 0 and 1.
        wishes: The constraints.

    Returns:
        Whether each robot meets each of these constraints; no robot that cannot be made or solved
        meets any.
    """
    solver, x = result.problem.solver, result.evaluation.point.x
    exact = result.evaluation.point.robot.replace(tolerance=None)
    numbers = drawn_numbers(sources_of(exact, tolerances), levels)
    met = np.zeros((len(levels), len(wishes)), bool)
    try:
        arrays, converged = solver.rows(exact, [x], numbers)
    except InputError as error:
        if error.code is not ErrorCode.INVALID_ROBOT:
            raise
        return met
    valid = np.flatnonzero(converged)
    closed: Sequence[np.ndarray | None] = [None] * len(valid)
    if any(wish.asked.quantity == CLOSING for wish in wishes):
        closed = [*closing_tensions_of(exact, {name: row[valid] for name, row in numbers.items()})]
    # What only states and closings are asked of is read without the robot.
    of_robot = any(
        wish.curve is not None or (wish.asked.load is None and wish.asked.quantity != CLOSING)
        for wish in wishes
    )
    for row, tension in zip(valid.tolist(), closed, strict=True):
        try:
            values = {name: float(column[row]) for name, column in numbers.items()}
            robot = exact.with_values(values) if of_robot else exact
        except InputError:  # numbers that make no robot
            continue
        states = {name: array[row] for name, array in arrays.items()}
        point = Point(x, robot, solver.steps, states, closed=tension)
        for number, wish in enumerate(wishes):
            sizes = np.array([one.size or 1.0 for one in wish.rows])
            missed = violation(wish.row_numbers(point)[:, 0], limits_of(wish.rows), sizes)
            met[row, number] = (np.abs(missed) <= TOLERANCE).all()  # not where a value is NaN
    return met


@dataclass(frozen=True)
class YieldOf:
    """Which part of robots made within tolerances meets a limit, or all of them.

    Attributes:
        title: The constraint; "all limits" for all together.
        wanted: The part that is wanted; None where it is maximised or only reported.
        achieved: The part of the robots drawn of the design.
        interval: Its 95 % interval.
        plain: The same part of the design without regard to tolerances.
    """

    title: str
    wanted: float | None
    achieved: float
    interval: tuple[float, float]
    plain: float

    @property
    def met(self) -> bool:
        """Whether the part that is wanted is reached."""
        return self.wanted is None or self.achieved >= self.wanted

    @property
    def sentence(self) -> str:
        """It and its interval in words."""
        parts = self.achieved, *self.interval, self.plain
        achieved, low, high, plain = (f"{100.0 * part:.4g}" for part in parts)
        target = "" if self.wanted is None else f", wanted {100.0 * self.wanted:.4g} %"
        meets = "meet" if self.title == "all limits" else "meet the limit of"
        return (
            f"{achieved} % of the robots made within the tolerances {meets} {self.title} "
            f"({low} to {high} %{target}); without regard to tolerances {plain} %."
        )


class _Target(NamedTuple):
    """The yield of several constraints together, by their columns, and the part that is wanted."""

    title: str
    wanted: float | None
    columns: list[int]


class _Counted(NamedTuple):
    """A design, and which drawn robots of it meet which limits."""

    result: SearchResult
    met: Bool[np.ndarray, "draws k"]

    def part(self, target: _Target) -> tuple[float, tuple[float, float]]:
        """Return which part meets all of some constraints, and its 95 % interval."""
        return yield_of(np.asarray(self.met[:, target.columns].all(axis=1)))

    def lack(self, targets: Sequence[_Target]) -> float:
        """Return by how much the lower ends of the yields miss what is wanted, in all."""
        return sum(max((one.wanted or 0.0) - self.part(one)[1][0], 0.0) for one in targets)


def robust_search(
    spec: DesignSpec,
    tolerances: Sequence[Tolerance],
    plain: Searches,
    progress: Progress | None,
    place: Callable[[Searches], Searches],
) -> tuple[Searches, tuple[YieldOf, ...]]:
    """Search on from plain designs.

    Args:
        spec: The specification.
        tolerances: Within what robots are made.
        plain: The plain searches.
        progress: Called with what is done.
        place: Places the robot that was found on a grid.

    Returns:
        The searches of the robust design, and the yields: of all limits together, and of every
        constraint with limits; no yields if Ctrl-C ended it before any was counted.
    """
    options, numbers = spec.robust or RobustOptions(), limited(plain.best.problem)
    wishes = [plain.best.problem.constraints[number] for number in numbers]
    of_all = _Target("all limits", options.wanted_yield, list(range(len(wishes))))
    single = [_Target(wish.title, wish.asked.wanted_yield, [k]) for k, wish in enumerate(wishes)]
    targets = [target for target in (*single, of_all) if target.wanted is not None]
    sources = sources_of(plain.best.problem.solver.variables.robot, tolerances)
    levels = drawn_levels(len(sources), options.draws, options.seed)
    designs: list[_Counted] = []

    def count(results: Iterable[SearchResult]) -> list[_Counted]:
        counted = [_Counted(one, met_by(one, tolerances, levels, wishes)) for one in results]
        designs.extend(counted)
        return counted

    def search_on(results: Sequence[SearchResult], holds: Mapping[int, Hold]) -> list[_Counted]:
        ends = [_robust(one, tolerances, holds, spec.search.iterations) for one in results]
        return count(end for several in ends for end in several)

    def rank(design: _Counted) -> tuple[float, float]:
        """Return what makes a design worse: first what it misses, then the sum."""
        missed, total = design.result.merit
        if targets:
            return design.lack(targets), total
        return missed, -design.part(of_all)[0]

    starts = sorted(plain.outcomes, key=lambda end: end.merit)[:_STARTS]
    factors, interrupted = [float(ndtri(one.wanted)) for one in targets], plain.interrupted
    try:
        count([plain.best])
        for done in range(0 if interrupted else _ROUNDS):
            if progress is not None:
                progress("making it robust", done, _ROUNDS)
            found = search_on(starts, _holds(targets, factors, numbers))
            if not found:
                break
            last = min(found, key=lambda design: design.result.merit)
            starts, before = [last.result], factors
            factors = [_corrected(*pair, last) for pair in zip(targets, factors, strict=True)]
            if factors == before:
                break
        best = min(designs, key=rank)
        if not interrupted and best.lack(targets) > 0.0:  # the greatest yield comes nearest
            search_on([best.result, plain.best], {})
    except KeyboardInterrupt:
        interrupted = True
        if not designs:
            return Searches([plain.best], True), ()
    searches = place(Searches([min(designs, key=rank).result], interrupted))
    (best,) = count([searches.rounded]) if searches.rounded else [min(designs, key=rank)]
    return searches, tuple(
        YieldOf(one.title, one.wanted, *best.part(one), designs[0].part(one)[0])
        for one in (of_all, *single)
    )


def _holds(
    targets: Sequence[_Target], factors: Sequence[float], numbers: Sequence[int]
) -> dict[int, Hold]:
    """Return how every constraint is to hold: by the largest factor of those that it needs."""
    holds: dict[int, Hold] = {}
    for target, factor in sorted(zip(targets, factors, strict=True), key=lambda pair: pair[1]):
        holds |= {numbers[column]: Hold(target.wanted or 0.0, factor) for column in target.columns}
    return holds


def _corrected(target: _Target, factor: float, design: _Counted) -> float:
    """Return a factor moved by what a counted yield lacks, or has more than is wanted."""
    wanted, low = target.wanted or 0.0, design.part(target)[1][0]
    if wanted <= low <= wanted + _ABOVE * (1.0 - wanted):
        return factor
    edge = 0.5 / len(design.met)
    aim = wanted + 0.5 * _ABOVE * (1.0 - wanted)
    return max(factor + float(ndtri(aim) - ndtri(np.clip(low, edge, 1.0 - edge))), 0.0)


def _robust(
    start: SearchResult, tolerances: Sequence[Tolerance], holds: Mapping[int, Hold], iterations: int
) -> list[SearchResult]:
    """Search from the end of another search, if that can be solved."""
    solver = start.problem.solver
    variables = replace(solver.variables, tolerances=tuple(tolerances))
    problem = RobustProblem(replace(solver, variables=variables), start.problem.wishes, holds=holds)
    first = problem.evaluate(start.evaluation.z)
    if first is None:
        return []
    problem.set_sizes([first])
    return search_from(problem, first, iterations)
