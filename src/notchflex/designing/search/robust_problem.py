"""A design of robots made within tolerances: quantiles of limits, and yield, to first order.

A number q whose derivatives by the deviations (each in its standard deviations) are g has the mean
q + g m, with the means m of the deviations, and the standard deviation |g|. A limit holds for a
part of the robots where it is so many standard deviations away from the mean.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np
from jaxtyping import Float
from scipy.special import log_ndtr

from notchflex.designing.model.point import Point
from notchflex.designing.model.reading import Reading
from notchflex.designing.model.wishes import Wish
from notchflex.designing.search.problem import DesignProblem, EpigraphBound, Vector
from notchflex.designing.search.rows import Row, row_reading, rows_of

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
