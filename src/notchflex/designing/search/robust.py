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

import numpy as np
from jaxtyping import Bool, Float
from scipy.special import log_ndtr, ndtri

from notchflex import ErrorCode, InputError, Robot
from notchflex.analysis.closing_loads import closing_tensions_of
from notchflex.analysis.draws import sources_of, values_at
from notchflex.designing.model.point import CLOSINGS, Point
from notchflex.designing.model.quantities import CLOSING, Reading
from notchflex.designing.model.variables import deviations_of
from notchflex.designing.model.wishes import Wish
from notchflex.designing.search.local import LocalOptimum, search_from
from notchflex.designing.search.problem import (
    TOLERANCE,
    DesignProblem,
    EpigraphBound,
    Progress,
    Row,
    Vector,
    row_reading,
    row_sizes,
    rows_of,
    violations,
)
from notchflex.designing.search.search import Searches, SearchResult, solved
from notchflex.designing.specification import DesignConstraint, DesignSpec, RobustOptions
from notchflex.support import Tolerance
from notchflex.tolerancing import (
    REPLICATES,
    TAIL,
    points_of_each,
    replicates,
    yield_interval,
)

# Derivatives of a standard deviation are differences of exact derivatives, over this part of the
# range of each variable.
_STEP = 1e-4
# A number whose standard deviation is less than this part of its limit does not deviate.
_NOTHING = 1e-12


@dataclass(frozen=True)
class Hold:
    """Yield and factor that a constraint must hold with.

    Attributes:
        part: The part of robots that is wanted.
        factor: Standard deviations between mean and limit.
    """

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
    def objectives(self) -> tuple[Wish, ...]:
        """The objectives; none where the yield is made as great as possible."""
        return super().objectives if self.holds else ()

    @cached_property
    def bounds(self) -> tuple[EpigraphBound, ...]:
        """The further variables."""
        return super().bounds if self.holds else ()

    @cached_property
    def rows(self) -> tuple[Row, ...]:
        """Every limit: of one number, or of its quantile."""
        rows: list[Row] = []
        for number, wish in enumerate(self.constraints):
            plain, hold = rows_of(wish), self.holds.get(number)
            if hold is None:
                rows += plain
                continue
            of = f"for {100.0 * hold.part:g} % of the robots"
            for _, row, side in _sides(plain):
                label = f"{row.label}, {of}" if row.label else of
                low, high = (-np.inf, row.upper) if side > 0.0 else (row.lower, np.inf)
                rows.append(Row(wish, label, low, high))
        return tuple(rows)

    def _solved(self, z: Vector) -> Point:
        point = super()._solved(z)
        self._spread(point)  # needs derivatives, and is asked of points without
        return point

    def _row_readings(self, point: Point) -> list[Reading]:
        readings: list[Reading] = []
        for number, wish in enumerate(self.constraints):
            reading = self._joined([row_reading(wish, point)])
            hold = self.holds.get(number)
            if hold is None:
                readings.append(reading)
                continue
            shift, sd = self._deviates(point, number)
            for at, _, side in _sides(rows_of(wish)):
                one = reading.pick(np.array([at]))
                more = (
                    shift.pick(np.array([at])),
                    sd.pick(np.array([at])).scaled(side * hold.factor),
                )
                readings.append(_added(one, *more))
        return readings

    def _terms(self, point: Point, z: Vector) -> tuple[list[Reading], float]:
        if self.holds:
            return super()._terms(point, z)
        missing = self._missing(point)
        return [missing], float(missing.values[0])

    def _missing(self, point: Point) -> Reading:
        """Logarithm of the sum of the parts of robots that miss each limit: all that can miss."""
        distances, slopes = [np.zeros(0)], [np.zeros((0, self.count))]
        for number in limited(self):
            wish = self.constraints[number]
            rows = rows_of(wish)
            reading = self._joined([row_reading(wish, point)])
            shift, sd = self._deviates(point, number)
            mean = _added(reading, shift)
            for at, row, side in _sides(rows):
                limit = row.upper if side > 0.0 else row.lower
                if sd.values[at] <= _NOTHING * abs(limit):
                    continue
                distance = side * (limit - mean.values[at]) / sd.values[at]
                distances.append(np.array([distance]))
                if mean.slopes is not None and sd.slopes is not None:
                    by = -side * mean.slopes[at] - distance * sd.slopes[at]
                    slopes.append(by[None] / sd.values[at])
        beta = np.concatenate(distances)
        parts = log_ndtr(-beta)
        total = float(np.logaddexp.reduce(parts)) if len(parts) else 0.0
        if point.slopes_of is None:
            return Reading(np.array([total]), None)
        density = -0.5 * beta**2 - 0.5 * np.log(2.0 * np.pi)
        by = -np.exp(density - total) @ np.concatenate(slopes)
        return Reading(np.array([total]), by[None])

    def _deviates(self, point: Point, number: int) -> tuple[Reading, Reading]:
        """Shift of the mean and standard deviation of the numbers of a constraint."""
        shift, sd = self._spread(point)[number]
        if point.slopes_of is None:
            return Reading(shift, None), Reading(sd, None)
        by = point.once("spread slopes", lambda: self._spread_slopes(point))
        return Reading(shift, by[number][0].T), Reading(sd, by[number][1].T)

    def _spread(self, point: Point) -> list[Float[np.ndarray, "2 k"]]:
        """Shift of the mean and standard deviation of the numbers of every constraint."""

        def spread() -> list[np.ndarray]:
            mean = np.array([one.mean for one in point.deviations])
            spreads: list[np.ndarray] = []
            for wish in self.constraints:
                slopes = row_reading(wish, point).slopes
                assert slopes is not None
                by = slopes[:, self.count :]
                spreads.append(np.stack([by @ mean, np.linalg.norm(by, axis=1)]))
            return spreads

        return point.once("spread", spread)

    def _spread_slopes(self, point: Point) -> list[Float[np.ndarray, "2 v k"]]:
        spread = self._spread(point)
        columns: list[list[np.ndarray]] = []
        for number, column in enumerate(self.solver.variables.columns):
            x = point.x.copy()
            inward = 1.0 if x[number] < 0.5 * (column.lower + column.upper) else -1.0
            step = inward * _STEP * column.span
            x[number] += step
            moved = self._spread(self.solver.point(x))
            columns.append([(b - a) / step for a, b in zip(spread, moved, strict=True)])
        return [np.stack(one, axis=1) for one in zip(*columns, strict=True)]


def limited(problem: DesignProblem) -> list[int]:
    """Return the numbers of the constraints that have limits, not a value."""
    every = enumerate(problem.constraints)
    return [number for number, one in every if not any(row.is_equality for row in rows_of(one))]


def _sides(rows: list[Row]) -> list[tuple[int, Row, float]]:
    """Return every limit with the place of its row: 1 for the greatest value, -1 for the least."""
    return [
        (number, row, side)
        for number, row in enumerate(rows)
        for side, limit in ((1.0, row.upper), (-1.0, row.lower))
        if np.isfinite(limit)
    ]


def _added(*readings: Reading) -> Reading:
    slopes = [one.slopes for one in readings if one.slopes is not None]
    both = np.sum(slopes, axis=0) if len(slopes) == len(readings) else None
    return Reading(np.sum([one.values for one in readings], axis=0), both)


def levels_of(
    problem: DesignProblem, tolerances: Sequence[Tolerance], draws: int, seed: int
) -> Float[np.ndarray, "draws d"]:
    """Return levels of everything that deviates, as for a tolerance analysis."""
    sources = sources_of(problem.solver.variables.robot, tolerances)
    return np.concatenate(replicates(len(sources), points_of_each(draws), seed))


def met_by(
    problem: DesignProblem,
    z: Vector,
    tolerances: Sequence[Tolerance],
    levels: Float[np.ndarray, "draws d"],
    targets: Sequence[int],
) -> Bool[np.ndarray, "draws k"]:
    """Solve robots within tolerances, and return which meet which constraints.

    Args:
        problem: The problem.
        z: The scaled variables of the robot of the drawing.
        tolerances: What deviates.
        levels: Levels of what deviates, each between 0 and 1.
        targets: Numbers of the constraints.

    Returns:
        Whether each robot meets each of these constraints; no robot that cannot be made or solved
        meets any.
    """
    solver, x = problem.solver, problem.x(z)
    exact = solver.variables.robot_at(x).replace(tolerance=None)
    sources = sources_of(exact, tolerances)
    numbers = values_at(sources, np.clip(levels, TAIL, 1.0 - TAIL))
    met, rows = np.zeros((len(levels), len(targets)), bool), np.arange(len(levels))
    every = [(k, problem.constraints[number]) for k, number in enumerate(targets)]
    of_states = [
        (k, wish) for k, wish in every if wish.asked.state is not None or wish.curve is not None
    ]
    closings = [one for one in every if one[1].asked.quantity == CLOSING]
    others = [one for one in every if one not in of_states and one not in closings]
    if of_states:
        try:
            arrays, converged = solved(solver, exact, [x], numbers)
        except InputError as error:
            if error.code is not ErrorCode.INVALID_ROBOT:
                raise
            return met
        rows = np.flatnonzero(converged)
        with_curves = any(one.curve is not None for _, one in of_states)

        def at(row: int) -> Point:
            own = {name: values[row] for name, values in arrays.items()}
            # Of a robot without curves nothing else is asked.
            robot = _robot_at(exact, numbers, row) if with_curves else exact
            return Point(solver.variables, x, robot, solver.paths, own)

        solved_rows = _rows([one for _, one in of_states], map(at, rows.tolist()))
        met[rows[:, None], [k for k, _ in of_states]] = solved_rows
    if closings and len(rows):
        tensions = closing_tensions_of(exact, {name: one[rows] for name, one in numbers.items()})
        closed = (
            Point(solver.variables, x, exact, solver.paths, {}, kept={CLOSINGS: one})
            for one in tensions
        )
        met[rows[:, None], [k for k, _ in closings]] = _rows([one for _, one in closings], closed)
    for row in rows.tolist() if others else ():
        try:
            point = Point(solver.variables, x, _robot_at(exact, numbers, row), solver.paths, {})
        except InputError:  # numbers that make no robot
            continue
        met[row, [k for k, _ in others]] = _rows([one for _, one in others], [point])[0]
    return met


def _robot_at(robot: Robot, numbers: Mapping[str, np.ndarray], row: int) -> Robot:
    return robot.with_values({name: float(values[row]) for name, values in numbers.items()})


def _rows(wishes: Sequence[Wish], points: Iterable[Point]) -> Bool[np.ndarray, "robots k"]:
    """Tell which solved robots meet constraints."""
    values = [np.concatenate([row_reading(one, at).values for one in wishes]) for at in points]
    count = sum(len(rows_of(one)) for one in wishes)
    return _met(wishes, np.reshape(values, (len(values), count)))


def _met(
    wishes: Sequence[Wish], values: Float[np.ndarray, "robots m"]
) -> Bool[np.ndarray, "robots k"]:
    """Tell for which robots the numbers of constraints, one after the other, are within limits."""
    met: list[np.ndarray] = []
    start = 0
    for one in wishes:
        rows = rows_of(one)
        own = values[:, start : start + len(rows)]
        violation = np.abs(violations(rows, own, row_sizes(rows)))
        met.append(np.all(violation <= TOLERANCE, axis=1))  # not where a value is NaN
        start += len(rows)
    return np.stack(met, axis=1)


# Searches from the best of the plain ones.
_STARTS = 2
_ROUNDS = 6
# The lower end of a yield may exceed its target by this part of the allowed failures.
_ABOVE = 0.1


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


@dataclass(frozen=True)
class YieldEstimate:
    """Which drawn robots of a design meet which limits: an estimate of the yield.

    Attributes:
        met: By robot and constraint with limits.
    """

    met: Bool[np.ndarray, "draws k"]

    def part(self, columns: Sequence[int]) -> tuple[float, tuple[float, float]]:
        """Return which part meets all of some constraints, and its 95 % interval."""
        meets = np.asarray(self.met[:, list(columns)].all(axis=1))
        each = len(meets) // REPLICATES
        return float(meets.mean()), yield_interval(
            meets.reshape(REPLICATES, each).sum(axis=1), each
        )


_Counted = tuple[SearchResult, YieldEstimate]


@dataclass(frozen=True)
class YieldTarget:
    """The yield wanted of several constraints together, by their columns."""

    part: float
    columns: tuple[int, ...]


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

    Raises:
        InputError: No constraint has a limit, or nothing deviates.
    """
    options = spec.robust or RobustOptions()
    best = plain.best
    numbers = limited(best.problem)
    targets = _wanted(spec, options, best.problem, numbers)

    def counted(one: SearchResult) -> YieldEstimate:
        levels = levels_of(one.problem, tolerances, options.draws, options.seed)
        return YieldEstimate(met_by(one.problem, one.found.z, tolerances, levels, numbers))

    searches = Searches([best], plain.interrupted)
    try:
        before = count = counted(best)
    except KeyboardInterrupt:
        searches.interrupted = True
        return searches, ()

    def keep_best(starts: Sequence[SearchResult], holds: Mapping[int, Hold]) -> list[_Counted]:
        nonlocal searches, count
        results = [_robust(one, tolerances, holds, spec.search.iterations) for one in starts]
        tried = [(one, counted(one)) for one in results if one is not None]
        for one, yields in tried:
            if _is_better(targets, one, yields, searches.best, count):
                searches, count = Searches([one]), yields
        return tried

    starts = sorted(plain.outcomes, key=lambda one: one.merit)[:_STARTS]
    factors = [float(ndtri(one.part)) for one in targets]
    try:
        for done in range(0 if plain.interrupted else _ROUNDS):
            if progress is not None:
                progress("making it robust", done, _ROUNDS)
            tried = keep_best(starts, _holds(targets, factors, numbers))
            if not tried:
                break
            first, yields = min(tried, key=lambda pair: pair[0].merit)
            starts = [first]
            if not targets or not _recalibrate(targets, factors, yields):
                break
        if not plain.interrupted and _lack(targets, count) > 0.0:
            keep_best([searches.best, best], {})  # that with the greatest yield comes nearest
    except KeyboardInterrupt:
        searches.interrupted = True
    placed = place(searches)
    if placed is not searches:
        searches, count = placed, counted(placed.best)
    return searches, _yields(best.problem, options, numbers, before, count)


def _wanted(
    spec: DesignSpec, options: RobustOptions, problem: DesignProblem, numbers: Sequence[int]
) -> list[YieldTarget]:
    """Return the yield targets: of single constraints, and of all together."""
    targets: list[YieldTarget] = []
    for column, number in enumerate(numbers):
        asked = problem.constraints[number].asked
        assert isinstance(asked, DesignConstraint)
        if asked.wanted_yield is not None:
            targets.append(YieldTarget(asked.wanted_yield, (column,)))
    if options.wanted_yield is not None:
        targets.append(YieldTarget(options.wanted_yield, tuple(range(len(numbers)))))
    return targets


def _holds(
    targets: Sequence[YieldTarget], factors: Sequence[float], numbers: Sequence[int]
) -> dict[int, Hold]:
    """Return how every constraint is to hold: by the largest factor of those that it needs."""
    holds: dict[int, Hold] = {}
    for one, factor in zip(targets, factors, strict=True):
        for column in one.columns:
            before = holds.get(numbers[column])
            if before is None or factor > before.factor:
                holds[numbers[column]] = Hold(one.part, factor)
    return holds


def _robust(
    start: SearchResult,
    tolerances: Sequence[Tolerance],
    holds: Mapping[int, Hold],
    iterations: int,
) -> SearchResult | None:
    """Search from the end of another search; None where that has no derivatives."""
    solver = start.problem.solver
    problem = RobustProblem(
        replace(solver, variables=replace(solver.variables, tolerances=tuple(tolerances))),
        start.problem.wishes,
        holds=holds,
    )
    first = problem.evaluate(start.found.z)
    if first is None:
        return None
    problem.set_sizes([first])
    if holds:  # the same sum, whose size several robots have shown
        vars(problem)["total_size"] = start.problem.total_size
    optimum: LocalOptimum = search_from(problem, start.found.z, iterations)
    return (
        None
        if optimum.evaluation is None
        else SearchResult(problem, start.number, optimum.z, optimum)
    )


def _recalibrate(
    targets: Sequence[YieldTarget], factors: list[float], count: YieldEstimate
) -> bool:
    """Move factors by what the counted yields lack; False where all are right."""
    right = True
    for number, one in enumerate(targets):
        low = count.part(one.columns)[1][0]
        if one.part <= low <= one.part + _ABOVE * (1.0 - one.part):
            continue
        aim = one.part + 0.5 * _ABOVE * (1.0 - one.part)
        edge = 0.5 / len(count.met)
        move = float(ndtri(aim) - ndtri(np.clip(low, edge, 1.0 - edge)))
        after = max(factors[number] + move, 0.0)
        right = right and after == factors[number]
        factors[number] = after
    return not right


def _is_better(
    targets: Sequence[YieldTarget],
    one: SearchResult,
    count: YieldEstimate,
    best: SearchResult,
    best_count: YieldEstimate,
) -> bool:
    """Whether a design lacks less yield than the best so far, or has a smaller sum."""
    if not targets:
        every = range(count.met.shape[1])
        return (one.merit[0] == 0.0) >= (best.merit[0] == 0.0) and (
            count.part(every)[0] >= best_count.part(every)[0]
        )
    lack, best_lack = _lack(targets, count), _lack(targets, best_count)
    if lack == best_lack == 0.0:
        return _total(one) < _total(best) or not isinstance(best.problem, RobustProblem)
    return lack < best_lack


def _lack(targets: Sequence[YieldTarget], count: YieldEstimate) -> float:
    """Return by how much the lower ends of the counted yields miss the targets, in all."""
    return sum(max(one.part - count.part(one.columns)[1][0], 0.0) for one in targets)


def _total(one: SearchResult) -> float:
    assert one.found.evaluation is not None
    return one.found.evaluation.total


def _yields(
    problem: DesignProblem,
    options: RobustOptions,
    numbers: Sequence[int],
    before: YieldEstimate,
    after: YieldEstimate,
) -> tuple[YieldOf, ...]:
    every = tuple(range(len(numbers)))
    rows: list[tuple[str, float | None, tuple[int, ...]]] = [
        ("all limits", options.wanted_yield, every)
    ]
    for column, number in enumerate(numbers):
        wish = problem.constraints[number]
        asked = wish.asked
        assert isinstance(asked, DesignConstraint)
        rows.append((wish.title, asked.wanted_yield, (column,)))
    yields: list[YieldOf] = []
    for title, target, columns in rows:
        part, interval = after.part(columns)
        yields.append(YieldOf(title, target, part, interval, before.part(columns)[0]))
    return tuple(yields)


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
    robot = problems[0].solver.variables.robot
    if not any(any(one.sd.values()) for one in deviations_of(robot, tolerances)):
        raise InputError.NO_DATA("nothing deviates: all tolerances are 0; give one that is not.")
