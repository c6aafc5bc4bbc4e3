"""Maximum likelihood of a linear model whose numbers scatter more than their known errors.

y_i is Gaussian about x_i @ b with the variance s_i^2 + t: s_i is known of each (0 if unknown), the
variance t of the rest is found together with b. If no s_i is known this is the usual least-squares
fit.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from jaxtyping import Float
from scipy.optimize import root_scalar
from scipy.stats import norm
from scipy.stats import t as student

# Numbers that the model meets to this part of their size do not scatter: rounding.
_EXACT = 1e-13

Vector = Float[np.ndarray, " n"]
Design = Float[np.ndarray, "n k"]


@dataclass(frozen=True)
class ScatterFit:
    """A fitted linear model.

    Attributes:
        values: Its coefficients b, (k,).
        covariance: Their covariance, with t unbiased, (k, k).
        rest: Variance t that known errors do not explain.
        variance: Variance of every number, s_i^2 + t with t unbiased, (n,).
        residual: y - x b, (n,).
        log_likelihood: Logarithm of the likelihood; infinite if the numbers do not scatter.
    """

    values: Float[np.ndarray, " k"]
    covariance: Float[np.ndarray, "k k"]
    rest: float
    variance: Vector
    residual: Vector
    log_likelihood: float


def fit_line(x: Design, y: Vector, known: Vector) -> ScatterFit:
    """Fit by maximum likelihood numbers y with known variances to columns x of full rank."""
    count, columns = x.shape
    plain = y - x @ np.linalg.lstsq(x, y, rcond=None)[0]
    largest = float(np.max(plain**2))
    exact = np.sqrt(largest) <= _EXACT * float(np.max(np.abs(y)) or 1.0)
    if exact and ((known == 0.0).all() or (known > 0.0).all()):
        rest = 0.0
    elif (known == 0.0).all():
        rest = float(np.mean(plain**2))
    else:
        rest = _rest(x, y, known, max(largest, float(known.max())))
    likely = known + rest
    weighted = x.T if (likely == 0.0).any() else x.T / likely
    values = np.linalg.solve(weighted @ x, weighted @ y)
    residual = y - x @ values
    variance = known + rest * count / max(count - columns, 1)
    if (variance == 0.0).any():
        zero = np.zeros((columns, columns))
        return ScatterFit(values, zero, rest, variance, residual, float("inf"))
    covariance = np.linalg.inv(x.T @ (x / variance[:, None]))
    likelihood = float(_log_likelihood(x, y, likely[None])[0])
    return ScatterFit(values, covariance, rest, variance, residual, likelihood)


def mean_interval(y: Vector, variance: Vector, level: float = 0.95) -> tuple[float, float]:
    """Return the profile-likelihood interval of the mean of numbers with known variances.

    Its bound makes it exact if no errors are known (Student's interval); it tends to that of
    chi-square with many numbers. NaN for one number of unknown error.
    """
    best = fit_line(np.ones((len(y), 1)), y, variance)
    mean = float(best.values[0])
    if len(y) == 1:
        quantile = float(norm.ppf(0.5 + 0.5 * level))
        half = quantile * float(np.sqrt(variance[0])) if variance[0] > 0.0 else float("nan")
        return mean - half, mean + half
    if np.isinf(best.log_likelihood):
        return mean, mean
    freedom = len(y) - 1
    quantile = float(student.ppf(0.5 + 0.5 * level, freedom))
    bound = 0.5 * len(y) * np.log1p(quantile**2 / freedom)
    no_columns = np.zeros((len(y), 0))

    def excess(value: float) -> float:
        fall = best.log_likelihood - fit_line(no_columns, y - value, variance).log_likelihood
        return fall - bound

    ends: list[float] = []
    for side in (-1.0, 1.0):
        step = side * quantile * float(np.sqrt(best.covariance[0, 0]))
        while excess(mean + step) < 0.0:
            step *= 2.0
        result: Any = root_scalar(excess, bracket=(mean, mean + step), xtol=1e-15, rtol=1e-9)
        ends.append(float(result.root))
    return ends[0], ends[1]


def outliers(x: Design, y: Vector, variance: Vector, level: float = 0.05) -> tuple[int, ...]:
    """Find numbers too far from the model, by the generalised test of Rosner (1983).

    The farthest is removed and the others are fitted again, repeatedly, so that several outliers do
    not hide each other. Up to a quarter of the numbers can be found; of fewer than 15 one, for
    which the test is exact. `level` is the probability to find any if there is none.
    """
    left = np.arange(len(y))
    removed: list[int] = []
    count = 0
    for _ in range(len(y) // 4 if len(y) >= 15 else 1):
        freedom = len(left) - x.shape[1] - 1
        fitted = fit_line(x[left], y[left], variance[left])
        if freedom < 1 or (fitted.variance == 0.0).any():
            break
        distance = np.abs(fitted.residual) / np.sqrt(fitted.variance)
        farthest = int(np.argmax(distance))
        quantile = float(student.ppf(1.0 - 0.5 * level / len(left), freedom))
        bound = quantile * (freedom + 1) / np.sqrt((freedom + quantile**2) * len(left))
        removed.append(int(left[farthest]))
        if distance[farthest] > bound:
            count = len(removed)
        left = np.delete(left, farthest)
    return tuple(sorted(removed[:count]))


def _log_likelihood(
    x: Design, y: Vector, variance: Float[np.ndarray, "many n"]
) -> Float[np.ndarray, " many"]:
    """Largest likelihood under each of many variances."""
    weighted = x.T / variance[:, None]
    values = np.linalg.solve(weighted @ x, (weighted @ y)[..., None])[..., 0]
    residual = y - values @ x.T
    return -0.5 * np.sum(residual**2 / variance + np.log(2.0 * np.pi * variance), axis=-1)


def _rest(x: Design, y: Vector, variance: Vector, largest: float) -> float:
    """Likeliest variance of the rest, 0 if known errors explain everything."""
    least = 0.0 if (variance > 0.0).all() else 1e-12 * largest
    # The likelihood may have several peaks in the variance, rarely; a grid finds the highest, and
    # finer ones about it the place to 1e-6 of the variance.
    grid = np.concatenate([[least], largest * np.geomspace(1e-6, 4.0, 25)])
    for _ in range(6):
        best = int(np.argmax(_log_likelihood(x, y, variance + grid[:, None])))
        if best == 0 and grid[0] == least:
            near = np.array([[least], [least + 1e-4 * (grid[1] - least)]])
            first, second = _log_likelihood(x, y, variance + near)
            if first >= second:  # the likelihood falls from the least variance on
                return least
        low, high = grid[max(best - 1, 0)], grid[min(best + 1, len(grid) - 1)]
        grid = np.linspace(low, high, 21)
    return float(grid[10])
