"""Maximum likelihood of a line through numbers that scatter more than is known of their errors.

y_i is Gaussian about x_i @ b with the variance s_i^2 + t: s_i is known of each (0 where it is
not), the variance t of the rest is found together with b. Where no s_i is known this is the
common least-squares fit.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from jaxtyping import Float
from scipy.optimize import root_scalar
from scipy.stats import t as student

# Numbers that lie on the line to this part of their size do not scatter: rounding.
_EXACT = 1e-13

Vector = Float[np.ndarray, " n"]


@dataclass(frozen=True)
class Line:
    """A fitted line.

    Attributes:
        values: Its coefficients b, (k,).
        covariance: Of these, with the rest's variance unbiased, (k, k).
        rest: Variance t of what known errors do not explain.
        variance: Of every number, s_i^2 + t with t unbiased, (n,).
        residual: y - x b, (n,).
        log_likelihood: Logarithm of the likelihood; infinite where the numbers do not scatter.
    """

    values: Float[np.ndarray, " k"]
    covariance: Float[np.ndarray, "k k"]
    rest: float
    variance: Vector
    residual: Vector
    log_likelihood: float


def fit_line(x: Float[np.ndarray, "n k"], y: Vector, known: Vector) -> Line:
    """Fit a line by maximum likelihood.

    Args:
        x: What the numbers depend on, k columns of full rank.
        y: The numbers.
        known: Variance that is known of each, s^2.

    Returns:
        The fit.
    """
    count, columns = x.shape
    plain = y - x @ np.linalg.lstsq(x, y, rcond=None)[0]
    largest = float(np.max(plain**2))
    exact = np.sqrt(largest) <= _EXACT * float(np.max(np.abs(y)) or 1.0)
    if (known == 0.0).all():
        rest = 0.0 if exact else float(np.mean(plain**2))
    elif exact and (known > 0.0).all():
        rest = 0.0
    else:
        rest = _rest(x, y, known, max(largest, float(known.max())))
    values, residual = _weighted(x, y, known + rest)
    variance = known + rest * count / max(count - columns, 1)
    if (variance == 0.0).any():
        nothing = np.zeros((columns, columns))
        return Line(values, nothing, rest, variance, residual, float("inf"))
    covariance = np.linalg.inv(x.T @ (x / variance[:, None]))
    likelihood = float(_log_likelihood(x, y, (known + rest)[None])[0])
    return Line(values, covariance, rest, variance, residual, likelihood)


def mean_interval(y: Vector, known: Vector, level: float = 0.95) -> tuple[float, float]:
    """Profile-likelihood interval of the mean of numbers.

    Its bound is that which makes it exact where no errors are known (Student's interval); it tends
    to that of chi-square with many numbers.

    Args:
        y: The numbers.
        known: Variance that is known of each.
        level: Its probability.

    Returns:
        The interval; NaN where one number of unknown error tells none.
    """
    ones = np.ones((len(y), 1))
    best = fit_line(ones, y, known)
    mean = float(best.values[0])
    if len(y) == 1:
        half = 1.959964 * float(np.sqrt(known[0])) if known[0] > 0.0 else float("nan")
        return mean - half, mean + half
    if np.isinf(best.log_likelihood):
        return mean, mean
    freedom = len(y) - 1
    quantile = float(student.ppf(0.5 + 0.5 * level, freedom))
    bound = 0.5 * len(y) * np.log1p(quantile**2 / freedom)
    nothing = np.zeros((len(y), 0))

    def below(value: float) -> float:
        return best.log_likelihood - fit_line(nothing, y - value, known).log_likelihood - bound

    ends: list[float] = []
    for way in (-1.0, 1.0):
        step = way * quantile * float(np.sqrt(best.covariance[0, 0]))
        while below(mean + step) < 0.0:
            step *= 2.0
        found: Any = root_scalar(below, bracket=(mean, mean + step), xtol=1e-15, rtol=1e-9)
        ends.append(float(found.root))
    return ends[0], ends[1]


def outliers(
    x: Float[np.ndarray, "n k"], y: Vector, known: Vector, level: float = 0.05
) -> tuple[int, ...]:
    """Find numbers that lie too far off the line, by the generalised test of Rosner (1983).

    The farthest is taken away and the line fitted to the others, again and again, so that several
    outliers do not hide each other. Up to a quarter of the numbers can be told; of fewer than 15
    one, for which the test is exact.

    Args:
        x: What the numbers depend on.
        y: The numbers.
        known: Variance that is known of each.
        level: Probability to name any where there is none.

    Returns:
        Their places, rising.
    """
    left = np.arange(len(y))
    taken: list[int] = []
    told = 0
    for _ in range(len(y) // 4 if len(y) >= 15 else 1):
        freedom = len(left) - x.shape[1] - 1
        fitted = fit_line(x[left], y[left], known[left])
        if freedom < 1 or (fitted.variance == 0.0).any():
            break
        distance = np.abs(fitted.residual) / np.sqrt(fitted.variance)
        farthest = int(np.argmax(distance))
        quantile = float(student.ppf(1.0 - 0.5 * level / len(left), freedom))
        bound = quantile * (freedom + 1) / np.sqrt((freedom + quantile**2) * len(left))
        taken.append(int(left[farthest]))
        if distance[farthest] > bound:
            told = len(taken)
        left = np.delete(left, farthest)
    return tuple(sorted(taken[:told]))


def _weighted(x: Float[np.ndarray, "n k"], y: Vector, variance: Vector) -> tuple[Vector, Vector]:
    weighted = x.T if (variance == 0.0).any() else x.T / variance
    values = np.linalg.solve(weighted @ x, weighted @ y)
    return values, y - x @ values


def _log_likelihood(
    x: Float[np.ndarray, "n k"], y: Vector, variance: Float[np.ndarray, "many n"]
) -> Float[np.ndarray, " many"]:
    """Likeliest line under each of many variances."""
    weighted = x.T / variance[:, None]
    values = np.linalg.solve(weighted @ x, (weighted @ y)[..., None])[..., 0]
    residual = y - values @ x.T
    return -0.5 * np.sum(residual**2 / variance + np.log(2.0 * np.pi * variance), axis=-1)


def _rest(x: Float[np.ndarray, "n k"], y: Vector, known: Vector, largest: float) -> float:
    """Variance of the rest: the likeliest, 0 where known errors explain everything."""
    least = 0.0 if (known > 0.0).all() else 1e-12 * largest
    # The likelihood may have several peaks in the variance, rarely; a grid finds the highest, and
    # finer ones about it the place to 1e-6 of the variance.
    grid = np.concatenate([[least], largest * np.geomspace(1e-6, 4.0, 25)])
    best = 0
    for _ in range(6):
        best = int(np.argmax(_log_likelihood(x, y, known + grid[:, None])))
        if best == 0 and grid[0] == least and _falls(x, y, known, least, float(grid[1])):
            return least
        low, high = grid[max(best - 1, 0)], grid[min(best + 1, len(grid) - 1)]
        grid = np.linspace(low, high, 21)
    return float(grid[10])


def _falls(x: Float[np.ndarray, "n k"], y: Vector, known: Vector, least: float, up: float) -> bool:
    """Whether the likelihood falls from the least variance on."""
    near = np.array([[least], [least + 1e-4 * (up - least)]])
    first, second = _log_likelihood(x, y, known + near)
    return bool(first >= second)


__all__ = ["Line", "fit_line", "mean_interval", "outliers"]
