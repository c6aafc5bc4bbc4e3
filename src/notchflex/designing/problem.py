"""The design as a problem of optimisation: scaled variables, sums to minimise, rows of limits.

Variables run from 0 to 1 between their limits. The largest of several numbers is not smooth: where
it is minimised, an epigraph variable above all of them replaces it.
"""

from __future__ import annotations

import itertools
from collections import Counter
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import NamedTuple

import numpy as np
from jaxtyping import Float

from notchflex import InputError
from notchflex.designing.model.point import Point, Solver
from notchflex.designing.model.quantities import Reading, taken
from notchflex.designing.model.wishes import Source, Wish
from notchflex.designing.specification import DesignConstraint, DesignObjective
from notchflex.search.slsqp import TOLERANCE, Linearisation, NonlinearProgram, Vector, violation

Progress = Callable[[str, int, int], None]
"""Called with the stage, how much of it is done, and how much there is."""


@dataclass(frozen=True)
class Row:
    """One constraint on one number: which one, "" for the only one, and its limits."""

    wish: Wish
    label: str
    lower: float
    upper: float

    @property
    def title(self) -> str:
        """Name in messages."""
        return f"{self.wish.title}, {self.label}" if self.label else self.wish.title

    @property
    def size(self) -> float:
        """The greater of its limits; 0 where none has a size."""
        return max((abs(one) for one in (self.lower, self.upper) if np.isfinite(one)), default=0.0)


def _searched(wish: Wish) -> tuple[str, float, float]:
    """Return how the search takes a constraint, smooth where that asks for the same, and limits.

    Ordered numbers have limits of the steps from notch to notch.
    """
    asked = wish.asked
    assert isinstance(asked, DesignConstraint)
    low = asked.equal if asked.lower is None else asked.lower
    high = asked.equal if asked.upper is None else asked.upper
    low, high = -np.inf if low is None else low, np.inf if high is None else high
    if asked.order is not None:
        low, high = (
            (-np.inf, -asked.margin) if asked.order == "tip-first" else (asked.margin, np.inf)
        )
    if (wish.take == "largest" and low == -np.inf) or (wish.take == "smallest" and high == np.inf):
        return "each", low, high
    if wish.take == "range" and low <= 0.0:
        return ("pairs", -np.inf, high) if high > 0.0 else ("steps", 0.0, high)
    return wish.take, low, high


def rows_of(wish: Wish) -> list[Row]:
    """Return the rows of a constraint as the search takes it, in the order of `row_reading`."""
    take, low, high = _searched(wish)
    parts, labels = wish.parts, [""]
    if take == "each" and len(parts) > 1:
        labels = list(parts)
    elif take == "pairs":
        labels = [f"{a} less {b}" for a, b in itertools.permutations(parts, 2)]
    elif take == "steps":
        labels = [f"{a} to {b.split()[-1]}" for a, b in itertools.pairwise(parts)]
    return [Row(wish, label, low, high) for label in labels]


def limits_of(rows: Sequence[Row]) -> Float[np.ndarray, "m 2"]:
    """Return the limits of some rows."""
    return np.reshape([(row.lower, row.upper) for row in rows], (-1, 2))


def row_reading(wish: Wish, source: Source) -> Reading:
    """Return the numbers of the rows of a constraint."""
    return taken(wish.every(source), _searched(wish)[0])


def objective_reading(wish: Wish, source: Source) -> Reading:
    """Return what an objective adds to the sum that is minimised, in the units of the user."""
    asked = wish.asked
    assert isinstance(asked, DesignObjective)
    if is_square(wish):
        off = squared(wish, source)
        return Reading(off.values[None] @ np.column_stack([off.values, 2.0 * off.slopes]))
    # Several numbers that each count are added up.
    reading = taken(wish.every(source), "sum" if wish.take == "each" else wish.take)
    return reading.scaled(asked.weight if asked.goal == "minimise" else -asked.weight)


def is_square(wish: Wish) -> bool:
    """Return whether an objective is to come near to something."""
    asked = wish.asked
    assert isinstance(asked, DesignObjective)
    return asked.target is not None or (wish.take == "rms" and asked.goal == "minimise")


def squared(wish: Wish, source: Source) -> Reading:
    """Return the numbers whose squares an objective adds up: distances from a target or curve."""
    asked = wish.asked
    assert isinstance(asked, DesignObjective)
    if asked.target is None:  # the mean square, which is smooth where it is 0
        reading = wish.every(source) if wish.curve is None else source.offsets(wish.curve)
        return reading.scaled(float(np.sqrt(asked.weight / len(wish.rows))))
    reading = taken(wish.every(source), wish.take)
    off = np.column_stack([reading.values - asked.target, reading.slopes])
    return Reading(off).scaled(float(np.sqrt(asked.weight)))


class EpigraphBound(NamedTuple):
    """A variable of the search that is above (sign 1) or below (-1) all numbers of an objective."""

    wish: Wish
    sign: float
    factor: float  # in the sum that is minimised


def epigraphs(wish: Wish) -> list[EpigraphBound]:
    """Return the bounds for the largest or smallest of several numbers in an objective."""
    asked = wish.asked
    assert isinstance(asked, DesignObjective)
    signs = {
        ("largest", "minimise"): (1.0,),
        ("smallest", "maximise"): (-1.0,),
        ("range", "minimise"): (1.0, -1.0),
    }.get((wish.take, asked.goal or ""), ())
    return [EpigraphBound(wish, sign, sign * asked.weight) for sign in signs]


@dataclass(frozen=True, eq=False)
class DesignEvaluation:
    """A design at one vector of scaled variables.

    Attributes:
        z: The vector.
        point: The robot solved.
        objective: The sum that is minimised, without terms replaced by epigraph bounds.
        rows: The numbers of all constraints.
        bounded: The numbers that each bound is above or below.
        total: The whole sum, the largest of several numbers taken as it is.
    """

    z: Vector
    point: Point
    objective: Reading
    rows: Reading
    bounded: tuple[Reading, ...]
    total: float


@dataclass(eq=False)
class DesignProblem:
    """A design of robots of one form.

    Attributes:
        solver: Solves them.
        wishes: Objectives and constraints.
        caps: Further objectives, and the most that each may add; for points of a front.
        failures: Why points could not be solved, and how often.
        sizes: In which violations of rows are measured.
    """

    solver: Solver
    wishes: tuple[Wish, ...]
    caps: tuple[tuple[Wish, float], ...] = ()
    failures: Counter[str] = field(default_factory=Counter[str])

    def __post_init__(self) -> None:
        """Take the sizes of the limits."""
        self.sizes = np.array([row.size or 1.0 for row in self.rows])

    @property
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
        caps = [Row(wish, "", -np.inf, most) for wish, most in self.caps]
        return (*(row for wish in self.constraints for row in rows_of(wish)), *caps)

    @cached_property
    def bounds(self) -> tuple[EpigraphBound, ...]:
        """The further variables."""
        return tuple(bound for wish in self.objectives for bound in epigraphs(wish))

    @cached_property
    def start(self) -> Vector:
        """The robot as it is, scaled."""
        variables = self.solver.variables
        return (variables.start - variables.lower) / variables.span

    @cached_property
    def initial(self) -> DesignEvaluation | None:
        """The robot as it is, solved."""
        return self.evaluate(self.start)

    def x(self, z: Vector) -> Vector:
        """Return the vector of variables of a scaled one."""
        variables = self.solver.variables
        return variables.lower + z * variables.span

    def evaluate(self, z: Vector) -> DesignEvaluation | None:
        """Return the design at a scaled vector; None where there is no robot or no equilibrium."""
        return self._tried(z, lambda: self.solver.point(self.x(z)))

    def evaluate_all(self, vectors: Float[np.ndarray, "k v"]) -> list[DesignEvaluation | None]:
        """Evaluate many vectors at once, without slopes."""
        points = self.solver.points([self.x(z) for z in vectors])
        return [self._tried(*pair) for pair in zip(vectors, points, strict=True)]

    def _tried(self, z: Vector, point: Callable[[], Point]) -> DesignEvaluation | None:
        try:
            return self.read(point(), z)
        except InputError as error:
            self.failures[str(error)] += 1
            return None

    def read(self, point: Point, z: Vector) -> DesignEvaluation:
        """Return objectives and constraints of a solved robot.

        Raises:
            InputError: One of them is not a number.
        """
        width = 1 + (self.count if len(point.along) else 0)  # without slopes by what deviates

        def joined(readings: Iterable[Reading]) -> Reading:
            tables = (one.table[:, :width] for one in readings)
            return Reading(np.concatenate([np.zeros((0, width)), *tables]))

        terms, total = self._terms(point, z)
        rows = joined(self._row_readings(point))
        bounded = tuple(joined([bound.wish.every(point)]) for bound in self.bounds)
        one = DesignEvaluation(
            z, point, joined(terms).map(np.ones((1, len(terms)))), rows, bounded, total
        )
        if not all(np.isfinite(r.table).all() for r in (one.objective, one.rows, *one.bounded)):
            raise InputError.NOT_FINITE(
                "a quantity that is asked is not a number, as where a notch never closes"
            )
        return one

    def _terms(self, point: Point, z: Vector) -> tuple[list[Reading], float]:
        """Return the smooth terms of the objective, and the whole sum."""
        if not self.objectives:  # the smallest change of the robot
            off = z - self.start
            return [Reading(np.concatenate([[off @ off], 2.0 * off])[None])], float(off @ off)
        terms = [(wish, objective_reading(wish, point)) for wish in self.objectives]
        bounded = [id(bound.wish) for bound in self.bounds]
        total = sum(float(term.values[0]) for _, term in terms)
        return [term for wish, term in terms if id(wish) not in bounded], total

    def _row_readings(self, point: Point) -> list[Reading]:
        """Return the numbers of the rows, in their order."""
        readings = [row_reading(one, point) for one in self.constraints]
        return readings + [objective_reading(one, point) for one, _ in self.caps]

    def violation(self, one: DesignEvaluation) -> Float[np.ndarray, " m"]:
        """Return by how much rows are beyond their limits, in their sizes."""
        return violation(one.rows.values, limits_of(self.rows), self.sizes)

    def worst(self, one: DesignEvaluation) -> float:
        """Return the largest violation."""
        return float(np.abs(self.violation(one)).max(initial=0.0))

    def merit(self, one: DesignEvaluation) -> tuple[float, float]:
        """Return the largest violation, 0 within the tolerance, and the sum; less is better."""
        worst = self.worst(one)
        return (worst if worst > TOLERANCE else 0.0), one.total

    @property
    def is_least_squares(self) -> bool:
        """Whether all that is asked is to come near to something."""
        return bool(self.objectives) and not self.rows and all(map(is_square, self.objectives))

    def residuals(self, one: DesignEvaluation) -> Reading:
        """Return what misses limits, in its size; without limits, what is to be 0."""
        if not self.rows:
            tables = [squared(wish, one.point).table for wish in self.objectives]
            return Reading(np.concatenate(tables))
        missed = self.violation(one)
        slopes = np.where(missed[:, None] != 0.0, one.rows.slopes / self.sizes[:, None], 0.0)
        return Reading(np.column_stack([missed, slopes]))

    def set_sizes(self, reached: Sequence[DesignEvaluation]) -> None:
        """Take the sizes of rows without a limit of a size from what robots reach."""
        values = [np.abs(one.rows.values) for one in reached] or [np.zeros(len(self.rows))]
        most = np.max(values, axis=0)
        sizes = np.array([row.size for row in self.rows])
        self.sizes = np.where(sizes > 0.0, sizes, np.where(most > 1e-9, most, 1.0))

    def program(self, first: DesignEvaluation) -> tuple[NonlinearProgram, Vector]:
        """Return the problem for SLSQP, its bounds scaled for where it begins, and that start."""
        extra, end = len(self.bounds), self.count + len(self.bounds)
        factors = np.array([bound.factor for bound in self.bounds])
        pairs = [*zip(self.bounds, first.bounded, strict=True)]
        tops = np.array([b.sign * (b.sign * reading.values).max() for b, reading in pairs])
        sizes = np.array([np.ptp(reading.values) or 1.0 for _, reading in pairs])

        def linearised(y: Vector) -> Linearisation | None:
            is_first = len(first.point.along) and np.array_equal(y[: self.count], first.z)
            one = first if is_first else self.evaluate(y[: self.count])
            if one is None:
                return None
            bounds = tops + sizes * y[self.count :]
            rows = [np.pad(one.rows.table, ((0, 0), (0, extra)))]
            for k, (bound, reading) in enumerate(zip(self.bounds, one.bounded, strict=True)):
                apart = np.pad(-bound.sign * reading.table, ((0, 0), (0, extra)))
                apart[:, 0] += bound.sign * bounds[k]
                apart[:, 1 + self.count + k] = bound.sign * sizes[k]
                rows.append(apart)
            table, total = np.concatenate(rows), one.objective.table[0]
            gradient = np.append(total[1:], factors * sizes)
            value = float(total[0] + factors @ bounds)
            return Linearisation(value, gradient, table[:, 0], table[:, 1:], one)

        numbers = [len(reading.values) for _, reading in pairs]
        above = np.tile([0.0, np.inf], (sum(numbers), 1))
        program = NonlinearProgram(
            linearised,
            np.array([(0.0, 1.0)] * self.count + [(-np.inf, np.inf)] * extra).reshape(end, 2),
            np.concatenate([limits_of(self.rows), above]),
            np.append(self.sizes, np.repeat(sizes, numbers)),
        )
        return program, np.append(first.z, np.zeros(extra))
