"""The coefficient of friction from many readings of the two-weight rig (Liu 2022, fig. 7-8)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from notchflex.fit.friction_rig.constancy import Constancy, constancy, design, known_variance
from notchflex.fit.friction_rig.readings import FrictionReadings
from notchflex.fit.friction_rig.scattered import fit_line, mean_interval, outliers

# A tendon that rubs more than that is more likely a wrong unit.
_RARE = 1.0


@dataclass(frozen=True, eq=False, repr=False)
class FrictionRig:
    """What readings of the two-weight rig say of the friction; see `friction_rig`.

    Attributes:
        readings: The N readings.
        coefficient: The likeliest coefficient of friction.
        interval: Its 95 % profile-likelihood interval; NaN where one reading tells none.
        standard_error: Its standard error; NaN likewise.
        spread: Standard deviation of the coefficients of the readings; NaN for one.
        scatter: How much of it the standard deviations that were given do not explain.
        outliers: Readings, from 0, that lie too far from the others.
        without_outliers: The coefficient without these; the same where there are none.
        constancy: Whether a constant coefficient is enough.
    """

    readings: FrictionReadings
    coefficient: float
    interval: tuple[float, float]
    standard_error: float
    spread: float
    scatter: float
    outliers: tuple[int, ...]
    without_outliers: float
    constancy: Constancy

    def __repr__(self) -> str:
        """Coefficient and interval."""
        low, high = self.interval
        return (
            f"<FrictionRig: mu = {self.coefficient:.4g} ({low:.4g} to {high:.4g}), "
            f"{len(self.readings)} readings of {self.readings.source}>"
        )

    @property
    def words(self) -> tuple[str, ...]:
        """What there is to say, a sentence each."""
        low, high = self.interval
        count = len(self.readings)
        if np.isnan(low):
            first = (
                f"mu = {self.coefficient:.4g} from one reading, without a standard deviation: how "
                "far it can be trusted is not known; take more readings, or give standard "
                "deviations."
            )
            return (first,)
        of = "one reading" if count == 1 else f"{count} readings"
        said = [f"mu = {self.coefficient:.4g}, 95 % interval {low:.4g} to {high:.4g}, from {of}."]
        if count > 1:
            said.append(f"The readings spread by {self.spread:.2g} (standard deviation).")
        if low == high:
            said.append(
                "They agree to rounding, which no readings of a rig do: how far mu can be trusted "
                "is not known; give standard deviations."
            )
        if self.coefficient > _RARE:
            said.append("So large a coefficient is rare: are the turns in degrees?")
        given = np.isfinite(self.readings.coefficient_deviation)
        if given.all() and count > 1:
            typical = float(np.sqrt(np.mean(self.readings.coefficient_deviation**2)))
            more = (
                "which explain the spread"
                if self.scatter < 0.5 * typical
                else f"which leave a scatter of {self.scatter:.2g} unexplained"
            )
            said.append(f"Their standard deviations stand for {typical:.2g}, {more}.")
        said += [self._outlier(reading) for reading in self.outliers]
        if self.outliers:
            those = "it" if len(self.outliers) == 1 else "them"
            said.append(f"Without {those} mu would be {self.without_outliers:.4g}.")
        if count > 1:
            said.append(self.constancy.words)
        return tuple(said)

    def _outlier(self, reading: int) -> str:
        value = self.readings.coefficient[reading]
        return (
            f"{self.readings.at(reading)}: mu = {value:.4g} lies too far from the others to be "
            "chance; look at this reading again."
        )


def friction_rig(readings: FrictionReadings) -> FrictionRig:
    """Estimate the coefficient of friction from readings of the two-weight rig.

    Every reading has a coefficient by Liu's eq. 21. These are taken as Gaussian about one value,
    with the variance that their standard deviations give plus one more for all, found from the
    readings: rig and tendon differ from reading to reading. The likeliest value and its
    profile-likelihood interval follow; where no standard deviations are given they are mean and
    Student's interval.

    Args:
        readings: The readings.

    Returns:
        The coefficient, with how far to trust it, and whether a constant is enough.

    Example:
        >>> rig = FrictionReadings([200.0] * 3, [150.0, 151.0, 149.5], [1.6] * 3, [1.6] * 3)
        >>> friction_rig(rig)
        <FrictionRig: mu = 0.06946 (0.06641 to 0.07251), 3 readings of readings>
    """
    y, known = readings.coefficient, known_variance(readings)
    count = len(y)
    line = fit_line(np.ones((count, 1)), y, known)
    test = constancy(readings)
    off = outliers(_explained(readings, test), y, known)
    left = np.delete(np.arange(count), off)
    without = fit_line(np.ones((len(left), 1)), y[left], known[left])
    alone = count == 1 and known[0] == 0.0
    error = float("nan") if alone else float(np.sqrt(line.covariance[0, 0]))
    return FrictionRig(
        readings=readings,
        coefficient=float(line.values[0]),
        interval=mean_interval(y, known),
        standard_error=error,
        spread=float(np.std(y, ddof=1)) if count > 1 else float("nan"),
        scatter=float(np.sqrt(line.rest * count / max(count - 1, 1))),
        outliers=off,
        without_outliers=float(without.values[0]),
        constancy=test,
    )


def _explained(readings: FrictionReadings, test: Constancy) -> NDArray[np.float64]:
    """What readings may depend on without being outliers: nothing, where a constant is enough."""
    told = [True, not np.isnan(test.by_turn), not np.isnan(test.by_load)]
    return design(readings)[:, told if test.enough is False else [True, False, False]]


__all__ = ["FrictionRig", "friction_rig"]
