"""The design as a problem of optimisation: scaled variables, sums to minimise, rows of limits.

Variables run from 0 to 1 between their limits. The largest of several numbers is not smooth: where
it is minimised, an epigraph variable above all of them replaces it.
"""

from __future__ import annotations

import itertools
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property, partial
from typing import Any

import numpy as np
from jaxtyping import Float

from notchflex import InputError
from notchflex.designing.model.point import Point, Solver
from notchflex.designing.model.quantities import Reading, pairs, taken
from notchflex.designing.model.wishes import Source, Wish
from notchflex.designing.specification import DesignConstraint, DesignObjective

# A number is at its limit, or within it, up to this part of its size.
TOLERANCE = 1e-6


@dataclass(frozen=True)
class Row:
    """One constraint on one number.

    Attributes:
        wish: The wish that it comes from.
        label: Which number of it, "" for the only one.
        lower: Least value, -inf for none.
        upper: Greatest value, inf for none.
    """

    wish: Wish
    label: str
    lower: float
    upper: float

    @property
    def title(self) -> str:
        """Name in messages."""
        return f"{self.wish.title}, {self.label}" if self.label else self.wish.title

    @property
    def is_equality(self) -> bool:
        """Whether it must have one value."""
        return self.lower == self.upper


def limits(asked: DesignConstraint) -> tuple[float, float]:
    """Return least and greatest value of a constraint, for steps from notch to notch if ordered."""
    if asked.order is not None:
        return (-np.inf, -asked.margin) if asked.order == "tip-first" else (asked.margin, np.inf)
    if asked.equal is not None:
        return asked.equal, asked.equal
    return (
        -np.inf if asked.lower is None else asked.lower,
        np.inf if asked.upper is None else asked.upper,
    )


def searched(wish: Wish) -> str:
    """Return how the search takes a constraint: of each number, where that asks for the same."""
    asked = wish.asked
    assert isinstance(asked, DesignConstraint)
    low, high = limits(asked)
    if (wish.take == "largest" and low == -np.inf) or (wish.take == "smallest" and high == np.inf):
        return "each"
    if wish.take == "range" and low <= 0.0 and high > 0.0:
        return "pairs"
    return "steps" if wish.take == "range" and low <= 0.0 else wish.take


def rows_of(wish: Wish) -> list[Row]:
    """Return the rows of a constraint as the search takes it, in the order of `row_reading`."""
    asked = wish.asked
    assert isinstance(asked, DesignConstraint)
    low, high = limits(asked)
    take, parts = searched(wish), wish.parts
    if take == "pairs":
        labels = [f"{a} less {b}" for a in parts for b in parts if a != b]
        return [Row(wish, label, -np.inf, high) for label in labels]
    if take == "each":
        return [Row(wish, part if len(parts) > 1 else "", low, high) for part in parts]
    if take == "steps":
        names = itertools.pairwise(parts)
        low = 0.0 if wish.take == "range" else low
        return [Row(wish, f"{a} to {b.split()[-1]}", low, high) for a, b in names]
    return [Row(wish, "", low, high)]


def row_reading(wish: Wish, source: Source) -> Reading:
    """Return the numbers of the rows of a constraint."""
    every, take = wish.every(source), searched(wish)
    return every.map(pairs(len(every.values))) if take == "pairs" else taken(every, take)


def squared(wish: Wish, source: Source) -> Reading:
    """Return the numbers whose squares an objective adds up: distances from a target or curve."""
    asked = wish.asked
    assert isinstance(asked, DesignObjective)
    if asked.target is None:  # the mean square, which is smooth where it is 0
        every = wish.every(source) if wish.curve is None else source.offsets(wish.curve)
        return every.scaled(float(np.sqrt(asked.weight / len(wish.rows))))
    reading = taken(wish.every(source), wish.take)
    return Reading(reading.values - asked.target, reading.slopes).scaled(
        float(np.sqrt(asked.weight))
    )


def objective_reading(wish: Wish, source: Source) -> Reading:
    """Return what an objective adds to the sum that is minimised, in the units of the user."""
    asked = wish.asked
    assert isinstance(asked, DesignObjective)
    if asked.target is not None or (wish.take == "rms" and asked.goal == "minimise"):
        off = squared(wish, source)
        by = None if off.slopes is None else 2.0 * off.values[None] @ off.slopes
        return Reading(np.array([float(off.values @ off.values)]), by)
    sign = asked.weight * (1.0 if asked.goal == "minimise" else -1.0)
    # Several numbers that each count are added up.
    take = "sum" if wish.take == "each" else wish.take
    return taken(wish.every(source), take).scaled(sign)


def violations(
    rows: Sequence[Row], values: Float[np.ndarray, " k"], sizes: Float[np.ndarray, " k"]
) -> Float[np.ndarray, " k"]:
    """Return by how much numbers are beyond their limits, signed, in their sizes."""
    low = np.array([one.lower for one in rows])
    high = np.array([one.upper for one in rows])
    return (np.maximum(values - high, 0.0) - np.maximum(low - values, 0.0)) / sizes


def row_sizes(
    rows: Sequence[Row], reached: Float[np.ndarray, " k"] | None = None
) -> Float[np.ndarray, " k"]:
    """Return the sizes by which violations count: those of the limits, or of what is reached."""
    sizes = [_size(one) for one in rows]
    scales = np.array(sizes, float)
    other = np.abs(reached) if reached is not None else np.zeros(len(rows))
    return np.where(scales > 0.0, scales, np.where(other > 1e-9, other, 1.0))


def _size(row: Row) -> float:
    finite = [abs(one) for one in (row.lower, row.upper) if np.isfinite(one)]
    return max(finite, default=0.0)


def epigraphs(wish: Wish) -> Iterator[tuple[str, float]]:
    """Yield epigraph bounds for the largest or smallest of several numbers in an objective.

    Each is "above" or "below" all numbers, with its factor in the sum that is minimised.
    """
    asked = wish.asked
    if not isinstance(asked, DesignObjective) or asked.target is not None or len(wish.rows) < 2:
        return
    least = asked.goal == "minimise"
    if wish.take == "largest" and least:
        yield "above", asked.weight
    if wish.take == "smallest" and not least:
        yield "below", -asked.weight
    if wish.take == "range" and least:
        yield "above", asked.weight
        yield "below", -asked.weight


Vector = Float[np.ndarray, " v"]
_KEPT = 16


@dataclass(frozen=True)
class EpigraphBound:
    """A variable of the search that is above or below all numbers of an objective."""

    wish: Wish
    side: str
    factor: float

    @property
    def sign(self) -> float:
        """1 above all numbers, -1 below."""
        return 1.0 if self.side == "above" else -1.0


@dataclass(frozen=True, eq=False)
class DesignEvaluation:
    """A design at one vector of scaled variables.

    Attributes:
        point: The robot solved.
        objective: The sum that is minimised, without terms replaced by epigraph bounds.
        rows: The numbers of all constraints.
        bounded: The numbers that each bound is above or below.
        total: The whole sum, the largest of several numbers taken as it is.
        has_slopes: Whether the numbers come with their derivatives.
    """

    point: Point
    objective: Reading
    rows: Reading
    bounded: tuple[Reading, ...]
    total: float
    has_slopes: bool


@dataclass(eq=False)
class DesignProblem:
    """A design of robots of one form.

    Attributes:
        solver: Solves them.
        wishes: Objectives and constraints.
        extra: More rows, in the order of the wishes given with them; for points of a front.
        failures: Why points could not be solved, and how often.
        steepest: The largest gradient of the sum that was met, by scaled variables.
    """

    solver: Solver
    wishes: tuple[Wish, ...]
    extra: tuple[tuple[Wish, float], ...] = ()
    failures: dict[str, int] = field(default_factory=dict[str, int])
    steepest: float = 0.0

    @cached_property
    def count(self) -> int:
        """Number of variables, without bounds."""
        return len(self.solver.variables.columns)

    @cached_property
    def objectives(self) -> tuple[Wish, ...]:
        """The objectives."""
        return tuple(one for one in self.wishes if isinstance(one.asked, DesignObjective))

    @cached_property
    def constraints(self) -> tuple[Wish, ...]:
        """The constraints."""
        return tuple(one for one in self.wishes if isinstance(one.asked, DesignConstraint))

    @cached_property
    def rows(self) -> tuple[Row, ...]:
        """Every constraint on one number."""
        own = [row for wish in self.constraints for row in rows_of(wish)]
        more = [Row(wish, "", -np.inf, most) for wish, most in self.extra]
        return (*own, *more)

    @cached_property
    def bounds(self) -> tuple[EpigraphBound, ...]:
        """The further variables."""
        return tuple(
            EpigraphBound(wish, side, factor)
            for wish in self.objectives
            for side, factor in epigraphs(wish)
        )

    @cached_property
    def start(self) -> Vector:
        """The robot as it is, scaled."""
        variables = self.solver.variables
        return (variables.start - variables.lower) / variables.span

    def x(self, z: Vector) -> Vector:
        """Return the vector of variables of a scaled one."""
        variables = self.solver.variables
        return variables.lower + np.clip(z[: self.count], 0.0, 1.0) * variables.span

    @cached_property
    def _kept(self) -> dict[bytes, DesignEvaluation | None]:
        """Designs evaluated last: a search asks for where another one began or ended."""
        return {}

    def evaluate(self, z: Vector) -> DesignEvaluation | None:
        """Return the design at a scaled vector; None where there is no robot or no equilibrium."""
        z = np.clip(z[: self.count], 0.0, 1.0)
        key = z.tobytes()
        if key not in self._kept:
            if len(self._kept) >= _KEPT:
                del self._kept[next(iter(self._kept))]
            self._kept[key] = self._evaluated(z)
        return self._kept[key]

    def _evaluated(self, z: Vector) -> DesignEvaluation | None:
        try:
            point = self._solved(z)
            evaluation = self.read(point.plain, z)
        except InputError as error:
            return self._failed(str(error))
        return None if evaluation is None else replace(evaluation, point=point)

    def _solved(self, z: Vector) -> Point:
        return self.solver.point(self.x(z))

    def with_slopes(self, one: DesignEvaluation, z: Vector) -> DesignEvaluation | None:
        """Return the design at a scaled vector with its derivatives; None if they are not known."""
        if one.has_slopes:
            return one
        try:
            return self.read(one.point, z)
        except InputError as error:
            return self._failed(str(error))

    def _failed(self, reason: str) -> None:
        self.failures[reason] = self.failures.get(reason, 0) + 1

    def read(self, point: Point, z: Vector) -> DesignEvaluation | None:
        """Return objectives and constraints of a solved robot; None if one is not a number."""
        terms, total = self._terms(point, z)
        bounded = tuple(self._joined([one.wish.every(point)]) for one in self.bounds)
        has_slopes = point.slopes_of is not None
        rows = self._joined(self._row_readings(point))
        evaluation = DesignEvaluation(point, self._sum(terms), rows, bounded, total, has_slopes)
        if evaluation.objective.slopes is not None:
            size = float(np.linalg.norm(evaluation.objective.slopes * self.solver.variables.span))
            self.steepest = max(self.steepest, size if np.isfinite(size) else 0.0)
        return evaluation if self._is_finite(evaluation) else None

    def _terms(self, point: Point, z: Vector) -> tuple[list[Reading], float]:
        """Return the smooth terms of the objective, and the whole sum."""
        if not self.objectives:  # the smallest change of the robot
            off = z[: self.count] - self.start
            by = 2.0 * off / self.solver.variables.span
            total = float(off @ off)
            return [Reading(np.array([total]), by[None])], total
        smooth = {id(one.wish) for one in self.bounds}
        terms = [objective_reading(one, point) for one in self.objectives if id(one) not in smooth]
        total = sum(float(objective_reading(one, point).values.sum()) for one in self.objectives)
        return terms, total

    def _row_readings(self, point: Point) -> list[Reading]:
        """Return the numbers of the rows, in their order."""
        own = [row_reading(one, point) for one in self.constraints]
        return own + [objective_reading(one, point) for one, _ in self.extra]

    def _sum(self, terms: Sequence[Reading]) -> Reading:
        joined = self._joined(terms)
        return joined.map(np.ones((1, len(joined.values))))

    def _joined(self, readings: Sequence[Reading]) -> Reading:
        values = np.concatenate([np.zeros(0), *(one.values for one in readings)])
        slopes = [one.slopes[:, : self.count] for one in readings if one.slopes is not None]
        if len(slopes) < len(readings):
            return Reading(values, None)
        return Reading(values, np.concatenate([np.zeros((0, self.count)), *slopes]))

    def _is_finite(self, one: DesignEvaluation) -> bool:
        readings = (one.objective, one.rows, *one.bounded)
        is_finite = all(
            np.isfinite(reading.values).all()
            and (reading.slopes is None or np.isfinite(reading.slopes).all())
            for reading in readings
        )
        if not is_finite:
            self._failed("a quantity that is asked is not a number, as where a notch never closes")
        return is_finite

    @cached_property
    def sizes(self) -> Float[np.ndarray, " k"]:
        """Sizes by which violations count; set by the first robot that is solved."""
        return row_sizes(self.rows)

    def violation(self, one: DesignEvaluation) -> Float[np.ndarray, " k"]:
        """Return by how much rows are beyond their limits, in their sizes."""
        if not self.rows:
            return np.zeros(0)
        return violations(self.rows, one.rows.values, self.sizes)

    def worst(self, one: DesignEvaluation) -> float:
        """Return the largest violation."""
        return float(np.abs(self.violation(one)).max(initial=0.0))

    @cached_property
    def total_size(self) -> float:
        """Size by which sums of robots differ; set with the sizes of the rows."""
        return 1.0

    def set_sizes(self, reached: Sequence[DesignEvaluation]) -> None:
        """Take sizes from what robots reach: of the sum, and of rows without a limit of a size."""
        totals = np.array([one.total for one in reached])
        spread = float(np.quantile(totals, 0.75) - np.quantile(totals, 0.25))
        vars(self)["total_size"] = spread or float(np.abs(totals).max()) or 1.0
        values = np.array([one.rows.values for one in reached]).reshape(len(reached), -1)
        vars(self)["sizes"] = row_sizes(self.rows, np.abs(values).max(axis=0, initial=0.0))


Progress = Callable[[str, int, int], None]
"""Called with the stage, how much of it is done, and how much there is."""


# Value of the sum without a valid robot or an equilibrium, in sizes of the sum.
_PENALTY = 1e3


@dataclass
class ScaledDerivatives:
    """Derivatives of the sum and of the rows, "eq" (= 0) and "ineq" (>= 0)."""

    gradient: Vector
    rows: dict[str, np.ndarray]


@dataclass(eq=False)
class Scaled:
    """A problem for searches, scaled where it begins.

    Attributes:
        problem: The problem.
        first: The robot where the search begins, with derivatives.
        start: Where that is.
        best: The best robot met so far, and its vector.
        linear: Where derivatives were asked last, and what they are.
    """

    problem: DesignProblem
    first: DesignEvaluation
    start: Vector
    best: tuple[Vector, DesignEvaluation] | None = None
    linear: tuple[bytes, ScaledDerivatives] | None = None

    def __post_init__(self) -> None:
        """Find the sizes of sum and rows."""
        span = self.problem.solver.variables.span
        first = self.first
        assert first.objective.slopes is not None
        assert first.rows.slopes is not None
        by = np.linalg.norm(first.objective.slopes[0] * span)
        for bound, reading in zip(self.problem.bounds, first.bounded, strict=True):
            assert reading.slopes is not None
            by += abs(bound.factor) * np.linalg.norm(reading.slopes * span, axis=1).max()
        self.size = float(by) if by > 1e-9 * (1.0 + abs(first.total)) else 1.0 + abs(first.total)
        sizes = np.linalg.norm(first.rows.slopes * span, axis=1)
        self.row_size = np.where(sizes > 1e-9 * self.problem.sizes, sizes, self.problem.sizes)
        self.bound_size = np.array([np.ptp(r.values) or 1.0 for r in first.bounded])
        self.bound_zero = np.array(
            [
                reading.values.max() if bound.side == "above" else reading.values.min()
                for bound, reading in zip(self.problem.bounds, first.bounded, strict=True)
            ]
        )
        self.linear = self.y.tobytes(), self._derivatives(first)
        self._good = self._value(self.y, first), self._rows(self.y, first)

    @property
    def y(self) -> Vector:
        """Start of the search."""
        return np.concatenate([self.start, np.zeros(len(self.problem.bounds))])

    @property
    def limits(self) -> list[tuple[float | None, float | None]]:
        """Limits of the vector."""
        free: list[tuple[float | None, float | None]] = [(None, None)] * len(self.problem.bounds)
        return [*((0.0, 1.0) for _ in range(self.problem.count)), *free]

    def evaluation(self, y: Vector) -> DesignEvaluation | None:
        """Return the robot at a vector, perhaps without derivatives."""
        evaluation = self.problem.evaluate(y)
        if evaluation is not None and self._is_better(evaluation):
            self.best = y[: self.problem.count].copy(), evaluation
        return evaluation

    def value(self, y: Vector) -> float:
        """Return the sum; far above all others where there is no robot."""
        evaluation = self.evaluation(y)
        return self._good[0] + _PENALTY if evaluation is None else self._value(y, evaluation)

    def rows(self, y: Vector, kind: str) -> np.ndarray:
        """Return the numbers of the equalities ("eq") or inequalities ("ineq")."""
        evaluation = self.evaluation(y)
        return self._good[1][kind] if evaluation is None else self._rows(y, evaluation)[kind]

    def gradient(self, y: Vector) -> Vector:
        """Return the derivatives of the sum."""
        return self._linear(y).gradient

    def jacobian(self, y: Vector, kind: str) -> np.ndarray:
        """Return the derivatives of the rows."""
        return self._linear(y).rows[kind]

    def _linear(self, y: Vector) -> ScaledDerivatives:
        key = y.tobytes()
        if self.linear is None or self.linear[0] != key:
            evaluation = self.evaluation(y)
            full = None if evaluation is None else self.problem.with_slopes(evaluation, y)
            if full is None:
                assert self.linear is not None
                return self.linear[1]
            if self.best is not None and self.best[1].point is full.point:
                self.best = self.best[0], full
            self.linear = key, self._derivatives(full)
            self._good = self._value(y, full), self._rows(y, full)
        return self.linear[1]

    def _is_better(self, candidate: DesignEvaluation) -> bool:
        if self.best is None:
            return True
        return is_better(self.problem, candidate, self.best[1])

    def _slack(self, y: Vector) -> Vector:
        return self.bound_zero + self.bound_size * y[self.problem.count :]

    def _value(self, y: Vector, one: DesignEvaluation) -> float:
        factors = np.array([bound.factor for bound in self.problem.bounds])
        return float(one.objective.values.sum() + factors @ self._slack(y)) / self.size

    def _rows(self, y: Vector, one: DesignEvaluation) -> dict[str, np.ndarray]:
        low, high, same = self._row_limits
        numbers, slack = one.rows.values, self._slack(y)
        least: list[np.ndarray] = []
        for side, limit in ((1.0, low), (-1.0, high)):
            is_limited = np.isfinite(limit) & ~same
            least.append(
                side * (numbers[is_limited] - limit[is_limited]) / self.row_size[is_limited]
            )
        for k, (bound, reading) in enumerate(zip(self.problem.bounds, one.bounded, strict=True)):
            least.append(bound.sign * (slack[k] - reading.values) / self.bound_size[k])
        equal = (numbers[same] - low[same]) / self.row_size[same]
        return {"eq": equal, "ineq": np.concatenate([np.zeros(0), *least])}

    def _derivatives(self, one: DesignEvaluation) -> ScaledDerivatives:
        bounds, span = self.problem.bounds, self.problem.solver.variables.span
        assert one.objective.slopes is not None
        assert one.rows.slopes is not None
        factors = np.array([bound.factor for bound in bounds])
        by = [one.objective.slopes[0] * span, factors * self.bound_size]
        rows = one.rows.slopes * span / self.row_size[:, None]
        rows = np.concatenate([rows, np.zeros((len(rows), len(bounds)))], axis=1)
        low, high, same = self._row_limits
        sides = ((1.0, low), (-1.0, high))
        least = [side * rows[np.isfinite(limit) & ~same] for side, limit in sides]
        for k, (bound, reading) in enumerate(zip(bounds, one.bounded, strict=True)):
            assert reading.slopes is not None
            own = np.zeros((len(reading.values), len(bounds)))
            own[:, k] = bound.sign
            by_z = -bound.sign * reading.slopes * span / self.bound_size[k]
            least.append(np.concatenate([by_z, own], axis=1))
        none = np.zeros((0, rows.shape[1]))
        gradient = np.concatenate(by) / self.size
        return ScaledDerivatives(
            gradient, {"eq": rows[same], "ineq": np.concatenate([none, *least])}
        )

    @property
    def _row_limits(self) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        rows = self.problem.rows
        low = np.array([one.lower for one in rows])
        high = np.array([one.upper for one in rows])
        return low, high, low == high

    @property
    def constraints(self) -> list[dict[str, Any]]:
        """The rows as SciPy takes them."""
        first = self._rows(self.y, self.first)
        return [
            {
                "type": kind,
                "fun": partial(self.rows, kind=kind),
                "jac": partial(self.jacobian, kind=kind),
            }
            for kind, numbers in first.items()
            if len(numbers)
        ]


def is_better(problem: DesignProblem, one: DesignEvaluation, other: DesignEvaluation) -> bool:
    """Return whether a robot is better: nearer to all limits, or as near and with less."""
    a, b = problem.worst(one), problem.worst(other)
    if max(a, b) <= TOLERANCE:
        return one.total < other.total
    return a < b
