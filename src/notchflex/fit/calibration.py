"""The result of a fit: constants, robots, and how far to trust them.

Intervals are by profile likelihood (Venzon and Moolgavkar 1988): their ends are where the least
misfit with one constant held has risen by as much as chance allows. No linear estimate is shown as
an interval.

Model errors, and how a robot was held and photographed, stay much the same through a pull. Rows of
a pull are then not worth as much as their number (Huber 1967; Liang and Zeger 1986).
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from jaxtyping import Bool, Float, Int
from scipy.optimize import brentq
from scipy.stats import chi2, t

from notchflex import InputError, Robot, Settings
from notchflex.fit.constants import Unknown, values_set, with_numbers
from notchflex.fit.objective import Cost, Noise, Vector
from notchflex.fit.residuals import Residuals
from notchflex.fit.search import FitProblem, Minimum, unit_free
from notchflex.support import frame

if TYPE_CHECKING:
    from notchflex.fit.residual_tests import ResidualTests

Matrix = Float[np.ndarray, "k k"]

LEVEL = 0.95
"""Probability of intervals."""
NO_SOLUTION = "the model has no solution that far"
"""Why an end is open that the data may well set."""

# How near the root of the rise must be to its target (of about 2); farther on than this part of it
# the root is no line.
_CLOSE, _STEEP = 0.005, 4.0
# So many estimated half-widths away the data still set no end.
_MAX_HALF_WIDTHS = 50.0
# Probability below which noise does not explain the misfit: the model misses something.
_UNLIKELY = 0.01


@dataclass(frozen=True)
class Interval:
    """Interval of a constant.

    Attributes:
        lower: Lower end; None if the data set none.
        upper: Upper end; None if the data set none.
        profile: Values of the constant and the rise of twice the misfit there, as tried, in
            the order of the values, with the estimate, (m, 2).
        reason: Why an end is open, "" if none is.
    """

    lower: float | None
    upper: float | None
    profile: Float[np.ndarray, "m 2"]
    reason: str = ""


@dataclass(frozen=True, eq=False, repr=False)
class Profile:
    """The misfit about its minimum, as a function of one constant.

    Attributes:
        problem: The misfit as a function of all constants.
        best: Its minimum.
        number: Number of the constant.
    """

    problem: FitProblem
    best: Minimum
    number: int

    def held(self, value: float, start: Vector) -> Minimum:
        """Return the minimum with the constant held at a value, searched from a start."""
        return self.problem.held(self.number, value, start)

    def interval(self, *, rise: float, scale: float) -> Interval:
        """Return the interval for an allowed rise of twice the misfit.

        `scale` is a typical size of the constant's changes, if its curvature gives none.
        """
        points = {float(self.best.values[self.number]): 0.0}
        ends: list[float | None] = []
        reasons: dict[str, None] = {}
        for side, limits in (("below", self.problem.lower), ("above", self.problem.upper)):
            limit = float(limits[self.number])
            end, reason = self._end(limit, side, rise, scale, points)
            ends.append(end)
            if end is None:
                at = f" (limit {limit:.6g})" if np.isfinite(limit) else ""
                reasons[reason or f"nothing in the data holds it from {side}{at}"] = None
        return Interval(ends[0], ends[1], np.array(sorted(points.items())), "; ".join(reasons))

    def _end(
        self, limit: float, side: str, rise: float, scale: float, points: dict[float, float]
    ) -> tuple[float | None, str]:
        """One end of the interval: where the root of the rise, nearly linear, meets its target."""
        best, estimate = reached(self.best), float(self.best.values[self.number])
        sizes, plain = unit_free(best.curvature)
        inverse = np.linalg.pinv(plain, rcond=1e-10, hermitian=True)
        deviation = np.sqrt(max(inverse[self.number, self.number], 1e-12)) / sizes[self.number]
        target, most, sign = np.sqrt(rise), abs(limit - estimate), 1.0 if side == "above" else -1.0
        guess = min(target * deviation, _MAX_HALF_WIDTHS * scale)
        farthest = min(most, _MAX_HALF_WIDTHS * max(scale, guess))
        roots, start = {0.0: 0.0}, self.best.values

        def excess(reach: float) -> float:
            nonlocal start
            if reach not in roots:
                value = limit if reach == most else float(estimate + sign * reach)
                minimum = self.held(value, start)
                roots[reach] = np.inf  # without a robot, or a solution, the end must be nearer
                if minimum.cost is not None:
                    start = minimum.values
                    points[value] = max(2.0 * (minimum.cost.value - best.value), 0.0)
                    roots[reach] = np.sqrt(points[value])
            off = min(roots[reach], _STEEP * target) - target
            return off if abs(off) > _CLOSE * target else 0.0

        inner, reach = 0.0, min(guess, farthest)
        while excess(reach) < 0.0:
            if reach == farthest:
                return None, ""
            inner, growth = reach, 1.1 * target / max(roots[reach], 1e-300)
            reach = min(reach * min(max(growth, 1.2), 4.0), farthest)
        end: Any = brentq(excess, inner, reach, xtol=0.5 * _CLOSE * reach)
        reach = float(end)
        if not any(target * (1.0 - _CLOSE) <= root < np.inf for root in roots.values()):
            return None, NO_SOLUTION
        return limit if reach == most else float(estimate + sign * reach), ""


class ByPulls(NamedTuple):
    """Uncertainty of k constants from the scatter between whole pulls.

    Attributes:
        covariance: Covariance of the constants, (k, k); NaN if fewer than two pulls were measured.
        pulls: Number of pulls that depend on each constant, (k,).
        freedom: Degrees of freedom of its standard deviation by pulls, (k,).
        counts: Whether its 95 % interval is by pulls, which is wider than by rows, (k,).
        wider: Standard deviation of each constant over that by rows where it counts; else 1, (k,).
    """

    covariance: Matrix
    pulls: Int[np.ndarray, " k"]
    freedom: Vector
    counts: Bool[np.ndarray, " k"]
    wider: Vector


def reached(minimum: Minimum) -> Cost:
    """Return the objective at a minimum that was found."""
    assert minimum.cost is not None
    return minimum.cost


def sandwich(hessian: Matrix, scatter: Matrix | float) -> Matrix:
    """Return the covariance where a gradient of this covariance is zero (Huber 1967)."""
    covariance = inverse_of(hessian)
    is_known = np.isfinite(np.diag(covariance))
    known = np.ix_(is_known, is_known)
    scatter = np.broadcast_to(scatter, hessian.shape)
    covariance[known] = covariance[known] @ scatter[known] @ covariance[known]
    return covariance


def inverse_of(curvature: Matrix) -> Matrix:
    """Return the inverse of a curvature; infinite for constants without any."""
    is_known = np.diag(curvature) > 0.0
    known = np.ix_(is_known, is_known)
    inverse = np.diag(np.where(is_known, 0.0, np.inf))
    sizes, plain = unit_free(curvature[known])
    values, vectors = np.linalg.eigh(plain)
    # A curvature of 0 that rounding made small gives a wide interval, not a narrow one.
    inverse[known] = (vectors / np.maximum(values, 1e-15)) @ vectors.T / np.outer(sizes, sizes)
    return inverse


def quantile(freedom: Any) -> Any:
    """Return half an interval in standard deviations (Student's t)."""
    return t.ppf(0.5 + 0.5 * LEVEL, freedom)


@dataclass(frozen=True, eq=False, repr=False)
class Calibration:
    """The result of a fit.

    Attributes:
        given: The robots as they were, by label.
        problem: The measurements, the constants and the objective.
        best: Where the best search ended.
        searches: Where every search ended, the first from the robots as they were.
        intervals: 95 % intervals by constant, of `LeastSquares` only; by whole pulls where two or
            more were measured, but never narrower than by independent rows.
    """

    given: Mapping[str, Robot]
    problem: FitProblem
    best: Minimum
    searches: tuple[Minimum, ...]
    intervals: dict[str, Interval]

    @property
    def reached(self) -> Cost:
        """The objective at the best values."""
        return reached(self.best)

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the constants."""
        return tuple(unknown.name for unknown in self.problem.unknowns)

    @property
    def values(self) -> dict[str, float]:
        """Fitted values, in the units of the robot file."""
        return self._by_name(self.estimate)

    @property
    def estimate(self) -> Vector:
        """The same in the order of `names`, (k,)."""
        return self.best.values[: len(self.names)]

    def _by_name(self, values: Vector) -> dict[str, float]:
        return dict(zip(self.names, values.tolist(), strict=True))

    @property
    def units(self) -> dict[str, str]:
        """Units of the values, "" for a pure number."""
        return {unknown.name: unknown.unit for unknown in self.problem.unknowns}

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
        varied, values = self.problem.varied, self.best.values
        return {
            label: with_numbers(robot, values_set(label, varied, values))
            for label, robot in self.problem.samples.robots.items()
        }

    @property
    def drawing(self) -> tuple[Unknown, ...]:
        """What deviates from the drawings, starting at what the data tell."""
        deviations = self.best.values[len(self.names) :].tolist()
        pairs = zip(self.problem.drawing, deviations, strict=True)
        return tuple(replace(unknown, start=deviation) for unknown, deviation in pairs)

    @property
    def _unlikely(self) -> Vector:
        """Deviations from the drawing less their means."""
        means = [unknown.prior[0] for unknown in self.drawing if unknown.prior is not None]
        return self.best.values[len(self.names) :] - means

    @property
    def deviations_of_drawing(self) -> dict[str, float]:
        """Deviations from the drawing that the data tell, in standard deviations by name."""
        return {deviation.name: deviation.start for deviation in self.drawing}

    @cached_property
    def tests(self) -> ResidualTests | None:
        """Tests of the residuals; None if there are too few, or it is no likelihood."""
        from notchflex.fit.residual_tests import residual_tests

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

    @cached_property
    def freedom(self) -> float:
        """Degrees of freedom: numbers measured less numbers fitted.

        What deviates from the drawing counts by the part that the data tell of it.
        """
        return self.noise.counted - self.problem.fitted(self.residuals)

    @property
    def is_likelihood(self) -> bool:
        """Whether the objective is a likelihood, and so gives intervals."""
        return self.problem.objective.is_likelihood

    @property
    def huber(self) -> float | None:
        """From where on residuals count less: then intervals follow from the scatter of rows."""
        return getattr(self.problem.objective, "huber", None)

    @property
    def tells_no_noise(self) -> bool:
        """Whether the noise is unknown, and no number is left over to estimate it."""
        return not self.noise.is_known and self.freedom < 1.0

    @property
    def reduced_chi_squared(self) -> float:
        """Mean square of residuals over their noise; about 1 if the model is right.

        Of numbers whose noise is known independently of the fit, with what deviates from the
        drawing; NaN if there are none.
        """
        is_known = ~self.noise.estimated & np.isfinite(self.noise.deviation)
        scaled = self.residuals.values[is_known] / self.noise.deviation[is_known]
        squares = np.sum(scaled**2) + np.sum(self._unlikely**2)
        return float(squares) / self._left if self._left > 0 else float("nan")

    @property
    def _left(self) -> int:
        """Numbers whose noise is known independently of the fit, less the constants."""
        is_known = ~self.noise.estimated & np.isfinite(self.noise.deviation)
        return int(is_known.sum()) - len(self.names)

    @cached_property
    def log_likelihood(self) -> float:
        """Logarithm of the likelihood of the measured numbers; NaN where there is none.

        Of `LeastSquares()` without `huber`. What deviates from the drawing is integrated out, with
        the model linearised; noise that is estimated is the most likely one.
        """
        if not self.is_likelihood or self.huber or self.tells_no_noise:
            return float("nan")
        counts = np.isfinite(self.noise.deviation)
        share = np.where(self.noise.estimated, self.freedom / self.counted, 1.0)
        noise = (self.noise.deviation * np.sqrt(share))[counts]
        spread = self.residuals.slopes[counts, len(self.names) :]
        scaled = (self.residuals.values[counts] - spread @ self._unlikely) / noise
        spread = spread / noise[:, None]
        inner = np.eye(spread.shape[1]) + spread.T @ spread
        along = spread.T @ scaled
        squares = scaled @ scaled - along @ np.linalg.solve(inner, along)
        sizes = np.log(2.0 * np.pi * noise**2).sum() + np.linalg.slogdet(inner)[1]
        return float(-0.5 * (squares + sizes))

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
        value, left = self.reduced_chi_squared, self._left
        return bool(value > 1.0 and not self.huber and chi2.sf(value * left, left) < _UNLIKELY)

    @property
    def widened(self) -> float:
        """Factor by which intervals are wider than by noise alone, if the model misses more."""
        return float(np.sqrt(self.reduced_chi_squared)) if self.misses else 1.0

    def number_of(self, name: str) -> int:
        """Return the number of a constant.

        Raises:
            InputError: There is no such constant.
        """
        if name not in self.names:
            raise InputError.UNKNOWN_NAME(
                f"{name} was not fitted; there are {', '.join(self.names)}"
            )
        return self.names.index(name)

    def allowed_rise(self, name: str) -> float:
        """Return the rise of twice the misfit at the ends of the 95 % interval of a constant.

        By whole pulls where they count (`by_pulls`), by the scatter of rows for robust objectives,
        else by the noise; infinite if it is unknown.
        """
        if self.tells_no_noise:
            return float("inf")
        number = self.number_of(name)
        inverse = inverse_of(self.reached.second_derivatives)[number, number]
        if np.isfinite(inverse):
            half = quantile(self._freedom_of_intervals[number]) * self.deviations[name]
            return float(half**2 / inverse)
        return float(chi2.ppf(LEVEL, 1)) * self.widened**2

    def allows(self, name: str, value: float) -> bool:
        """Return whether the 95 % interval of a constant holds a value.

        The other constants are fitted again, as for the interval, whose ends need not be known.

        Args:
            name: The constant.
            value: In the unit of the robot file.

        Raises:
            InputError: There is no such constant, or the objective is not a likelihood.
        """
        number = self.number_of(name)
        if not self.is_likelihood:
            raise InputError.UNSUPPORTED(
                "an interval needs LeastSquares(); other objectives are not likelihoods"
            )
        if not self.problem.lower[number] <= value <= self.problem.upper[number]:
            return False
        cost = self.profile(name).held(value, self.best.values).cost
        return cost is not None and 2.0 * (cost.value - self.cost) <= self.allowed_rise(name)

    def profile(self, name: str) -> Profile:
        """Return the misfit as a function of one constant."""
        return Profile(self.problem, self.best, self.number_of(name))

    @cached_property
    def covariance(self) -> Matrix:
        """Covariance of the constants, with the model linearised.

        By rows, or by whole pulls where they count (`by_pulls`). By pulls alone (Huber's sandwich)
        for objectives that are not likelihoods. Infinite if nothing measured depends on a constant,
        or the noise is unknown.
        """
        return self._of_constants(self._covariance_with_drawing)

    @cached_property
    def _covariance_with_drawing(self) -> Matrix:
        if not self.is_likelihood:
            return self.by_pulls.covariance
        wider = np.ones(len(self.best.values))
        wider[: len(self.names)] = self.by_pulls.wider
        return self.covariance_of_all * np.outer(wider, wider)

    @property
    def covariance_by_rows(self) -> Matrix:
        """Covariance of the constants if all rows were independent."""
        return self._of_constants(self.covariance_of_all)

    @cached_property
    def covariance_of_all(self) -> Matrix:
        """The same with what deviates from the drawing; infinite if the noise is unknown."""
        if self.is_likelihood and self.tells_no_noise:
            return np.diag(np.full(len(self.best.values), np.inf))
        if self.huber:
            contributions = self.reached.contributions
            factor = self.noise.counted / max(self.freedom, 1)
            scatter = factor * contributions.T @ contributions + self.reached.scatter
            return sandwich(self.reached.second_derivatives, scatter)
        return inverse_of(self.reached.curvature) * self.widened**2

    def _of_constants(self, covariance: Matrix) -> Matrix:
        """Covariance of the constants, whatever deviates from the drawing."""
        size = len(self.names)
        return covariance[:size, :size]

    @cached_property
    def by_pulls(self) -> ByPulls:
        """Uncertainty of the constants from the scatter between whole pulls.

        Model errors correlate strongly within a pull: rows are not worth as much as their number.
        With the usual factor for few pulls (Cameron and Miller 2015, eq. 12) and Student's t with
        one degree of freedom less than there are pulls; more where priors, which do not scatter,
        tell much (Satterthwaite 1946).
        """
        cost, size = self.reached, len(self.names)
        labels, pull = np.unique(self.residuals.pull, return_inverse=True)
        gradients, depends = np.zeros((2, len(labels), len(self.best.values)))
        np.add.at(gradients, pull, cost.contributions)
        np.logical_or.at(depends, pull, self.residuals.slopes != 0.0)
        pulls = depends.sum(axis=0).astype(int)[:size]
        # Only priors keep the gradients of the pulls from adding up to zero. The same share of each
        # leaves what no pull tells, such as forces and moduli that grow together, out of the
        # scatter.
        gradients -= gradients.mean(axis=0)
        rows = int(cost.contributions.any(axis=1).sum())
        few = np.sqrt(np.maximum(pulls, 1) / np.maximum(pulls - 1, 1))
        few *= np.sqrt(max(rows - 1, 1) / max(rows - size, 1))
        hessian = cost.second_derivatives
        of_pulls, of_priors = (
            self._of_constants(sandwich(hessian, scatter))
            for scatter in (gradients.T @ gradients, cost.scatter)
        )
        of_pulls *= np.outer(few, few)
        covariance = of_pulls + of_priors if len(labels) > 1 else np.nan * of_pulls
        with np.errstate(invalid="ignore", divide="ignore"):
            share = np.diag(covariance) / np.diag(of_pulls)
            freedom = np.nan_to_num(np.maximum(pulls - 1, 1) * share**2, nan=1.0)
            ratio = np.sqrt(np.diag(covariance) / np.diag(self.covariance_by_rows))
            wider = quantile(freedom) / quantile(self._freedom_of_rows) * ratio
            counts = (pulls > 1) & np.isfinite(ratio) & (wider > 1.0)
        return ByPulls(covariance, pulls, freedom, counts, np.where(counts, ratio, 1.0))

    @property
    def _freedom_of_rows(self) -> float:
        by_noise = self.noise.is_known and not self.huber
        return float("inf") if by_noise else max(self.freedom, 1)

    @property
    def _freedom_of_intervals(self) -> Vector:
        return np.where(self.by_pulls.counts, self.by_pulls.freedom, self._freedom_of_rows)

    def half_width(self, slopes: Float[np.ndarray, "r k"]) -> Float[np.ndarray, " r"]:
        """Return half the 95 % interval of numbers from their derivatives by the constants.

        Derivatives by what deviates from the drawing may follow. With the model linearised; NaN if
        it has no end.
        """
        size = slopes.shape[1]
        freedom = np.full(size, self._freedom_of_rows)
        freedom[: len(self.names)] = self._freedom_of_intervals
        covariance = self._covariance_with_drawing[:size, :size]
        is_known = np.isfinite(np.diag(covariance))
        times = quantile(freedom)[is_known]
        covariance = covariance[np.ix_(is_known, is_known)] * np.outer(times, times)
        variance = np.einsum("ri,ij,rj->r", slopes[:, is_known], covariance, slopes[:, is_known])
        # An unknown constant only matters to numbers that depend on it.
        variance[slopes[:, ~is_known].any(axis=1)] = np.nan
        return np.sqrt(np.maximum(variance, 0.0))

    @property
    def deviations(self) -> dict[str, float]:
        """Standard deviations of the constants, with the model linearised."""
        return self._by_name(np.sqrt(np.diag(self.covariance)))

    @property
    def correlation(self) -> Matrix:
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
            "lower_95": np.array([interval and interval.lower for interval in ends], float),
            "upper_95": np.array([interval and interval.upper for interval in ends], float),
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
