"""The friction rig: a coefficient of friction from two weights on one string over two edges.

The heavier weight m1 is just about to pull the string over edges at which it turns by a1 and a2.
Capstan friction, which robots have by default, gives mu = ln(m1 / m2) / (a1 + a2).

By the corner law (Liu 2022, eq. 20-21) each edge takes its ratio. With q = (m1 - m2)/(m1 + m2) and
b = tan(a / 2),

    q = mu (b1 + b2) / (1 + mu^2 b1 b2),

the sum of two hyperbolic tangents. Its smaller root is eq. 21, written below so that it is exact
for equal weights too, where the printed form is 0 / 0.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any, Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

from notchflex import InputError, __version__
from notchflex.fit.measurements.csv import check_deviation, deviation_header
from notchflex.fit.scattered import (
    Constancy,
    constancy_of,
    design_of,
    fit_line,
    mean_interval,
    outliers,
)
from notchflex.support import DEGREES, AnyPath, read_data_table

Numbers = NDArray[np.float64]
Law = Literal["capstan", "corner"]
LAWS: tuple[Law, ...] = ("capstan", "corner")
"""Friction laws of an edge."""

COLUMNS = {
    "weight_1": "weight_1_g",
    "weight_2": "weight_2_g",
    "turn_1": "turn_1_deg",
    "turn_2": "turn_2_deg",
}
"""Numbers of a reading, and their columns."""

# A larger coefficient of a tendon is more likely a wrong unit.
_RARE = 1.0
# Relative size of complex steps: its square is far below rounding.
_COMPLEX_STEP = 1e-30


def coefficient_from_weights(
    weight_1: ArrayLike,
    weight_2: ArrayLike,
    turn_1: ArrayLike,
    turn_2: ArrayLike,
    law: Law = "capstan",
) -> Numbers:
    """Return the coefficient of friction of readings of the two-weight rig.

    Args:
        weight_1: Weight that pulls, in any unit, (n,).
        weight_2: Weight that is just about to be lifted, in the same unit; no more than the other.
        turn_1: Turn of the string over the first edge or round the first rod, rad, (n,); for the
            corner law less than pi.
        turn_2: Turn over the second edge, rad, (n,).
        law: The friction law of an edge; "corner" is that of Liu 2022 (eq. 21).

    Returns:
        The coefficient, (n,).

    Raises:
        InputError: A reading is impossible; the message names it, counted from 1.

    Example:
        >>> mu = coefficient_from_weights(200.0, [150.0, 200.0], 0.5 * np.pi, 0.5 * np.pi)
        >>> mu.round(4).tolist()
        [0.0916, 0.0]
    """
    values = _floats(weight_1, weight_2, turn_1, turn_2)
    if (wrong := impossible(np.stack([np.ravel(value) for value in values]), law)) is not None:
        raise InputError.OUT_OF_RANGE(f"reading {wrong[0] + 1}: {wrong[1]}")
    return _coefficient(values, law)


def _coefficient(values: Any, law: Law) -> Any:
    m1, m2, a1, a2 = values
    if law == "capstan":
        return np.log(m1 / m2) / (a1 + a2)
    b1, b2 = np.tan(0.5 * a1), np.tan(0.5 * a2)
    part, total = (m1 - m2) / (m1 + m2), b1 + b2
    return 2.0 * part / (total + np.sqrt(total**2 - 4.0 * part**2 * b1 * b2))


def slopes_of_coefficient(values: Numbers, law: Law) -> Numbers:
    """Return derivatives of the coefficient by weights and turns, (4, N), by complex steps."""
    steps = 1j * _COMPLEX_STEP * np.eye(4)[:, :, None]
    return np.stack([_coefficient(values + step, law).imag for step in steps]) / _COMPLEX_STEP


def weight_held(
    weight_1: ArrayLike,
    coefficient: ArrayLike,
    turn_1: ArrayLike,
    turn_2: ArrayLike,
    law: Law = "capstan",
) -> Numbers:
    """Return the weight that the larger one is just about to lift.

    It is the inverse of `coefficient_from_weights`.

    Args:
        weight_1: Weight that pulls, in any unit, (n,).
        coefficient: Coefficient of friction, one or one a reading.
        turn_1: Turn of the string over the first edge, rad, (n,).
        turn_2: Turn over the second edge, rad, (n,).
        law: The friction law of an edge.

    Returns:
        The weight, in the unit of the other, (n,).

    Raises:
        InputError: Friction at an edge would hold any pull, and the corner law says nothing.

    Example:
        >>> print(f"{weight_held(200.0, 0.15, 1.5, 1.2):.3f} g")
        133.395 g
    """
    m1, mu, a1, a2 = _floats(weight_1, coefficient, turn_1, turn_2)
    if law == "capstan":
        return m1 * np.exp(-mu * (a1 + a2))
    friction = mu * np.tan(0.5 * np.stack([a1, a2]))
    if not (friction < 1.0).all():
        raise InputError.OUT_OF_RANGE(
            "an edge would hold any pull, because coefficient * tan(turn / 2) is 1 or more; give a "
            "smaller coefficient or turn"
        )
    return m1 * np.prod((1.0 - friction) / (1.0 + friction), axis=0)


def _floats(*values: ArrayLike) -> tuple[Numbers, ...]:
    return np.broadcast_arrays(*(np.asarray(value, float) for value in values))


def impossible(values: Numbers, law: Law) -> tuple[int, str] | None:
    """Return number (from 0) and reason of the first impossible reading; None if there is none."""
    most, limit = (np.inf, "or more") if law == "capstan" else (np.pi, "to less than 180 deg")
    m1, m2, a1, a2 = values
    straight = "the string does not turn (0 deg over both edges), so"
    checks = {
        "both weights must be above 0.": ~((m1 > 0.0) & (m2 > 0.0)),
        f"a string turns over an edge by 0 {limit} (friction law: {law}).": ~(
            (values[2:] >= 0.0) & (values[2:] < most)
        ).all(axis=0),
        "weight 2 is larger than weight 1, which it cannot be while weight 1 pulls; swap them if "
        "the other one did.": m2 > m1,
        f"{straight} that no friction could hold the difference of the weights.": (
            (a1 + a2 == 0.0) & (m1 != m2)
        ),
        f"{straight} friction has no effect.": a1 + a2 == 0.0,
    }
    wrong = [(int(np.argmax(bad)), words) for words, bad in checks.items() if bad.any()]
    return min(wrong, key=lambda reading: reading[0], default=None)


@dataclass(frozen=True, eq=False, repr=False)
class FrictionReadings:
    """N readings of the rig: weight 1 is just about to lift weight 2 over two edges.

    Attributes:
        weight_1: Weight that pulls, g, (N,).
        weight_2: Weight that is lifted, g, (N,).
        turn_1: Turn of the string over the first edge, rad, (N,).
        turn_2: Turn over the second edge, rad, (N,).
        deviation: Standard deviations of these four, in their order and units, (N, 4); NaN if
            unknown. A reading without any is taken to be as accurate as the others.
        law: The friction law of an edge, "capstan" or "corner" (Liu 2022).
        source: Where they come from.
        lines: Their lines in the file; empty if there is none.
        ignored: Columns of the file that were not used.

    Raises:
        InputError: Shapes that do not match, or an impossible reading.

    Example:
        >>> rig = FrictionReadings([200.0, 300.0], [150.0, 221.0], [1.6, 1.6], [1.6, 1.6])
        >>> rig.coefficient.round(4).tolist()
        [0.0899, 0.0955]
    """

    weight_1: Numbers
    weight_2: Numbers
    turn_1: Numbers
    turn_2: Numbers
    deviation: Numbers = field(default_factory=lambda: np.zeros(0))
    law: Law = "capstan"
    source: str = "readings"
    lines: tuple[int, ...] = ()
    ignored: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        """Check the numbers, and convert them to arrays of floats."""
        if self.law not in LAWS:
            raise InputError.UNKNOWN_NAME(
                f"there is no friction law {self.law!r} of a rig; allowed are {', '.join(LAWS)}"
            )
        values = vars(self)
        values |= {name: np.array(values[name], float, ndmin=1) for name in COLUMNS}
        count = len(self.weight_1)
        deviation = np.array(self.deviation, float)
        deviation = deviation if deviation.size else np.full((count, 4), np.nan)
        values["deviation"] = deviation
        if any(values[name].shape != (count,) for name in COLUMNS) or deviation.shape != (count, 4):
            raise InputError.WRONG_SHAPE(
                "readings need four numbers each, and as many standard deviations"
            )
        if not count:
            raise InputError.NO_DATA("there are no readings; give at least one")
        finite = np.isfinite(self.values).all() and not np.isinf(deviation).any()
        if not finite or (deviation <= 0.0).any():
            raise InputError.NOT_FINITE(
                "readings must be finite, their standard deviations above 0 or NaN where not known"
            )
        if (wrong := impossible(self.values, self.law)) is not None:
            raise InputError.OUT_OF_RANGE(f"{self.at(wrong[0])}: {wrong[1]}")

    def __len__(self) -> int:
        """Number of readings."""
        return len(self.weight_1)

    def __repr__(self) -> str:
        """Return the source and the number of readings."""
        return f"<FrictionReadings of {self.source}: {len(self)}>"

    @property
    def values(self) -> Numbers:
        """Weights and turns, (4, N)."""
        return np.stack([getattr(self, name) for name in COLUMNS])

    def at(self, reading: int) -> str:
        """Return where a reading (from 0) stands, for messages."""
        if self.lines:
            return f"{self.source}, line {self.lines[reading]}"
        return f"{self.source}, reading {reading + 1}"

    @cached_property
    def coefficient(self) -> Numbers:
        """Coefficient of friction of every reading, (N,)."""
        return _coefficient(self.values, self.law)

    @cached_property
    def coefficient_deviation(self) -> Numbers:
        """Its standard deviation from those of the reading, (N,); NaN if none is known.

        To first order; those that are unknown count as 0.
        """
        part = slopes_of_coefficient(self.values, self.law).T * np.nan_to_num(self.deviation)
        is_given = ~np.isnan(self.deviation).all(axis=1)
        return np.where(is_given, np.linalg.norm(part, axis=1), np.nan)

    @property
    def known_variance(self) -> Numbers:
        """Variance of every coefficient from the standard deviations of its reading, (N,).

        A reading without any is as accurate as the others in the mean; 0 if none has any.
        """
        variance = self.coefficient_deviation**2
        is_known = np.isfinite(variance)
        return np.where(is_known, variance, np.mean(variance[is_known]) if is_known.any() else 0.0)

    @property
    def turn(self) -> Numbers:
        """Turn of the string over both edges, rad, (N,)."""
        return self.turn_1 + self.turn_2


def read_friction_rig(
    source: AnyPath,
    law: Law = "capstan",
    columns: Mapping[str, str] | None = None,
) -> FrictionReadings:
    r"""Read readings of the two-weight rig from a CSV.

    The file is UTF-8 with commas and its header first, with the columns `weight_1_g`,
    `weight_2_g`, `turn_1_deg` and `turn_2_deg` and, if known, `weight_1_sd_g`, `turn_1_sd_deg` and
    so on; lines that start with `#` are skipped, other columns ignored.

    Args:
        source: Path of the file.
        law: The friction law of an edge.
        columns: Headers of the file for columns, such as `{"weight_1_g": "Gewicht"}`.

    Returns:
        The readings, in the order of the file.

    Raises:
        InputError: The file cannot be used, or a reading is impossible; the message names the
            line.

    Example:
        >>> from pathlib import Path
        >>> text = "weight_1_g,weight_2_g,turn_1_deg,turn_2_deg\n200,150,90,90\n"
        >>> _ = Path("rig.csv").write_text(text)
        >>> read_friction_rig("rig.csv").coefficient.round(4).tolist()
        [0.0916]
    """
    table = read_data_table(source, columns)
    missing = [column for column in COLUMNS.values() if column not in table.header]
    if missing:
        words = f"column{'s'[: len(missing) - 1]} {', '.join(missing)}"
        raise InputError.TABLE_COLUMNS(
            f"{table.name}: the {words} {'are' if missing[1:] else 'is'} not there; "
            f"{table.columns}."
        )
    deviation = np.full((len(table), len(COLUMNS)), np.nan)
    values: dict[str, Numbers] = {}
    for number, (name, column) in enumerate(COLUMNS.items()):
        spread, scale = deviation_header(column), _scale(column)
        values[name] = table.numbers(column) / scale
        if spread in table.header:
            deviations = table.numbers(spread, may_miss=True)
            check_deviation(table, spread, deviations)
            deviation[:, number] = deviations / scale
    return FrictionReadings(
        **values,
        deviation=deviation,
        law=law,
        source=table.name,
        lines=table.lines,
        ignored=table.unused([*COLUMNS.values(), *map(deviation_header, COLUMNS.values())]),
    )


def _scale(column: str) -> float:
    return DEGREES if column.endswith("_deg") else 1.0


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
        coefficients = {self.readings.law: self.coefficient}
        for law in LAWS:
            if law not in coefficients:
                try:
                    coefficients[law] = float(np.mean(replace(self.readings, law=law).coefficient))
                except InputError:  # a turn of half a turn or more
                    coefficients[law] = float("nan")
        return coefficients

    @property
    def words(self) -> tuple[str, ...]:
        """The result in sentences."""
        law = self.readings.law
        ((other, value),) = ((name, mu) for name, mu in self.by_law.items() if name != law)
        by_other = (
            f"{other!r} has no mu for turns of 180 deg or more."
            if np.isnan(value)
            else f"by {other!r} mu would be {value:.4g}."
        )
        (low, high), count = self.interval, len(self.readings)
        first = (
            f"mu = {self.coefficient:.4g} from one reading, without a standard deviation: how far "
            "it can be trusted is not known; take more readings, or give standard deviations."
            if np.isnan(low)
            else f"mu = {self.coefficient:.4g}, 95 % interval {low:.4g} to {high:.4g}, from "
            f"{'one reading' if count == 1 else f'{count} readings'}."
        )
        doubts = () if np.isnan(low) else self._doubts
        return first, f"For friction.kind {law!r}; {by_other}", *doubts

    @property
    def _doubts(self) -> list[str]:
        """How the readings scatter, and what speaks against them."""
        readings, several = self.readings, len(self.readings) > 1
        said: list[str] = []
        if several:
            said.append(f"The readings spread by {self.spread:.2g} (standard deviation).")
        if self.interval[0] == self.interval[1]:
            said.append(
                "They agree to rounding, which no readings of a rig do: how far mu can be trusted "
                "is not known; give standard deviations."
            )
        if self.coefficient > _RARE:
            said.append("So large a coefficient is rare: are the turns in degrees?")
        deviation = readings.coefficient_deviation
        if np.isfinite(deviation).all() and several:
            typical = float(np.sqrt(np.mean(deviation**2)))
            more = (
                "which explain the spread"
                if self.scatter < 0.5 * typical
                else f"which leave a scatter of {self.scatter:.2g} unexplained"
            )
            said.append(f"Their standard deviations correspond to {typical:.2g} in mu, {more}.")
        said += [
            f"{readings.at(reading)}: mu = {readings.coefficient[reading]:.4g} lies too far from "
            "the others to be chance; look at this reading again."
            for reading in self.outliers
        ]
        if self.outliers:
            those = "it" if len(self.outliers) == 1 else "them"
            said.append(f"Without {those} mu would be {self.without_outliers:.4g}.")
        return [*said, self.constancy.words] if several else said


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
    design = design_of(readings.turn, readings.weight_1)
    return constancy_of(design, readings.coefficient, readings.known_variance)


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
    y, variance, test = readings.coefficient, readings.known_variance, constancy(readings)
    count, mean = len(y), np.ones((len(y), 1))
    line = fit_line(mean, y, variance)
    # Readings far off by their turn or load are not outliers if a constant is not enough.
    varies = np.isfinite([test.by_turn, test.by_load]) & (test.enough is False)
    columns = np.flatnonzero([True, *varies])
    off = outliers(design_of(readings.turn, readings.weight_1)[:, columns], y, variance)
    without = fit_line(*(np.delete(array, off, axis=0) for array in (mean, y, variance)))
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
    columns: dict[str, Any] = {"line": readings.lines} if readings.lines else {}
    for number, (name, column) in enumerate(COLUMNS.items()):
        columns[column] = getattr(readings, name) * _scale(column)
        columns[deviation_header(column)] = readings.deviation[:, number] * _scale(column)
    columns["coefficient"] = readings.coefficient
    columns["coefficient_sd"] = readings.coefficient_deviation
    same = ("coefficient", "standard_error", "spread", "scatter", "without_outliers", "words")
    return {
        "program": "notchflex",
        "version": __version__,
        "data": readings.source,
        "law": readings.law,
        **{name: getattr(rig, name) for name in same},
        "coefficient_by_law": rig.by_law,
        "interval_95": rig.interval,
        "outliers": [number + 1 for number in rig.outliers],
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
        "ignored_columns": readings.ignored,
        "readings": [
            dict(zip(columns, row, strict=True)) for row in zip(*columns.values(), strict=True)
        ],
    }
