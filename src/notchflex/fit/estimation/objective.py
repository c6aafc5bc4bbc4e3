"""Objectives of a fit: squares over the noise, or the sums of norms of the papers."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import ClassVar, Protocol

import numpy as np
from jaxtyping import Bool, Float, Int
from scipy.stats import norm

from notchflex import InputError
from notchflex.fit.estimation.intervals import Cost
from notchflex.fit.measurements.measurements import OBSERVED
from notchflex.fit.measurements.repeats import repeats
from notchflex.fit.model.residuals import ANGLES, LENGTHS, Residuals
from notchflex.fit.model.samples import Samples

# How often outliers are weighed anew while deviations from the drawing are found.
_REWEIGHTED = 100


class FitObjective(Protocol):
    """The objective of a fit; a value such as `LeastSquares()`."""

    is_likelihood: ClassVar[bool]
    """Whether it is minus the logarithm of a likelihood, so that it gives intervals."""

    def check(self, quantities: tuple[str, ...]) -> None:
        """Raise InputError if it cannot be made of these quantities."""
        ...

    takes_priors: ClassVar[bool]
    """Whether a prior may be added to it."""

    def weight_of_one(self, residuals: Residuals, noise: Float[np.ndarray, " r"]) -> float:
        """Return what half the square of a residual over its noise adds to the value."""
        ...

    def cost(self, residuals: Residuals, noise: Float[np.ndarray, " r"]) -> Cost:
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

    def weight_of_one(self, residuals: Residuals, noise: Float[np.ndarray, " r"]) -> float:
        """Return 1: it is a sum of such halves."""
        return 1.0

    def cost(self, residuals: Residuals, noise: Float[np.ndarray, " r"]) -> Cost:
        """Return half the sum of squares, or of Huber's function."""
        slopes, spread = (one / noise[:, None] for one in (residuals.slopes, residuals.spread))
        expected = (residuals.values + residuals.expected) / noise
        most = np.inf if self.huber is None else self.huber
        deviations, scaled = np.zeros(spread.shape[1]), expected
        for _ in range(_REWEIGHTED):  # least squares, reweighted (Holland and Welsch 1977)
            weight = np.minimum(1.0, most / np.maximum(np.abs(scaled), 1e-300))
            present, deviations = deviations, -_best(spread, weight, expected)
            scaled = expected + spread @ deviations
            if self.huber is None or np.allclose(present, deviations, rtol=0.0, atol=1e-10):
                break
        clipped = np.clip(scaled, -most, most)
        size = np.abs(clipped)
        misfit = float(np.sum(size * (np.abs(scaled) - 0.5 * size)))
        weight = np.minimum(1.0, most / np.maximum(np.abs(scaled), 1e-300))
        left = residuals.values + residuals.expected + residuals.spread @ deviations
        # The deviations follow the constants: what remains of the slopes, and of the curvature.
        follow = _best(spread, weight, slopes)
        remaining = slopes - spread @ follow
        quadratic = (np.abs(scaled) <= most).astype(float)
        turned = _best(spread, quadratic, slopes)
        return Cost(
            misfit + 0.5 * float(deviations @ deviations),
            slopes.T @ clipped,
            (slopes * weight[:, None]).T @ remaining,
            replace(residuals, values=left),
            (slopes - spread @ turned) * clipped[:, None],
            deviations,
            turned.T @ turned,
            (slopes * quadratic[:, None]).T @ (slopes - spread @ turned),
        )


@dataclass(frozen=True)
class SumOfRobotErrors:
    """Sum over all robots of the norm of their root-mean-square errors, deg (Pacheco 2021, eq. 17).

    Each robot adds the 2-norm of the vector of errors of its notches and of its total angle. A
    prior counts as one more reading that is off by as many standard deviations of its noise: at
    residuals as large as the noise, half a squared deviation adds noise / (rows * root of the
    angles in a row) degrees, the mean over the robots.

    Example:
        >>> SumOfRobotErrors().is_likelihood
        False
    """

    is_likelihood: ClassVar[bool] = False
    takes_priors: ClassVar[bool] = True

    def check(self, quantities: tuple[str, ...]) -> None:
        """Raise InputError unless all quantities are angles."""
        _check(quantities, ANGLES, "SumOfRobotErrors adds angles")

    def weight_of_one(self, residuals: Residuals, noise: Float[np.ndarray, " r"]) -> float:
        """Return the mean over the robots where residuals are as large as the noise, deg."""
        is_known, size = np.isfinite(noise), int(residuals.robot.max()) + 1
        robot = residuals.robot[is_known]
        count = np.bincount(robot, minlength=size)
        noise = np.sqrt(np.bincount(robot, noise[is_known] ** 2, size) / count)
        rows = np.array([residuals.rows[residuals.robot == one][0] for one in range(size)])
        return float(np.degrees(np.mean(noise / np.sqrt(rows * count))))

    def cost(self, residuals: Residuals, noise: Float[np.ndarray, " r"]) -> Cost:
        """Return the sum of norms, a group per robot, each over the root of its number of rows."""
        factor = np.degrees(1.0) / np.sqrt(residuals.rows)
        return _sum_of_norms(residuals, residuals.robot, factor)


@dataclass(frozen=True)
class SumOfDistances:
    """Sum of distances between measured and modelled points, mm (Gao 2017, eq. 27).

    Example:
        >>> SumOfDistances().is_likelihood
        False
    """

    is_likelihood: ClassVar[bool] = False
    takes_priors: ClassVar[bool] = False

    def check(self, quantities: tuple[str, ...]) -> None:
        """Raise InputError unless all quantities are points."""
        _check(quantities, LENGTHS, "SumOfDistances adds distances of points")

    def weight_of_one(self, residuals: Residuals, noise: Float[np.ndarray, " r"]) -> float:
        """Return 0: it takes no priors."""
        return 0.0

    def cost(self, residuals: Residuals, noise: Float[np.ndarray, " r"]) -> Cost:
        """Return the sum of norms, a group per point."""
        return _sum_of_norms(residuals, residuals.point, np.ones(len(residuals)))


def _best(
    spread: Float[np.ndarray, "r m"], weight: Float[np.ndarray, " r"], values: np.ndarray
) -> np.ndarray:
    """Deviations of unit variance that explain values best, by weighted least squares."""
    root = np.sqrt(weight).reshape(-1, *(1,) * (values.ndim - 1))
    axes, sizes, turn = np.linalg.svd(spread * np.sqrt(weight)[:, None], full_matrices=False)
    shrunk = sizes / (1.0 + sizes**2)
    return turn.T @ ((axes * shrunk).T @ (root * values))


def _check(quantities: tuple[str, ...], allowed: tuple[str, ...], what: str) -> None:
    wrong = [name for name in quantities if name not in allowed]
    if wrong:
        raise InputError.UNSUPPORTED(
            f"{what}; {wrong[0]} was measured too. Leave it out of the file, or use LeastSquares()"
        )


def _sum_of_norms(
    residuals: Residuals, group: Int[np.ndarray, " r"], factor: Float[np.ndarray, " r"]
) -> Cost:
    """The sum over groups of the norm of their residuals.

    The curvature is that of linear residuals: of a norm n = |r| it is J^T (1 - r r^T / n^2) J / n,
    positive semidefinite.
    """
    values, slopes = residuals.values * factor, residuals.slopes * factor[:, None]
    groups = int(group.max()) + 1
    norm = np.sqrt(np.bincount(group, values**2, groups))
    divisor = np.maximum(norm, 1e-12)
    weighted = slopes / divisor[group][:, None]
    contributions = weighted * values[:, None]
    along = np.stack([np.bincount(group, one, groups) for one in contributions.T], axis=1)
    curvature = weighted.T @ slopes - (along / divisor[:, None]).T @ along
    gradient = contributions.sum(axis=0)
    return Cost(float(norm.sum()), gradient, curvature, residuals, contributions)


# Standard deviations to begin with if nothing is known: 1 deg, 0.1 mm, 0.01 N.
_FIRST: dict[str, float] = {"tip_tension": 0.01, "tip_position": 0.1, "axis_points": 0.1}
_FIRST_ANGLE = float(np.radians(1.0))
# Nothing is measured better than this part of that; else an exact fit would have no noise at all.
_MIN_NOISE = 1e-9


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

    deviation: Float[np.ndarray, " r"]
    estimated: Bool[np.ndarray, " r"]
    source: dict[tuple[int, str], str]

    @property
    def counted(self) -> int:
        """How many of the numbers count."""
        return int(np.isfinite(self.deviation).sum())

    @property
    def is_known(self) -> bool:
        """Whether none of them is estimated from the residuals."""
        return not bool(self.estimated.any())


def first_noise(samples: Samples, residuals: Residuals) -> Noise:
    """Return standard deviations as given, or of repeats; a first guess if there are neither."""
    deviation = residuals.given.copy()
    estimated = np.zeros(len(deviation), bool)
    source: dict[tuple[int, str], str] = {}
    for number, sample in enumerate(samples.every):
        of_repeats = repeats(sample.measured)
        for name in sample.measured.observed:
            mine = residuals.of(number, name)
            missing = mine & ~(deviation > 0.0)
            key = (number, name)
            if sample.measured.is_sum(name):
                deviation[mine] = np.inf
                source[key] = "sum of the notches"
            elif not missing.any():
                source[key] = "given"
            elif 0.0 < of_repeats[name] < np.inf:
                deviation[missing] = of_repeats[name]
                source[key] = "repeats"
            else:
                deviation[missing] = _FIRST.get(name, _FIRST_ANGLE)
                estimated |= missing
                source[key] = "fit"
    return Noise(deviation, estimated, source)


def noise_left(noise: Noise, residuals: Residuals, constants: int, *, robust: bool) -> Noise:
    """Return the noise with the unknown standard deviations estimated from the residuals.

    By quantity: root mean squares over the degrees of freedom that the constants leave; for robust
    objectives from the median of absolute values, as of Gaussian noise.
    """
    deviation = noise.deviation.copy()
    counted = max(noise.counted, 1)
    share = max(1.0 - constants / counted, 1.0 / counted)
    for quantity in np.unique(residuals.quantity[noise.estimated]):
        mine = noise.estimated & (residuals.quantity == quantity)
        least = _MIN_NOISE * _FIRST.get(OBSERVED[quantity], _FIRST_ANGLE)
        size = np.abs(residuals.values[mine])
        mean = (np.median(size) / norm.ppf(0.75)) ** 2 if robust else np.mean(size**2)
        deviation[mine] = max(np.sqrt(mean / share), least)
    return Noise(deviation, noise.estimated, noise.source)
