"""Objectives of a fit: squares over the noise, or the sums of norms of the papers; the noise."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any, ClassVar, NamedTuple, Protocol

import numpy as np
from jaxtyping import Float
from scipy.stats import norm

from notchflex import InputError
from notchflex.fit.measurements.measurements import (
    MEASURED,
    OBSERVED,
    Flags,
    Integers,
    Numbers,
)
from notchflex.fit.measurements.repeats import repeats
from notchflex.fit.residuals import Residuals, Samples

Vector = Float[np.ndarray, " k"]

# Standard deviations to begin with if nothing is known, rad, mm and N by unit.
_FIRST_NOISE = {"deg": float(np.radians(1.0)), "mm": 0.1, "N": 0.01}
# Nothing is measured better than this part of that: else an exact fit would have no noise at all,
# and rounding would hide what only the tolerances of the drawing tell.
_LEAST_NOISE = 1e-5


class Cost(NamedTuple):
    """An objective at some values.

    Attributes:
        value: Its value, 0 or more.
        gradient: Its derivatives.
        curvature: Approximate second derivatives, positive semidefinite.
        residuals: The residuals it is made of.
        contributions: What each residual adds to the gradient.
        scatter: Covariance of the gradient that priors stand for.
        hessian: Second derivatives, if they are known better than `curvature`.
    """

    value: float
    gradient: Vector
    curvature: Float[np.ndarray, "k k"]
    residuals: Any = None
    contributions: Numbers = np.zeros((0, 0))
    scatter: Any = 0.0
    hessian: Any = None

    @property
    def second_derivatives(self) -> Float[np.ndarray, "k k"]:
        """The second derivatives, as well as they are known."""
        return self.curvature if self.hessian is None else self.hessian

    def with_prior(self, number: int, off: float, deviation: float, weight: float) -> Cost:
        """Add the square of a constant's distance from its mean, as one more measurement."""
        unit = np.eye(len(self.gradient))[number]
        more = weight / deviation**2 * np.outer(unit, unit)
        return self._replace(
            value=self.value + 0.5 * weight * (off / deviation) ** 2,
            gradient=self.gradient + more[number] * off,
            curvature=self.curvature + more,
            scatter=self.scatter + weight * more,
            hessian=None if self.hessian is None else self.hessian + more,
        )


class FitObjective(Protocol):
    """The objective of a fit; a value such as `LeastSquares()`."""

    is_likelihood: ClassVar[bool]
    """Whether it is minus the logarithm of a likelihood, so that it gives intervals."""

    def check(self, quantities: tuple[str, ...]) -> None:
        """Raise InputError if it cannot be made of these quantities."""
        ...

    takes_priors: ClassVar[bool]
    """Whether a prior may be added to it."""

    def weight_of_one(self, residuals: Residuals, noise: Numbers) -> float:
        """Return what half the square of a residual over its noise adds to the value."""
        ...

    def cost(self, residuals: Residuals, noise: Numbers) -> Cost:
        """Return value, gradient and curvature."""
        ...


@dataclass(frozen=True)
class LeastSquares:
    """Half the sum of squared residuals over their noise (Gaussian noise).

    Args:
        huber: Residuals beyond this number of standard deviations count linearly, not by their
            square (Huber 1964), which limits the weight of outliers; by default none do.

    Example:
        >>> LeastSquares(huber=1.5).is_likelihood
        True
    """

    huber: float | None = None
    is_likelihood: ClassVar[bool] = True
    takes_priors: ClassVar[bool] = True

    def __post_init__(self) -> None:
        """Check the number."""
        if self.huber is not None and not 0.0 < self.huber < np.inf:
            raise InputError.OUT_OF_RANGE(f"huber must be above 0, about 1.5; got {self.huber}")

    def check(self, quantities: tuple[str, ...]) -> None:
        """Accept every quantity."""

    def weight_of_one(self, residuals: Residuals, noise: Numbers) -> float:
        """Return 1: it is a sum of such halves."""
        return 1.0

    def cost(self, residuals: Residuals, noise: Numbers) -> Cost:
        """Return half the sum of squares, or of Huber's function."""
        slopes, scaled = residuals.slopes / noise[:, None], residuals.values / noise
        most, size = self.huber or np.inf, np.abs(scaled)
        clipped = np.clip(scaled, -most, most)
        # Weights with which squares are Huber's function (Holland and Welsch 1977).
        weight = np.minimum(1.0, most / np.maximum(size, 1e-300))
        return Cost(
            float(np.sum(np.abs(clipped) * (size - 0.5 * np.abs(clipped)))),
            slopes.T @ clipped,
            (slopes * weight[:, None]).T @ slopes,
            residuals,
            slopes * clipped[:, None],
            hessian=slopes[size <= most].T @ slopes[size <= most],
        )


class _SumOfNorms:
    """The sum over groups of the norm of their residuals, in a unit."""

    is_likelihood: ClassVar[bool] = False
    _unit: ClassVar[str]

    def check(self, quantities: tuple[str, ...]) -> None:
        """Raise InputError unless all quantities have the unit, and are no vectors of angles."""
        for name in quantities:
            if MEASURED[name].unit != self._unit or name == "tip_rotation":
                what = "angles" if self._unit == "deg" else "distances of points"
                raise InputError.UNSUPPORTED(
                    f"{type(self).__name__} adds {what}; {name} was measured too. Leave it out of "
                    "the file, or use LeastSquares()"
                )


@dataclass(frozen=True)
class SumOfRobotErrors(_SumOfNorms):
    """Sum over all robots of the norm of their root-mean-square errors, deg (Pacheco 2021, eq. 17).

    Each robot adds the 2-norm of the vector of errors of its notches and of its total angle. A
    prior counts as one more reading that is off by as many standard deviations of its noise: at
    residuals as large as the noise, half a squared deviation adds noise / (rows * root of the
    angles in a row) degrees, the mean over the robots.

    Example:
        >>> SumOfRobotErrors().is_likelihood
        False
    """

    takes_priors: ClassVar[bool] = True
    _unit: ClassVar[str] = "deg"

    def weight_of_one(self, residuals: Residuals, noise: Numbers) -> float:
        """Return the mean over the robots where residuals are as large as the noise, deg."""
        weights: list[float] = []
        for robot in np.unique(residuals.robot):
            counted = (residuals.robot == robot) & np.isfinite(noise)
            size = np.sqrt(np.mean(noise[counted] ** 2))
            weights.append(size / np.sqrt(residuals.rows[counted][0] * counted.sum()))
        return float(np.degrees(np.mean(weights)))

    def cost(self, residuals: Residuals, noise: Numbers) -> Cost:
        """Return the sum of norms, a group per robot, each over the root of its number of rows."""
        factor = np.degrees(1.0) / np.sqrt(residuals.rows)
        return _sum_of_norms(residuals, residuals.robot, factor)


@dataclass(frozen=True)
class SumOfDistances(_SumOfNorms):
    """Sum of distances between measured and modelled points, mm (Gao 2017, eq. 27).

    Example:
        >>> SumOfDistances().is_likelihood
        False
    """

    takes_priors: ClassVar[bool] = False
    _unit: ClassVar[str] = "mm"

    def weight_of_one(self, residuals: Residuals, noise: Numbers) -> float:
        """Return 0: it takes no priors."""
        return 0.0

    def cost(self, residuals: Residuals, noise: Numbers) -> Cost:
        """Return the sum of norms, a group per point."""
        return _sum_of_norms(residuals, residuals.point, np.ones(len(residuals)))


def _sum_of_norms(residuals: Residuals, group: Integers, factor: Numbers) -> Cost:
    """The sum over groups of the norm of their residuals.

    The curvature is that of linear residuals: of a norm n = |r| it is J^T (1 - r r^T / n^2) J / n,
    positive semidefinite.
    """
    values, slopes = residuals.values * factor, residuals.slopes * factor[:, None]
    norms = np.sqrt(np.bincount(group, values**2))
    divisor = np.maximum(norms, 1e-12)
    weighted = slopes / divisor[group][:, None]
    contributions = weighted * values[:, None]
    along = np.zeros((len(norms), slopes.shape[1]))
    np.add.at(along, group, contributions)
    curvature = weighted.T @ slopes - (along / divisor[:, None]).T @ along
    gradient = contributions.sum(axis=0)
    return Cost(float(norms.sum()), gradient, curvature, residuals, contributions)


@dataclass(frozen=True)
class Noise:
    """Standard deviations of all measured numbers.

    Attributes:
        deviation: Standard deviation of every number (rad, mm, N), (R,).
        estimated: Whether it is estimated from the residuals of the fit, (R,).
        source: By number of the measurements and quantity: "given", "repeats", "fit", or "sum of
            the notches" of a total angle that adds nothing to the notches; its deviation is
            infinite.
    """

    deviation: Numbers
    estimated: Flags
    source: dict[tuple[int, str], str]

    @property
    def counted(self) -> int:
        """How many of the numbers count."""
        return int(np.isfinite(self.deviation).sum())

    @property
    def is_known(self) -> bool:
        """Whether none of them is estimated from the residuals."""
        return not self.estimated.any()


def first_noise(samples: Samples, residuals: Residuals) -> Noise:
    """Return standard deviations as given, or of repeats; a first guess if there are neither."""
    noise = Noise(residuals.given.copy(), np.zeros(len(residuals), bool), {})
    for number, sample in enumerate(samples.every):
        for name, between_repeats in repeats(sample.measured).items():
            mine = residuals.of(number, name)
            missing = mine & ~(noise.deviation > 0.0)
            if sample.measured.is_sum(name):
                source, missing, size = "sum of the notches", mine, np.inf
            elif not missing.any():
                source, size = "given", np.nan
            elif 0.0 < between_repeats < np.inf:
                source, size = "repeats", between_repeats
            else:
                source, size = "fit", _FIRST_NOISE[MEASURED[name].unit]
                noise.estimated[missing] = True
            noise.deviation[missing] = size
            noise.source[number, name] = source
    return noise


def noise_left(noise: Noise, residuals: Residuals, fitted: float, *, robust: bool) -> Noise:
    """Return the noise with the unknown standard deviations estimated from the residuals.

    By quantity: root mean squares over the degrees of freedom that the numbers fitted leave; for
    robust objectives from the median of absolute values, as of Gaussian noise.
    """
    deviation = noise.deviation.copy()
    counted = max(noise.counted, 1)
    share = max(1.0 - fitted / counted, 1.0 / counted)
    for quantity in np.unique(residuals.quantity[noise.estimated]):
        mine = noise.estimated & (residuals.quantity == quantity)
        least = _LEAST_NOISE * _FIRST_NOISE[MEASURED[OBSERVED[quantity]].unit]
        size = np.abs(residuals.values[mine])
        mean = (np.median(size) / norm.ppf(0.75)) ** 2 if robust else np.mean(size**2)
        deviation[mine] = max(np.sqrt(mean / share), least)
    return replace(noise, deviation=deviation)
