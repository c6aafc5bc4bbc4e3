"""Is a constant coefficient of friction enough? A likelihood-ratio test (Liu 2022, fig. 8)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.stats import chi2
from scipy.stats import f as fisher

from notchflex.fit.friction_rig.readings import FrictionReadings
from notchflex.fit.friction_rig.scattered import Line, fit_line

LEVEL = 0.05
"""Below this probability a constant coefficient is said not to be enough."""

# A turn (rad) or the logarithm of a load that varies by less than this does not vary.
_VARIES = 1e-6


@dataclass(frozen=True)
class Constancy:
    """A constant coefficient of friction against one that depends on turning and load.

    The other model is mu + a (turn - mean turn) + b (ln weight 1 - its mean), the turn being that
    over both edges; Gaussian readings, as for the estimate.

    Attributes:
        statistic: Twice the difference of the log likelihoods; NaN where it cannot be tested.
        degrees_of_freedom: How many of the two numbers a and b the readings can tell.
        p_value: Probability of so large a statistic where the coefficient is constant; NaN
            likewise.
        by_turn: a, per rad; NaN where the turn does not vary.
        by_turn_error: Its standard error.
        by_load: b, per unit of the natural logarithm; NaN where the load does not vary.
        by_load_error: Its standard error.
        words: What that means.
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
        """Whether a constant is enough as far as the readings tell; None where they cannot."""
        return None if np.isnan(self.p_value) else self.p_value >= LEVEL


def constancy(readings: FrictionReadings) -> Constancy:
    """Test whether a constant coefficient of friction is enough.

    The statistic is compared with the distribution that makes the test exact where no standard
    deviations are given (Fisher's F), and with chi-square where those given explain the scatter.

    Args:
        readings: N readings.

    Returns:
        The test; with the reason in words where nothing can be tested.

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
    turns, loads = (bool(np.ptp(column) > _VARIES) for column in x.T[1:])
    used = [0, *([1] if turns else []), *([2] if loads else [])]
    if len(used) == 3 and np.linalg.matrix_rank(x, tol=_VARIES * np.sqrt(len(x))) < 3:
        # Turn and load go together: what depends on both shows in one of them.
        used, loads = [0, 1], False
    freedom = len(used) - 1
    if not freedom:
        return _untold("All readings have one load and one turn, so that nothing can be told.", 0)
    if len(readings) < len(used) + 2:
        words = (
            f"{len(readings)} readings are too few to tell whether mu is constant; take "
            f"{len(used) + 2} or more at different loads and turns."
        )
        return _untold(words, freedom)
    y, known = readings.coefficient, known_variance(readings)
    plain, other = fit_line(x[:, :1], y, known), fit_line(x[:, used], y, known)
    if np.isinf(plain.log_likelihood):
        return _untold("The readings agree to rounding: a constant mu is enough.", freedom)
    statistic = max(2.0 * (other.log_likelihood - plain.log_likelihood), 0.0)
    p_value = _probability(statistic, freedom, len(y), len(used), other)
    slopes = np.full((2, 2), np.nan)
    for place, column in enumerate(used[1:], start=1):
        slopes[column - 1] = other.values[place], np.sqrt(other.covariance[place, place])
    (by_turn, turn_error), (by_load, load_error) = slopes.tolist()
    words = _words(p_value, slopes)
    return Constancy(statistic, freedom, p_value, by_turn, turn_error, by_load, load_error, words)


def design(readings: FrictionReadings) -> NDArray[np.float64]:
    """What a coefficient may depend on: 1, turn and logarithm of the load about their means."""
    turn, load = readings.turn, np.log(readings.weight_1)
    return np.stack([np.ones(len(readings)), turn - turn.mean(), load - load.mean()], axis=1)


def known_variance(readings: FrictionReadings) -> NDArray[np.float64]:
    """Variance of every coefficient that the standard deviations of its reading give.

    A reading without any is taken to be as accurate as the others are in the mean, not exact;
    0 where there is none at all.
    """
    variance = readings.coefficient_deviation**2
    told = np.isfinite(variance)
    return np.where(told, variance, np.mean(variance[told]) if told.any() else 0.0)


def _probability(statistic: float, freedom: int, count: int, columns: int, other: Line) -> float:
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
    named = (
        ("turn", "for 10 deg more of turn", np.radians(10.0)),
        ("load", "when the load doubles", np.log(2.0)),
    )
    found: list[str] = []
    silent: list[str] = []
    for (what, where, unit), (slope, error) in zip(named, slopes, strict=True):
        if np.isnan(slope):
            continue
        if abs(slope) < 2.0 * error:
            silent.append(what)
            continue
        way = "rises" if slope > 0.0 else "falls"
        found.append(f"{way} by {abs(slope) * unit:.2g} {where}")
    said = " and ".join(found) or "changes with turn and load together"
    rest = f", and does not change with the {silent[0]} beyond chance" if found and silent else ""
    return f"A constant mu is not enough (p = {p_value:.2g}): mu {said}{rest}."


def _untold(words: str, freedom: int) -> Constancy:
    nothing = float("nan")
    return Constancy(nothing, freedom, nothing, nothing, nothing, nothing, nothing, words)


__all__ = ["LEVEL", "Constancy", "constancy", "design", "known_variance"]
