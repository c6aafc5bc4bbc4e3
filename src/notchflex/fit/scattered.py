"""Maximum likelihood of linear models with more scatter than errors; whether friction is constant.

y_i is Gaussian about x_i @ b with the variance s_i^2 + t: s_i is known of all (or 0 of all), the
variance t of the rest is found together with b. If no s_i is known this is the usual least-squares
fit.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from jaxtyping import Float
from scipy.optimize import minimize_scalar, root_scalar
from scipy.stats import chi2, norm
from scipy.stats import f as fisher
from scipy.stats import t as student

# Numbers that the model meets to this part of their size do not scatter: rounding.
_EXACT = 1e-13
# A turn (rad) or the logarithm of a load that varies by less than this is constant.
_VARIES = 1e-6

LEVEL = 0.05
"""Probability below which a constant coefficient is not enough."""

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
    values = np.linalg.lstsq(x, y)[0]
    residual = y - x @ values
    largest = np.max(np.abs(residual))
    if known.any():
        rest = _rest(x, y, known)
    elif largest <= _EXACT * (np.max(np.abs(y)) or 1.0):
        zero = np.zeros((columns, columns))
        return ScatterFit(values, zero, 0.0, known, residual, float("inf"))
    else:
        rest = float(np.mean(residual**2))
    values, likelihood = _weighted(x, y, known + rest)
    variance = known + rest * count / max(count - columns, 1)
    covariance = np.linalg.inv(x.T @ (x / variance[:, None]))
    return ScatterFit(values, covariance, rest, variance, y - x @ values, likelihood)


def _weighted(x: Design, y: Vector, variance: Vector) -> tuple[Vector, float]:
    """Values of the largest likelihood under variances, and its logarithm."""
    weighted = x.T / variance
    values = np.linalg.solve(weighted @ x, weighted @ y)
    squares = (y - x @ values) ** 2 / variance
    return values, float(-0.5 * np.sum(squares + np.log(2.0 * np.pi * variance)))


def _rest(x: Design, y: Vector, known: Vector) -> float:
    """Likeliest variance of the rest, 0 if known errors explain everything."""

    def misfit(rest: float) -> float:
        return -_weighted(x, y, known + rest)[1]

    # The likelihood may have several peaks, rarely: a grid finds the highest.
    plain = y - x @ np.linalg.lstsq(x, y)[0]
    largest = max(float(np.max(plain**2)), float(known.max()))
    grid = np.array([0.0, *largest * np.geomspace(1e-6, 4.0, 25)])
    best = int(np.argmin([misfit(rest) for rest in grid]))
    if best == 0 and misfit(0.0) <= misfit(1e-4 * grid[1]):
        return 0.0
    low, high = grid[max(best - 1, 0)], grid[min(best + 1, len(grid) - 1)]
    options = {"xatol": 1e-9 * high}
    peak: Any = minimize_scalar(misfit, bounds=(low, high), method="bounded", options=options)
    return float(peak.x)


def mean_interval(y: Vector, variance: Vector) -> tuple[float, float]:
    """Return the profile-likelihood interval of the mean of numbers with known variances.

    Its bound makes it exact if no errors are known (Student's interval); it tends to that of
    chi-square with many numbers. NaN for one number of unknown error.
    """
    best = fit_line(np.ones((len(y), 1)), y, variance)
    mean = float(best.values[0])
    if len(y) == 1:
        quantile = float(norm.ppf(0.975))
        half = quantile * float(np.sqrt(variance[0])) if variance[0] > 0.0 else float("nan")
        return mean - half, mean + half
    if np.isinf(best.log_likelihood):
        return mean, mean
    freedom = len(y) - 1
    quantile = float(student.ppf(0.975, freedom))
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
        line = fit_line(x[left], y[left], variance[left])
        if freedom < 1 or np.isinf(line.log_likelihood):
            break
        distance = np.abs(line.residual) / np.sqrt(line.variance)
        farthest = int(np.argmax(distance))
        quantile = student.ppf(1.0 - 0.5 * level / len(left), freedom)
        bound = quantile * (freedom + 1) / np.sqrt((freedom + quantile**2) * len(left))
        removed.append(int(left[farthest]))
        if distance[farthest] > bound:
            count = len(removed)
        left = np.delete(left, farthest)
    return tuple(sorted(removed[:count]))


@dataclass(frozen=True)
class Constancy:
    """A constant coefficient of friction against one that depends on turn and load.

    The other model is mu + a (turn - mean turn) + b (ln weight 1 - its mean), with the turn over
    both edges and Gaussian readings, as for the estimate.

    Attributes:
        statistic: Twice the difference of the log likelihoods; NaN if it cannot be tested.
        degrees_of_freedom: How many of the two numbers a and b the readings determine.
        p_value: Probability of so large a statistic if the coefficient is constant, or NaN.
        by_turn: a, per rad; NaN if the turn does not vary.
        by_turn_error: Its standard error.
        by_load: b, per unit of the natural logarithm; NaN if the load does not vary.
        by_load_error: Its standard error.
        words: The result in words.
    """

    statistic: float
    degrees_of_freedom: int
    p_value: float
    by_turn: float
    by_turn_error: float
    by_load: float
    by_load_error: float
    words: str

    @property
    def enough(self) -> bool | None:
        """Whether a constant is enough for the readings; None if it cannot be tested."""
        return None if np.isnan(self.p_value) else self.p_value >= LEVEL


def design_of(turn: Vector, load: Vector) -> Design:
    """Return columns of 1, turn and logarithm of the load, the latter two less their means."""
    columns = np.stack([turn, np.log(load)], axis=1)
    return np.column_stack([np.ones(len(turn)), columns - columns.mean(axis=0)])


def constancy_of(x: Design, y: Vector, variance: Vector) -> Constancy:
    """Test whether numbers depend on the columns of `design_of` besides the first."""
    used = [0, *np.flatnonzero(np.ptp(x, axis=0) > _VARIES).tolist()]
    if len(used) == 3 and np.linalg.matrix_rank(x, tol=_VARIES * np.sqrt(len(x))) < 3:
        # Turn and load go together: what depends on both shows in one of them.
        used = [0, 1]
    freedom, count = len(used) - 1, len(y)
    plain = fit_line(x[:, :1], y, variance)
    if not freedom:
        words = "All readings have one load and one turn, so that constancy cannot be tested."
    elif count < len(used) + 2:
        words = (
            f"{count} readings are too few to test whether mu is constant; take "
            f"{len(used) + 2} or more at different loads and turns."
        )
    elif np.isinf(plain.log_likelihood):
        words = "The readings agree to rounding: a constant mu is enough."
    else:
        line = fit_line(x[:, used], y, variance)
        statistic = max(2.0 * (line.log_likelihood - plain.log_likelihood), 0.0)
        # Where the variance is found from the readings, statistic = n ln(1 + f F / (n - k)).
        ratio = np.expm1(statistic / count) * (count - len(used)) / freedom
        p_value = float(
            fisher.sf(ratio, freedom, count - len(used))
            if line.rest
            else chi2.sf(statistic, freedom)
        )
        slopes = np.full((3, 2), np.nan)
        slopes[used] = np.stack([line.values, np.sqrt(np.diag(line.covariance))], axis=1)
        words = _words(p_value, slopes[1:])
        return Constancy(statistic, freedom, p_value, *slopes[1:].ravel().tolist(), words=words)
    return Constancy(np.nan, freedom, *(np.nan,) * 5, words=words)


def _words(p_value: float, slopes: Float[np.ndarray, "2 2"]) -> str:
    if p_value >= LEVEL:
        return (
            f"A constant mu is enough for these readings (p = {p_value:.2g}): turn and load "
            "explain no more of their scatter than chance would."
        )
    units = (
        ("turn", "for 10 deg more of turn", np.radians(10.0)),
        ("load", "when the load doubles", np.log(2.0)),
    )
    changes: list[str] = []
    constant: list[str] = []
    for (what, where, unit), (slope, error) in zip(units, slopes, strict=True):
        if abs(slope) < 2.0 * error:
            constant.append(what)
        elif np.isfinite(slope):
            way = "rises" if slope > 0.0 else "falls"
            changes.append(f"{way} by {abs(slope) * unit:.2g} {where}")
    said = " and ".join(changes) or "changes with turn and load together"
    if changes and constant:
        said += f", and does not change with the {constant[0]} beyond chance"
    return f"A constant mu is not enough (p = {p_value:.2g}): mu {said}."
