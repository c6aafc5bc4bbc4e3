"""Objectives of a fit: squares over their noise, or the sums of norms of the papers."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar, Protocol

import numpy as np
from jaxtyping import Float, Int

from notchflex.errors import InputError
from notchflex.fit.estimation.minimise import Cost
from notchflex.fit.model.residuals import ANGLES, LENGTHS, Residuals


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
        scaled = residuals.values / noise
        size = np.abs(scaled)
        most = np.inf if self.huber is None else self.huber
        weight = np.where(size > most, most / np.maximum(size, 1e-300), 1.0)
        linear = most * size - 0.5 * most**2 if self.huber is not None else size
        value = float(np.sum(np.where(size > most, linear, 0.5 * scaled**2)))
        slopes = residuals.slopes / noise[:, None]
        weighted = slopes * weight[:, None]
        contributions = weighted * scaled[:, None]
        gradient = contributions.sum(axis=0)
        return Cost(value, gradient, weighted.T @ slopes, residuals, contributions)


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
