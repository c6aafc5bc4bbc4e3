"""Is a constant coefficient of friction enough? A likelihood-ratio test (Liu 2022, fig. 8)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.stats import chi2
from scipy.stats import f as fisher

from notchflex.fit.friction_rig.readings import FrictionReadings
from notchflex.fit.friction_rig.scattered import ScatterFit, fit_line

LEVEL = 0.05
"""Probability below which a constant coefficient is not enough."""

# A turn (rad) or the logarithm of a load that varies by less than this is constant.
_VARIES = 1e-6


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


def constancy(readings: FrictionReadings) -> Constancy:
    """Test whether a constant coefficient of friction is enough (Liu 2022, fig. 8).

    The statistic is compared with Fisher's F, which makes the test exact if no standard deviations
    are given, and with chi-square if those given explain the scatter.

    Args:
        readings: N readings.

    Example:
        >>> from notchflex.fit import weight_held
        >>> load = np.repeat([50.0, 100.0, 200.0, 400.0], 5)
        >>> turn = np.tile(np.radians([60.0, 75.0, 90.0, 105.0, 120.0]), 4)
        >>> mu = 0.15 - 0.01 * np.log(load / 150.0) + 0.002 * np.cos(np.arange(20.0) ** 2)
        >>> falling = FrictionReadings(load, weight_held(load, mu, turn, turn), turn, turn)
        >>> test = constancy(falling)
        >>> test.enough, round(test.by_load, 3)
        (False, -0.01)
    """
    x = design(readings)
    used = [0, *np.flatnonzero(np.ptp(x, axis=0) > _VARIES).tolist()]
    if len(used) == 3 and np.linalg.matrix_rank(x, tol=_VARIES * np.sqrt(len(x))) < 3:
        # Turn and load go together: what depends on both shows in one of them.
        used = [0, 1]
    freedom = len(used) - 1
    y, variance = readings.coefficient, known_variance(readings)
    plain = fit_line(x[:, :1], y, variance)
    if not freedom:
        words = "All readings have one load and one turn, so that constancy cannot be tested."
    elif len(readings) < len(used) + 2:
        words = (
            f"{len(readings)} readings are too few to test whether mu is constant; take "
            f"{len(used) + 2} or more at different loads and turns."
        )
    elif np.isinf(plain.log_likelihood):
        words = "The readings agree to rounding: a constant mu is enough."
    else:
        other = fit_line(x[:, used], y, variance)
        statistic = max(2.0 * (other.log_likelihood - plain.log_likelihood), 0.0)
        p_value = _probability(statistic, freedom, len(y), len(used), other)
        slopes = np.full((2, 2), np.nan)
        errors = np.sqrt(np.diag(other.covariance))
        slopes[np.array(used[1:]) - 1] = np.stack([other.values, errors], axis=1)[1:]
        words = _words(p_value, slopes)
        return Constancy(statistic, freedom, p_value, *slopes.ravel().tolist(), words=words)
    return Constancy(np.nan, freedom, *(np.nan,) * 5, words=words)


def design(readings: FrictionReadings) -> NDArray[np.float64]:
    """Return columns of 1, turn and logarithm of the load, the latter two less their means."""
    turn, load = readings.turn, np.log(readings.weight_1)
    return np.stack([np.ones(len(readings)), turn - turn.mean(), load - load.mean()], axis=1)


def known_variance(readings: FrictionReadings) -> NDArray[np.float64]:
    """Return the variance of every coefficient from the standard deviations of its reading.

    A reading without any is taken to be as accurate as the others in the mean; 0 if none has any.
    """
    variance = readings.coefficient_deviation**2
    is_known = np.isfinite(variance)
    return np.where(is_known, variance, np.mean(variance[is_known]) if is_known.any() else 0.0)


def _probability(
    statistic: float, freedom: int, count: int, columns: int, other: ScatterFit
) -> float:
    if np.isinf(statistic):
        return 0.0
    if other.rest == 0.0:
        return float(chi2.sf(statistic, freedom))
    # Where the variance is found from the readings, statistic = n ln(1 + f F / (n - k)).
    value = np.expm1(statistic / count) * (count - columns) / freedom
    return float(fisher.sf(value, freedom, count - columns))


def _words(p_value: float, slopes: NDArray[np.float64]) -> str:
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
