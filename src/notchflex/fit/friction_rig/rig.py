"""The coefficient of friction from many readings of the two-weight rig (Liu 2022, fig. 7-8)."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from notchflex import InputError, __version__
from notchflex.fit.friction_rig.readings import COLUMNS, FrictionReadings
from notchflex.fit.friction_rig.scattered import (
    Constancy,
    constancy,
    design,
    fit_line,
    known_variance,
    mean_interval,
    outliers,
)
from notchflex.fit.friction_rig.two_weights import LAWS
from notchflex.support import DEGREES

# A larger coefficient of a tendon is more likely a wrong unit.
_RARE = 1.0


@dataclass(frozen=True, eq=False, repr=False)
class FrictionRig:
    """The coefficient of friction from readings of the two-weight rig; see `friction_rig`.

    Attributes:
        readings: The N readings.
        coefficient: The likeliest coefficient of friction.
        interval: Its 95 % profile-likelihood interval; NaN for one reading of unknown error.
        standard_error: Its standard error; NaN likewise.
        spread: Standard deviation of the coefficients of the readings; NaN for one.
        scatter: The part of it that the standard deviations given do not explain.
        outliers: Readings, from 0, that lie too far from the others.
        without_outliers: The coefficient without these; the same if there are none.
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
        """Return coefficient and interval."""
        low, high = self.interval
        return (
            f"<FrictionRig: mu = {self.coefficient:.4g} ({low:.4g} to {high:.4g}), "
            f"{len(self.readings)} readings of {self.readings.source}>"
        )

    @property
    def by_law(self) -> dict[str, float]:
        """Coefficient by each friction law, the mean for the other one; NaN where it has none."""
        found = {self.readings.law: self.coefficient}
        for law in LAWS:
            if law not in found:
                try:
                    other = replace(self.readings, law=law)
                    found[law] = float(np.mean(other.coefficient))
                except InputError:  # a turn of half a turn or more
                    found[law] = float("nan")
        return found

    @property
    def words(self) -> tuple[str, ...]:
        """The result in sentences."""
        law = self.readings.law
        ((other, value),) = ((one, at) for one, at in self.by_law.items() if one != law)
        said = (
            f"For friction.kind {law!r}; by {other!r} mu would be {value:.4g}."
            if value == value
            else f"For friction.kind {law!r}; {other!r} has no mu for turns of 180 deg or more."
        )
        first, *others = self._words
        return first, said, *others

    @property
    def _words(self) -> tuple[str, ...]:
        low, high = self.interval
        count = len(self.readings)
        if np.isnan(low):
            return (
                f"mu = {self.coefficient:.4g} from one reading, without a standard deviation: how "
                "far it can be trusted is not known; take more readings, or give standard "
                "deviations.",
            )
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
        deviation = self.readings.coefficient_deviation
        if np.isfinite(deviation).all() and count > 1:
            typical = float(np.sqrt(np.mean(deviation**2)))
            more = (
                "which explain the spread"
                if self.scatter < 0.5 * typical
                else f"which leave a scatter of {self.scatter:.2g} unexplained"
            )
            said.append(f"Their standard deviations correspond to {typical:.2g} in mu, {more}.")
        said += [
            f"{self.readings.at(reading)}: mu = {self.readings.coefficient[reading]:.4g} lies too "
            "far from the others to be chance; look at this reading again."
            for reading in self.outliers
        ]
        if self.outliers:
            those = "it" if len(self.outliers) == 1 else "them"
            said.append(f"Without {those} mu would be {self.without_outliers:.4g}.")
        if count > 1:
            said.append(self.constancy.words)
        return tuple(said)


def friction_rig(readings: FrictionReadings) -> FrictionRig:
    """Estimate the coefficient of friction from readings of the two-weight rig.

    Every reading has a coefficient by the friction law. These are taken as Gaussian about one
    value, with the variance from their standard deviations plus a common one, estimated from the
    readings: rig and tendon differ from reading to reading. The maximum of the likelihood and
    its profile give value and interval; without standard deviations these are mean and
    Student's interval.

    Args:
        readings: The readings.

    Returns:
        The coefficient with its interval, and whether a constant is enough.

    Example:
        >>> rig = FrictionReadings([200.0] * 3, [150.0, 151.0, 149.5], [1.6] * 3, [1.6] * 3)
        >>> friction_rig(rig)
        <FrictionRig: mu = 0.08956 (0.08561 to 0.0935), 3 readings of readings>
    """
    y, variance = readings.coefficient, known_variance(readings)
    count, test = len(y), constancy(readings)
    line = fit_line(np.ones((count, 1)), y, variance)
    # Readings far off by their turn or load are not outliers if a constant is not enough.
    varies = np.isfinite([0.0, test.by_turn, test.by_load]) & (test.enough is False)
    varies[0] = True
    off = outliers(design(readings)[:, varies], y, variance)
    left = np.delete(np.arange(count), off)
    without = fit_line(np.ones((len(left), 1)), y[left], variance[left])
    alone = count == 1 and variance[0] == 0.0
    return FrictionRig(
        readings=readings,
        coefficient=float(line.values[0]),
        interval=mean_interval(y, variance),
        standard_error=float("nan") if alone else float(np.sqrt(line.covariance[0, 0])),
        spread=float(np.std(y, ddof=1)) if count > 1 else float("nan"),
        scatter=float(np.sqrt(line.rest * count / max(count - 1, 1))),
        outliers=off,
        without_outliers=float(without.values[0]),
        constancy=test,
    )


def friction_document(rig: FrictionRig) -> dict[str, Any]:
    """Return an estimate as a document for `notchflex.support.write_json`.

    Args:
        rig: The estimate.

    Returns:
        `law`, `coefficient`, `coefficient_by_law`, `interval_95`, `standard_error`, `spread`,
        `scatter`, `outliers` (numbers of
        readings from 1), `without_outliers`, `constant` (the test), the result in `words`, and
        every reading with its own coefficient.
    """
    readings, test = rig.readings, rig.constancy
    rows: list[dict[str, Any]] = []
    for number in range(len(readings)):
        row: dict[str, Any] = {"line": readings.lines[number]} if readings.lines else {}
        for column, (name, (value, deviation)) in enumerate(COLUMNS.items()):
            scale = DEGREES if value.endswith("_deg") else 1.0
            row[value] = getattr(readings, name)[number] * scale
            row[deviation] = readings.deviation[number, column] * scale
        row["coefficient"] = readings.coefficient[number]
        row["coefficient_sd"] = readings.coefficient_deviation[number]
        rows.append(row)
    return {
        "program": "notchflex",
        "version": __version__,
        "data": readings.source,
        "law": readings.law,
        "coefficient": rig.coefficient,
        "coefficient_by_law": rig.by_law,
        "interval_95": rig.interval,
        "standard_error": rig.standard_error,
        "spread": rig.spread,
        "scatter": rig.scatter,
        "outliers": [number + 1 for number in rig.outliers],
        "without_outliers": rig.without_outliers,
        "constant": {
            "enough": test.enough,
            "statistic": test.statistic,
            "degrees_of_freedom": test.degrees_of_freedom,
            "p_value": test.p_value,
            "by_turn_per_rad": test.by_turn,
            "by_turn_standard_error": test.by_turn_error,
            "by_log_load": test.by_load,
            "by_log_load_standard_error": test.by_load_error,
        },
        "words": rig.words,
        "ignored_columns": readings.ignored,
        "readings": rows,
    }
