"""The result of a fit: constants, robots, and how far to trust them.

Model errors, and how a robot was held and photographed, stay much the same through a pull. Rows of
a pull are then not worth as much as their number (Huber 1967; Liang and Zeger 1986).
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np
from jaxtyping import Bool, Float, Int
from scipy.stats import chi2, t

from notchflex import InputError, Robot, Settings
from notchflex.fit.estimation.intervals import (
    LEVEL,
    Cost,
    Interval,
    Minimum,
    Profile,
    allowed_rise,
    unit_free,
)
from notchflex.fit.estimation.objective import Noise
from notchflex.fit.estimation.problem import FitProblem
from notchflex.fit.model.constants import Unknown
from notchflex.fit.model.drawing import deviated
from notchflex.fit.model.residuals import Residuals
from notchflex.support import frame

if TYPE_CHECKING:
    from notchflex.fit.assessment.residual_tests import ResidualTests


@dataclass(frozen=True, eq=False)
class ByPulls:
    """Uncertainty of k constants from the scatter between whole pulls.

    Attributes:
        covariance: Covariance of the constants, (k, k); NaN if fewer than two pulls were measured.
        pulls: Number of pulls that depend on each constant, (k,).
        freedom: Degrees of freedom of its standard deviation by pulls, (k,).
        counts: Whether its 95 % interval is by pulls, which is wider than by rows, (k,).
        wider: Standard deviation of each constant over that by rows where it counts; else 1, (k,).
    """

    covariance: Float[np.ndarray, "k k"]
    pulls: Int[np.ndarray, " k"]
    freedom: Float[np.ndarray, " k"]
    counts: Bool[np.ndarray, " k"]
    wider: Float[np.ndarray, " k"]


def by_pulls(
    cost: Cost,
    pull: Int[np.ndarray, " r"],
    by_rows: Float[np.ndarray, "k k"],
    freedom_of_rows: float,
) -> ByPulls:
    """Estimate the uncertainty of constants at a minimum from the scatter between pulls.

    With the usual factor for few pulls (Cameron and Miller 2015, eq. 12) and Student's t with one
    degree of freedom less than there are pulls; more where priors, which do not scatter, tell much
    (Satterthwaite 1946). `by_rows` is the covariance if all rows were independent.
    """
    labels, which = np.unique(pull, return_inverse=True)
    size = len(by_rows)
    gradients, depends = np.zeros((len(labels), size)), np.zeros((len(labels), size), bool)
    np.add.at(gradients, which, cost.contributions)
    np.logical_or.at(depends, which, cost.residuals.slopes != 0.0)
    pulls = depends.sum(axis=0)
    if len(labels) < 2:
        none = np.zeros(size, bool)
        return ByPulls(np.full((size, size), np.nan), pulls, np.ones(size), none, np.ones(size))
    # Only priors keep the gradients of the pulls from adding up to zero. The same share of each
    # leaves what no pull tells, such as forces and moduli that grow together, out of the scatter.
    gradients -= gradients.mean(axis=0)
    rows = int(cost.contributions.any(axis=1).sum())
    few = np.sqrt(np.maximum(pulls, 1) / np.maximum(pulls - 1, 1))
    few *= np.sqrt(max(rows - 1, 1) / max(rows - size, 1))
    hessian = hessian_of(cost)
    of_pulls = sandwich(hessian, gradients.T @ gradients) * np.outer(few, few)
    covariance = of_pulls + sandwich(hessian, cost.scatter)
    with np.errstate(invalid="ignore", divide="ignore"):
        share = np.diag(covariance) / np.diag(of_pulls)
        freedom = np.nan_to_num(np.maximum(pulls - 1, 1) * share**2, nan=1.0)
        ratio = np.sqrt(np.diag(covariance) / np.diag(by_rows))
        half = t.ppf(0.5 + 0.5 * LEVEL, freedom) / t.ppf(0.5 + 0.5 * LEVEL, freedom_of_rows)
        counts = (pulls > 1) & np.isfinite(ratio) & (half * ratio > 1.0)
    return ByPulls(covariance, pulls, freedom, counts, np.where(counts, ratio, 1.0))


def hessian_of(cost: Cost) -> Float[np.ndarray, "k k"]:
    """Return the second derivatives of an objective."""
    return cost.curvature if cost.hessian is None else cost.hessian


def sandwich(
    hessian: Float[np.ndarray, "k k"], scatter: Float[np.ndarray, "k k"]
) -> Float[np.ndarray, "k k"]:
    """Return the covariance where a gradient of this covariance is zero (Huber 1967)."""
    covariance = inverse_of(hessian)
    is_known = np.isfinite(np.diag(covariance))
    known = np.ix_(is_known, is_known)
    covariance[known] = covariance[known] @ scatter[known] @ covariance[known]
    return covariance


def inverse_of(curvature: Float[np.ndarray, "k k"]) -> Float[np.ndarray, "k k"]:
    """Return the inverse of a curvature; infinite for constants without any."""
    is_known = np.diag(curvature) > 0.0
    inverse = np.diag(np.where(is_known, 0.0, np.inf))
    sizes, plain = unit_free(curvature[np.ix_(is_known, is_known)])
    values, vectors = np.linalg.eigh(plain)
    # A curvature of 0 that rounding made small gives a wide interval, not a narrow one.
    part = (vectors / np.maximum(values, 1e-15)) @ vectors.T
    inverse[np.ix_(is_known, is_known)] = part / np.outer(sizes, sizes)
    return inverse


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
        intervals: 95 % intervals by constant, of `LeastSquares` only; by whole pulls where two or
            more were measured, but never narrower than by independent rows.
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
        """Model less measurement, with what deviates from the drawing (`deviations_of_drawing`)."""
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
        return {
            label: deviated(samples[label].robot_with(self.best.values), label, self.drawing)
            for label in self.given
        }

    @property
    def drawing(self) -> tuple[Unknown, ...]:
        """What deviates from the drawings, starting at what the data tell."""
        total = (self.problem.means + self.reached.deviations).tolist()
        pairs = zip(self.problem.drawing, total, strict=True)
        return tuple(replace(one, start=deviation) for one, deviation in pairs)

    @property
    def deviations_of_drawing(self) -> dict[str, float]:
        """Deviations from the drawing that the data tell, in standard deviations by name."""
        return {one.name: one.start for one in self.drawing}

    @cached_property
    def tests(self) -> ResidualTests | None:
        """Tests of the residuals; None if there are too few, or it is no likelihood."""
        from notchflex.fit.assessment.residual_tests import residual_tests

        return residual_tests(self)

    @property
    def trusted(self) -> bool:
        """Whether the residuals look like noise, and so whether to believe the intervals."""
        return self.tests is None or not self.tests.rejected

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
    def is_robust(self) -> bool:
        """Whether outliers count less: then intervals follow from the scatter of the rows."""
        return getattr(self.problem.objective, "huber", None) is not None

    @property
    def tells_no_noise(self) -> bool:
        """Whether the noise is unknown, and no number is left over to estimate it."""
        return not self.noise.is_known and self.freedom <= 0

    @property
    def reduced_chi_squared(self) -> float:
        """Mean square of residuals over their noise; about 1 if the model is right.

        Of numbers whose noise is known independently of the fit, with what deviates from the
        drawing; NaN if there are none.
        """
        is_known, left = self._known
        if left <= 0:
            return float("nan")
        scaled = self.residuals.values[is_known] / self.noise.deviation[is_known]
        return float(np.sum(scaled**2) + np.sum(self.reached.deviations**2)) / left

    @property
    def _known(self) -> tuple[Bool[np.ndarray, " r"], int]:
        """Numbers with noise known independently of the fit; how many more than constants."""
        is_known = ~self.noise.estimated & np.isfinite(self.noise.deviation)
        return is_known, int(is_known.sum()) - len(self.names)

    @cached_property
    def log_likelihood(self) -> float:
        """Logarithm of the likelihood of the measured numbers; NaN where there is none.

        Of `LeastSquares()` without `huber`. What deviates from the drawing is integrated out, with
        the model linearised; noise that is estimated is the most likely one.
        """
        if not self.is_likelihood or self.is_robust or self.tells_no_noise:
            return float("nan")
        counts = np.isfinite(self.noise.deviation)
        share = np.where(self.noise.estimated, self.freedom / self.counted, 1.0)
        noise = (self.noise.deviation * np.sqrt(share))[counts]
        spread = self.residuals.spread[counts]
        scaled = (self.residuals.values[counts] - spread @ self.reached.deviations) / noise
        spread = spread / noise[:, None]
        inner = np.eye(spread.shape[1]) + spread.T @ spread
        along = spread.T @ scaled
        squares = scaled @ scaled - along @ np.linalg.solve(inner, along)
        sizes = 2.0 * np.log(noise).sum() + np.linalg.slogdet(inner)[1]
        return float(-0.5 * (squares + sizes + len(noise) * np.log(2.0 * np.pi)))

    @property
    def _parameters(self) -> int:
        """Number of constants and of estimated standard deviations."""
        return len(self.names) + len(np.unique(self.residuals.quantity[self.noise.estimated]))

    @property
    def aic(self) -> float:
        """Akaike's criterion (1974): of models fitted to the same data the smallest is the best.

        NaN where there is no likelihood.
        """
        return 2.0 * (self._parameters - self.log_likelihood)

    @property
    def bic(self) -> float:
        """Schwarz's criterion (1978), which counts constants more than `aic` in many data."""
        return self._parameters * float(np.log(self.counted)) - 2.0 * self.log_likelihood

    @property
    def misses(self) -> bool:
        """Whether the model misses the measurements by more than noise can explain."""
        value, (_, left) = self.reduced_chi_squared, self._known
        return bool(value > 1.0 and not self.is_robust and chi2.sf(value * left, left) < _UNLIKELY)

    @property
    def widened(self) -> float:
        """Factor by which intervals are wider than by noise alone, if the model misses more."""
        return float(np.sqrt(self.reduced_chi_squared)) if self.misses else 1.0

    def allowed_rise(self, name: str) -> float:
        """Return the rise of twice the misfit at the ends of the 95 % interval of a constant.

        By whole pulls where they count (`by_pulls`), by the scatter of rows for robust objectives,
        else by the noise; infinite if it is unknown.
        """
        if self.tells_no_noise:
            return float("inf")
        number = self.names.index(name)
        inverse = inverse_of(hessian_of(self.reached))[number, number]
        if np.isfinite(inverse):
            freedom = self._freedom_of_intervals[number]
            half = t.ppf(0.5 + 0.5 * LEVEL, freedom) * self.deviations[name]
            return float(half**2 / inverse)
        return allowed_rise(None) * self.widened**2

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
        return Profile(problem.held, values, self.reached, number, problem.lower, problem.upper)

    @cached_property
    def covariance(self) -> Float[np.ndarray, "k k"]:
        """Covariance of the constants, with the model linearised.

        By rows, or by whole pulls where they count (`by_pulls`). By pulls alone (Huber's sandwich)
        for objectives that are not likelihoods. Infinite if nothing measured depends on a constant,
        or the noise is unknown.
        """
        if not self.is_likelihood:
            return self.by_pulls.covariance
        wider = self.by_pulls.wider
        return self.covariance_by_rows * np.outer(wider, wider)

    @cached_property
    def covariance_by_rows(self) -> Float[np.ndarray, "k k"]:
        """Covariance of the constants if all rows were independent."""
        if self.is_likelihood and self.tells_no_noise:
            return np.diag(np.full(len(self.names), np.inf))
        if self.is_robust:
            contributions = self.reached.contributions
            factor = self.noise.counted / max(self.freedom, 1)
            scatter = factor * contributions.T @ contributions + self.reached.scatter
            return sandwich(hessian_of(self.reached), scatter)
        return inverse_of(self.reached.curvature) * self.widened**2

    @cached_property
    def by_pulls(self) -> ByPulls:
        """Uncertainty of the constants from the scatter between whole pulls.

        Model errors correlate strongly within a pull: rows are not worth as much as their number.
        """
        rows = self.covariance_by_rows
        return by_pulls(self.reached, self.residuals.pull, rows, self._freedom_of_rows)

    @property
    def _freedom_of_rows(self) -> float:
        by_noise = self.noise.is_known and not self.is_robust
        return float("inf") if by_noise else max(self.freedom, 1)

    @property
    def _freedom_of_intervals(self) -> Float[np.ndarray, " k"]:
        return np.where(self.by_pulls.counts, self.by_pulls.freedom, self._freedom_of_rows)

    def half_width(self, slopes: Float[np.ndarray, "r k"]) -> Float[np.ndarray, " r"]:
        """Return half the 95 % interval of numbers from their derivatives by the constants.

        With the model linearised; NaN if it has no end.
        """
        is_known = np.isfinite(np.diag(self.covariance))
        times = t.ppf(0.5 + 0.5 * LEVEL, self._freedom_of_intervals)[is_known]
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

    def to_dataframe(self, library: str = "polars") -> Any:
        """Return a row for each constant: value, unit, ends of the interval, standard deviation.

        That of pandas writes the table for a paper: `to_dataframe("pandas").to_latex()`.

        Args:
            library: "polars" or "pandas".

        Raises:
            InputError: The library is not installed, or there is no such library.
        """
        ends = [self.intervals.get(name) for name in self.names]
        columns = {
            "constant": self.names,
            "value": [*self.values.values()],
            "unit": [*self.units.values()],
            "lower_95": np.array([None if one is None else one.lower for one in ends], float),
            "upper_95": np.array([None if one is None else one.upper for one in ends], float),
            "deviation": [*self.deviations.values()],
        }
        return frame(columns, library)

    def __repr__(self) -> str:
        """Return the constants with their intervals, the errors and the diagnosis on few lines."""
        from notchflex.fit.documents import summary

        return summary(self)

    def _repr_html_(self) -> str:
        """Return the same for a notebook."""
        from html import escape

        return f"<pre>{escape(repr(self))}</pre>"
