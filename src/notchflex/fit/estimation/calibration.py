"""The result of a fit: constants, robots, and how far to trust them."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from jaxtyping import Bool, Float
from scipy.stats import chi2, t

from notchflex.errors import InputError
from notchflex.fit.estimation.covariance import ByPulls, by_pulls, inverse_of
from notchflex.fit.estimation.intervals import LEVEL, Interval, Profile, allowed_rise
from notchflex.fit.estimation.minimise import Cost, Minimum
from notchflex.fit.estimation.noise import Noise
from notchflex.fit.estimation.problem import FitProblem
from notchflex.fit.model.residuals import Residuals
from notchflex.robot import Robot
from notchflex.solver.newton import Settings

# Probability below which noise does not explain the misfit: the model misses something.
_UNLIKELY = 0.01


@dataclass(frozen=True, eq=False, repr=False)
class Calibration:
    """The result of a fit.

    Attributes:
        given: The robots as they were, by label.
        problem: The measurements, the constants and the objective.
        best: Where the best search ended.
        reached: The objective there.
        searches: Where every search ended, the first from the robots as they were.
        intervals: 95 % intervals by constant, of `LeastSquares` only; by whole pulls if these
            differ by more than their rows do.
    """

    given: Mapping[str, Robot]
    problem: FitProblem
    best: Minimum
    reached: Cost
    searches: tuple[Minimum, ...]
    intervals: dict[str, Interval]

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the constants."""
        return tuple(one.name for one in self.problem.unknowns)

    @property
    def values(self) -> dict[str, float]:
        """Fitted values, in the units of the robot file."""
        return dict(zip(self.names, self.best.values.tolist(), strict=True))

    @property
    def units(self) -> dict[str, str]:
        """Units of the values, "" for a pure number."""
        return {one.name: one.unit for one in self.problem.unknowns}

    @property
    def converged(self) -> bool:
        """Whether the best search converged."""
        return self.best.converged

    @property
    def reason(self) -> str:
        """Why it did not, "" if it did."""
        return self.best.reason

    @property
    def cost(self) -> float:
        """The objective reached: half a chi squared, or a sum of norms (deg or mm)."""
        return self.reached.value

    @property
    def residuals(self) -> Residuals:
        """Model less measurement."""
        return self.reached.residuals

    @property
    def noise(self) -> Noise:
        """Standard deviations of the measured numbers."""
        assert self.problem.noise is not None
        return self.problem.noise

    @property
    def settings(self) -> Settings:
        """Settings of the solver."""
        return self.problem.samples.every[0].settings

    @property
    def solves(self) -> int:
        """Number of rows that were solved."""
        return self.problem.samples.solves

    @cached_property
    def robots(self) -> dict[str, Robot]:
        """The robots with the fitted constants."""
        samples = {one.label: one for one in self.problem.samples.every}
        return {label: samples[label].robot_with(self.best.values) for label in self.given}

    @property
    def counted(self) -> int:
        """Number of measured numbers that count.

        A total angle that is the sum of the notches adds nothing to them in least squares.
        """
        return self.noise.counted if self.is_likelihood else len(self.residuals)

    @property
    def freedom(self) -> int:
        """Degrees of freedom: numbers measured less numbers fitted."""
        return self.noise.counted - len(self.names)

    @property
    def is_likelihood(self) -> bool:
        """Whether the objective is a likelihood, and so gives intervals."""
        return self.problem.objective.is_likelihood

    @property
    def tells_no_noise(self) -> bool:
        """Whether the noise is unknown, and no number is left over to estimate it."""
        return not self.noise.is_known and self.freedom <= 0

    @property
    def reduced_chi_squared(self) -> float:
        """Mean square of residuals over their noise; about 1 if the model is right.

        Of numbers whose noise is known independently of the fit; NaN if there are none.
        """
        is_known, left = self._known
        if left <= 0:
            return float("nan")
        scaled = self.residuals.values[is_known] / self.noise.deviation[is_known]
        return float(np.sum(scaled**2)) / left

    @property
    def _known(self) -> tuple[Bool[np.ndarray, " r"], int]:
        """Numbers with noise known independently of the fit; how many more than constants."""
        is_known = ~self.noise.estimated & np.isfinite(self.noise.deviation)
        return is_known, int(is_known.sum()) - len(self.names)

    @property
    def misses(self) -> bool:
        """Whether the model misses the measurements by more than noise can explain."""
        value, (_, left) = self.reduced_chi_squared, self._known
        return bool(value > 1.0 and chi2.sf(value * left, left) < _UNLIKELY)

    @property
    def widened(self) -> float:
        """Factor by which intervals are wider than by noise alone, if the model misses more."""
        return float(np.sqrt(self.reduced_chi_squared)) if self.misses else 1.0

    def allowed_rise(self, name: str) -> float:
        """Return the rise of twice the misfit at the ends of the 95 % interval of a constant.

        By rows, or by whole pulls if these differ by more than their rows do (`by_pulls`);
        infinite if the noise is unknown.
        """
        if self.tells_no_noise:
            return float("inf")
        number = self.names.index(name)
        if self.by_pulls.wider[number] > 1.0:
            return self.by_pulls.rise(number) * self.widened**2
        freedom = None if self.noise.is_known else self.freedom
        return allowed_rise(freedom) * self.widened**2

    def allows(self, name: str, value: float) -> bool:
        """Return whether the 95 % interval of a constant holds a value.

        The other constants are fitted again, as for the interval, whose ends need not be known.

        Args:
            name: The constant.
            value: In the unit of the robot file.

        Raises:
            InputError: There is no such constant, or the objective is not a likelihood.
        """
        if name not in self.names:
            raise InputError.UNKNOWN_NAME(
                f"{name!r} was not fitted; there are {', '.join(self.names)}"
            )
        if not self.is_likelihood:
            raise InputError.UNSUPPORTED(
                "an interval needs LeastSquares(); other objectives are not likelihoods"
            )
        number = self.names.index(name)
        if not self.problem.lower[number] <= value <= self.problem.upper[number]:
            return False
        minimum = self.profile(name).held(value, self.best.values)
        if minimum.cost is None:
            return False
        return 2.0 * (minimum.cost.value - self.cost) <= self.allowed_rise(name)

    def profile(self, name: str) -> Profile:
        """Return the misfit as a function of one constant."""
        problem, number = self.problem, self.names.index(name)
        values = self.best.values
        return Profile(problem, values, self.reached, number, problem.lower, problem.upper)

    @cached_property
    def covariance(self) -> Float[np.ndarray, "k k"]:
        """Covariance of the constants, with the model linearised.

        By rows; wider for constants for which whole pulls differ by more than their rows do
        (`by_pulls`). By pulls alone (Huber's sandwich) for objectives that are not likelihoods.
        Infinite if nothing measured depends on a constant, or the noise is unknown.
        """
        if not self.is_likelihood:
            # What only priors determine does not scatter between pulls.
            inverse = inverse_of(self.reached.curvature)
            scatter = self.problem.scatter_of_priors(self.residuals)
            return self.by_pulls.covariance + (inverse * np.nan_to_num(scatter)) @ inverse
        wider = self.by_pulls.wider
        return self.covariance_by_rows * np.outer(wider, wider)

    @cached_property
    def covariance_by_rows(self) -> Float[np.ndarray, "k k"]:
        """Covariance of the constants if all rows were independent."""
        if self.is_likelihood and self.tells_no_noise:
            return np.diag(np.full(len(self.names), np.inf))
        return inverse_of(self.reached.curvature) * self.widened**2

    @cached_property
    def by_pulls(self) -> ByPulls:
        """Uncertainty of the constants from the scatter between whole pulls.

        Model errors correlate strongly within a pull: rows are not worth as much as their number.
        """
        residuals = self.residuals
        return by_pulls(self.reached, residuals.slopes, residuals.pull, self.covariance_by_rows)

    def half_width(self, slopes: Float[np.ndarray, "r k"]) -> Float[np.ndarray, " r"]:
        """Return half the 95 % interval of numbers from their derivatives by the constants.

        With the model linearised; NaN if it has no end.
        """
        is_known = np.isfinite(np.diag(self.covariance))
        freedom = np.where(self.by_pulls.wider > 1.0, self.by_pulls.pulls - 1, max(self.freedom, 1))
        times = t.ppf(0.5 + 0.5 * LEVEL, freedom)[is_known]
        covariance = self.covariance[np.ix_(is_known, is_known)] * np.outer(times, times)
        variance = np.einsum("ri,ij,rj->r", slopes[:, is_known], covariance, slopes[:, is_known])
        # An unknown constant only matters to numbers that depend on it.
        variance[slopes[:, ~is_known].any(axis=1)] = np.nan
        return np.sqrt(np.maximum(variance, 0.0))

    @property
    def deviations(self) -> dict[str, float]:
        """Standard deviations of the constants, with the model linearised."""
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
