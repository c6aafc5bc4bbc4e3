"""What a fit found: constants, robots, and how far to trust them."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from jaxtyping import Bool, Float
from scipy.stats import chi2, t

from notchflex.errors import InputError
from notchflex.fit.estimation.by_pulls import ByPulls, by_pulls
from notchflex.fit.estimation.curvature import inverse_of
from notchflex.fit.estimation.intervals import LEVEL, Interval, allowed_rise, held
from notchflex.fit.estimation.minimise import Cost, Minimum
from notchflex.fit.estimation.noise import Noise
from notchflex.fit.estimation.problem import Problem
from notchflex.fit.model.residuals import Residuals
from notchflex.robot import Robot

# A misfit this unlikely for the noise that was told means that the model misses something.
_UNLIKELY = 0.01


@dataclass(frozen=True, eq=False, repr=False)
class Calibration:
    """What a fit found.

    Attributes:
        given: The robots as they were, by label.
        problem: What was fitted to what.
        best: Where the best search ended.
        reached: The objective there.
        searches: Where every search ended, the first from the robots as they were.
        intervals: 95 % intervals by constant; of `LeastSquares` only. By whole pulls where these
            differ by more than their rows do.
    """

    given: Mapping[str, Robot]
    problem: Problem
    best: Minimum
    reached: Cost
    searches: tuple[Minimum, ...]
    intervals: dict[str, Interval]

    @property
    def names(self) -> tuple[str, ...]:
        """The constants."""
        return tuple(one.name for one in self.problem.unknowns)

    @property
    def values(self) -> dict[str, float]:
        """What they were found to be, in the units of the robot file."""
        return dict(zip(self.names, self.best.values.tolist(), strict=True))

    @property
    def units(self) -> dict[str, str]:
        """Their units, "" for a pure number."""
        return {one.name: one.unit for one in self.problem.unknowns}

    @property
    def converged(self) -> bool:
        """Whether the best search settled."""
        return self.best.converged

    @property
    def reason(self) -> str:
        """Why it did not, "" where it did."""
        return self.best.reason

    @property
    def cost(self) -> float:
        """The objective that was reached: half a chi squared, or a sum of norms (deg or mm)."""
        return self.reached.value

    @property
    def residuals(self) -> Residuals:
        """Model less measurement."""
        return self.reached.residuals

    @property
    def noise(self) -> Noise:
        """Standard deviations of what was measured."""
        assert self.problem.noise is not None
        return self.problem.noise

    @property
    def solves(self) -> int:
        """How many rows of measurements were solved for all this."""
        return self.problem.samples.solves

    @cached_property
    def robots(self) -> dict[str, Robot]:
        """The robots with the constants that were found."""
        found: dict[str, Robot] = {}
        for sample in self.problem.samples.every:
            if sample.label not in found:
                own = self.best.values[list(sample.columns)]
                found[sample.label] = sample.rows.robot_with(own.tolist())
        return found

    @property
    def counted(self) -> int:
        """How many of the measured numbers count.

        A total angle that is the sum of the notches adds nothing to them in least squares.
        """
        likelihood = self.problem.objective.is_likelihood
        return self.noise.counted if likelihood else len(self.residuals)

    @property
    def freedom(self) -> int:
        """How many more numbers were measured than fitted."""
        return self.noise.counted - len(self.names)

    @property
    def tells_no_noise(self) -> bool:
        """Whether the fit goes through numbers of unknown noise, with none left over to tell it."""
        return not self.noise.is_known and self.freedom <= 0

    @property
    def reduced_chi_squared(self) -> float:
        """Mean square of residuals over their noise; about 1 where the model is right.

        Of numbers whose noise is known otherwise than by the fit; NaN where there are none.
        """
        known, left = self._known
        if left <= 0:
            return float("nan")
        scaled = self.residuals.values[known] / self.noise.deviation[known]
        return float(np.sum(scaled**2)) / left

    @property
    def _known(self) -> tuple[Bool[np.ndarray, " r"], int]:
        """Numbers whose noise is known otherwise than by the fit; how many more than constants."""
        known = ~self.noise.estimated & np.isfinite(self.noise.deviation)
        return known, int(known.sum()) - len(self.names)

    @property
    def misses(self) -> bool:
        """Whether the model misses what was measured by more than noise can explain."""
        value, (_, left) = self.reduced_chi_squared, self._known
        return bool(value > 1.0 and chi2.sf(value * left, left) < _UNLIKELY)

    @property
    def widened(self) -> float:
        """By how much intervals are wider than noise alone makes them: the model misses more."""
        return float(np.sqrt(self.reduced_chi_squared)) if self.misses else 1.0

    def allowed_rise(self, name: str) -> float:
        """By how much twice the misfit may rise in the 95 % interval of a constant.

        By rows, or by whole pulls where these differ by more than their rows do (`by_pulls`).
        Infinite where nothing tells the noise.
        """
        if self.tells_no_noise:
            return float("inf")
        number = self.names.index(name)
        if self.by_pulls.wider[number] > 1.0:
            return self.by_pulls.rise(number) * self.widened**2
        freedom = None if self.noise.is_known else self.freedom
        return allowed_rise(freedom) * self.widened**2

    def allows(self, name: str, value: float) -> bool:
        """Whether the data leave room for a value of a constant: the 95 % interval holds it.

        The others make the best of it, as in the interval, whose ends need not be known.

        Args:
            name: The constant.
            value: In the unit of the robot file.

        Raises:
            InputError: There is no such constant, or the objective is no likelihood.
        """
        if name not in self.names:
            raise InputError.UNKNOWN_NAME(
                f"{name!r} was not fitted; there are {', '.join(self.names)}"
            )
        if not self.problem.objective.is_likelihood:
            raise InputError.UNSUPPORTED(
                "an interval needs LeastSquares(); other objectives are no likelihoods"
            )
        lower, upper = self.problem.lower, self.problem.upper
        number = self.names.index(name)
        if not lower[number] <= value <= upper[number]:
            return False
        found = held(self.problem, self.best.values, number, value, lower, upper)
        return found is not None and 2.0 * (found[1] - self.cost) <= self.allowed_rise(name)

    @cached_property
    def covariance(self) -> Float[np.ndarray, "k k"]:
        """Covariance of the constants, in a straight-line view of the model.

        By rows; wider for constants about which whole pulls differ by more than their rows do
        (`by_pulls`). For objectives that are no likelihood by pulls alone (Huber's sandwich).
        Infinite where nothing measured depends on a constant, or nothing tells the noise.
        """
        if not self.problem.objective.is_likelihood:
            return self.by_pulls.covariance
        wider = self.by_pulls.wider
        return self.covariance_by_rows * np.outer(wider, wider)

    @cached_property
    def covariance_by_rows(self) -> Float[np.ndarray, "k k"]:
        """Covariance of the constants if all rows were independent of each other."""
        if self.problem.objective.is_likelihood and self.tells_no_noise:
            return np.diag(np.full(len(self.names), np.inf))
        return inverse_of(self.reached.curvature) * self.widened**2

    @cached_property
    def by_pulls(self) -> ByPulls:
        """How certain the constants are if whole pulls count, not rows.

        What the model misses is much alike within a pull: rows are not worth as much as their
        number.
        """
        residuals = self.residuals
        return by_pulls(self.reached, residuals.slopes, residuals.pull, self.covariance_by_rows)

    def half_width(self, slopes: Float[np.ndarray, "r k"]) -> Float[np.ndarray, " r"]:
        """Half the 95 % interval of numbers that depend on the constants by some slopes.

        In a straight-line view of the model; NaN where it has no end.
        """
        known = np.isfinite(np.diag(self.covariance))
        freedom = np.where(self.by_pulls.wider > 1.0, self.by_pulls.pulls - 1, max(self.freedom, 1))
        times = t.ppf(0.5 + 0.5 * LEVEL, freedom)[known]
        covariance = self.covariance[np.ix_(known, known)] * np.outer(times, times)
        variance = np.einsum("ri,ij,rj->r", slopes[:, known], covariance, slopes[:, known])
        # A constant that is not known at all only matters where the model depends on it.
        variance[slopes[:, ~known].any(axis=1)] = np.nan
        return np.sqrt(np.maximum(variance, 0.0))

    @property
    def deviations(self) -> dict[str, float]:
        """Standard deviations of the constants, in a straight-line view of the model."""
        return dict(zip(self.names, np.sqrt(np.diag(self.covariance)).tolist(), strict=True))

    @property
    def correlation(self) -> Float[np.ndarray, "k k"]:
        """Correlations of the constants; NaN for one that nothing depends on."""
        size = np.sqrt(np.diag(self.covariance))
        size = np.where(np.isfinite(size), size, np.nan)
        return self.covariance / np.outer(size, size)

    def __repr__(self) -> str:
        """Return the constants with their intervals, the errors and the diagnosis on few lines."""
        from notchflex.fit.summary import summary

        return summary(self)

    def _repr_html_(self) -> str:
        """Return the same for a notebook."""
        from html import escape

        return f"<pre>{escape(repr(self))}</pre>"


__all__ = ["Calibration"]
