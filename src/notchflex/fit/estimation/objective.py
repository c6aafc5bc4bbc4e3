"""What a fit makes small: squares over their noise, or the sums of norms of the papers."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar, Protocol

import numpy as np
from jaxtyping import Float, Int

from notchflex.errors import InputError
from notchflex.fit.estimation.minimise import Cost
from notchflex.fit.model.residuals import ANGLES, LENGTHS, Residuals


class FitObjective(Protocol):
    """What a fit makes small; a value such as `LeastSquares()`."""

    is_likelihood: ClassVar[bool]
    """Whether it is minus the logarithm of a likelihood, so that it gives intervals."""

    def check(self, quantities: tuple[str, ...]) -> None:
        """Raise InputError if it cannot be made of these quantities."""
        ...

    def cost(self, residuals: Residuals, noise: Float[np.ndarray, " r"]) -> Cost:
        """Its value, slope and curvature."""
        ...


@dataclass(frozen=True)
class LeastSquares:
    """Half the sum of squared residuals over their noise (Gaussian noise).

    Args:
        huber: Residuals beyond so many standard deviations count by their size, not its square
            (Huber 1964), so that outliers pull less; none where not given.

    Example:
        >>> LeastSquares(huber=1.5).is_likelihood
        True
    """

    huber: float | None = None
    is_likelihood: ClassVar[bool] = True

    def __post_init__(self) -> None:
        """Check the number."""
        if self.huber is not None and not 0.0 < self.huber < np.inf:
            raise InputError.OUT_OF_RANGE(f"huber must be above 0, about 1.5; got {self.huber}")

    def check(self, quantities: tuple[str, ...]) -> None:
        """Anything measured will do."""

    def cost(self, residuals: Residuals, noise: Float[np.ndarray, " r"]) -> Cost:
        """Half the sum of squares, or of Huber's function."""
        scaled = residuals.values / noise
        size = np.abs(scaled)
        most = np.inf if self.huber is None else self.huber
        weight = np.where(size > most, most / np.maximum(size, 1e-300), 1.0)
        linear = most * size - 0.5 * most**2 if self.huber is not None else size
        value = float(np.sum(np.where(size > most, linear, 0.5 * scaled**2)))
        slopes = residuals.slopes / noise[:, None]
        weighted = slopes * weight[:, None]
        shares = weighted * scaled[:, None]
        return Cost(value, shares.sum(axis=0), weighted.T @ slopes, residuals, shares)


@dataclass(frozen=True)
class SumOfRobotErrors:
    """Pacheco 2021, eq. 17: over all robots the norm of their root-mean-square errors, deg.

    Each robot adds the 2-norm of the vector of errors of its notches and of its total angle.

    Example:
        >>> SumOfRobotErrors().is_likelihood
        False
    """

    is_likelihood: ClassVar[bool] = False

    def check(self, quantities: tuple[str, ...]) -> None:
        """Only angles can be added up in degrees."""
        _only(quantities, ANGLES, "SumOfRobotErrors adds angles")

    def cost(self, residuals: Residuals, noise: Float[np.ndarray, " r"]) -> Cost:
        """Sum of norms, a group per robot, each over the root of its number of points."""
        del noise
        factor = np.degrees(1.0) / np.sqrt(residuals.rows)
        return _sum_of_norms(residuals, residuals.robot, factor)


@dataclass(frozen=True)
class SumOfDistances:
    """Gao 2017, eq. 27: the sum of distances between measured points and those of the model, mm.

    Example:
        >>> SumOfDistances().is_likelihood
        False
    """

    is_likelihood: ClassVar[bool] = False

    def check(self, quantities: tuple[str, ...]) -> None:
        """Only points have distances."""
        _only(quantities, LENGTHS, "SumOfDistances adds distances of points")

    def cost(self, residuals: Residuals, noise: Float[np.ndarray, " r"]) -> Cost:
        """Sum of norms, a group per point."""
        del noise
        return _sum_of_norms(residuals, residuals.point, np.ones(len(residuals.values)))


def _only(quantities: tuple[str, ...], allowed: tuple[str, ...], what: str) -> None:
    wrong = [name for name in quantities if name not in allowed]
    if wrong:
        raise InputError.UNSUPPORTED(
            f"{what}; {wrong[0]} was measured too. Leave it out of the file, or use LeastSquares()"
        )


def _sum_of_norms(
    residuals: Residuals, group: Int[np.ndarray, " r"], factor: Float[np.ndarray, " r"]
) -> Cost:
    """The sum over groups of the norm of their residuals.

    The curvature is that with straight residuals: of a norm n = |r| it is
    J^T (1 - r r^T / n^2) J / n, never negative.
    """
    values = residuals.values * factor
    groups = int(group.max()) + 1
    norm = np.sqrt(np.bincount(group, values**2, groups))
    value = float(norm.sum())
    slopes = residuals.slopes * factor[:, None]
    each = np.maximum(norm, 1e-12)
    weighted = slopes / each[group][:, None]
    shares = weighted * values[:, None]
    along = np.stack([np.bincount(group, column, groups) for column in shares.T], axis=1)
    curvature = weighted.T @ slopes - (along / each[:, None]).T @ along
    return Cost(value, shares.sum(axis=0), curvature, residuals, shares)


__all__ = ["FitObjective", "LeastSquares", "SumOfDistances", "SumOfRobotErrors"]
