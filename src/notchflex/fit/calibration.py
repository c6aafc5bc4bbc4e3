"""What a fit found: constants, robots, and how far to trust them."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from jaxtyping import Bool, Float
from scipy.stats import chi2

from notchflex.errors import InputError
from notchflex.fit.curvature import unit_free
from notchflex.fit.intervals import Interval, allowed_rise, held
from notchflex.fit.minimise import Cost, Minimum
from notchflex.fit.noise import Noise
from notchflex.fit.problem import Problem
from notchflex.fit.residuals import Residuals
from notchflex.robot import Robot

# A misfit this unlikely for the noise that was told means that the model misses something.
_UNLIKELY = 0.01


@dataclass(frozen=True, eq=False)
class Calibration:
    """What a fit found.

    Attributes:
        given: The robots as they were, by label.
        problem: What was fitted to what.
        best: Where the best search ended.
        reached: The objective there.
        searches: Where every search ended, the first from the robots as they were.
        intervals: 95 % intervals by constant; of `LeastSquares` only.
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

    @property
    def allowed_rise(self) -> float:
        """By how much twice the misfit may rise in a 95 % interval; infinite for unknown noise."""
        if self.tells_no_noise:
            return float("inf")
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
            raise InputError(f"{name!r} was not fitted; there are {', '.join(self.names)}")
        if not self.problem.objective.is_likelihood:
            raise InputError(
                "an interval needs LeastSquares(); other objectives are no likelihoods"
            )
        lower, upper = self.problem.lower, self.problem.upper
        number = self.names.index(name)
        if not lower[number] <= value <= upper[number]:
            return False
        found = held(self.problem, self.best.values, number, value, lower, upper)
        return found is not None and 2.0 * (found[1] - self.cost) <= self.allowed_rise

    @cached_property
    def covariance(self) -> Float[np.ndarray, "k k"]:
        """Covariance of the constants, in a straight-line view of the model.

        Infinite where nothing measured depends on a constant, or nothing tells the noise. For
        objectives that are no likelihood, and nowhere else, from how unlike the pulls are (Huber's
        sandwich by pulls).
        """
        if self.problem.objective.is_likelihood and self.tells_no_noise:
            return np.diag(np.full(len(self.names), np.inf))
        inverse = _inverse(self.reached.curvature)
        if self.problem.objective.is_likelihood:
            return inverse * self.widened**2
        return self.covariance_by_pulls

    @cached_property
    def covariance_by_pulls(self) -> Float[np.ndarray, "k k"]:
        """Covariance from how unlike the pulls are, whatever the noise of a row (Huber 1967).

        What the model misses is much alike within a pull: rows are not worth as much as their
        number. NaN where there are fewer pulls than constants and one more.
        """
        cost = self.reached
        pull = self.residuals.pull
        pulls = np.unique(pull)
        if len(pulls) <= len(self.names):
            return np.full((len(self.names),) * 2, np.nan)
        shares = np.stack([cost.shares[pull == one].sum(axis=0) for one in pulls])
        inverse = _inverse(cost.curvature)
        with np.errstate(invalid="ignore"):
            middle = shares.T @ shares * len(pulls) / (len(pulls) - len(self.names))
            return inverse @ middle @ inverse

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


def _inverse(curvature: Float[np.ndarray, "k k"]) -> Float[np.ndarray, "k k"]:
    """The inverse; infinite for what has no curvature at all."""
    known = np.diag(curvature) > 0.0
    found = np.diag(np.where(known, 0.0, np.inf))
    plain = unit_free(curvature[np.ix_(known, known)])
    values, vectors = np.linalg.eigh(plain.curvature)
    # What rounding makes of no curvature at all is a very wide interval, not a narrow one.
    own = (vectors / np.maximum(values, 1e-15)) @ vectors.T
    found[np.ix_(known, known)] = own / np.outer(plain.size, plain.size)
    return found


__all__ = ["Calibration"]
