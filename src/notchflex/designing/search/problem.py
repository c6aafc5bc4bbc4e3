"""The design as a problem of optimisation: scaled variables, one sum to minimise, constraints.

Variables run from 0 to 1 between their limits. The largest of several numbers is not smooth: where
it is minimised, an epigraph variable above all of them replaces it.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np
from jaxtyping import Float

from notchflex.designing.model.point import Point
from notchflex.designing.model.reading import Reading
from notchflex.designing.model.solver import Solver
from notchflex.designing.model.wishes import Wish
from notchflex.designing.search.rows import (
    Row,
    epigraphs,
    objective_reading,
    row_reading,
    row_sizes,
    rows_of,
    violations,
)
from notchflex.designing.specification.asked import DesignConstraint, DesignObjective
from notchflex.errors import InputError

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
