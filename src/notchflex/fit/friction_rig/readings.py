"""Readings of the two-weight friction rig, and reading them from a CSV."""

from __future__ import annotations

import os
from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from notchflex import InputError
from notchflex.fit.friction_rig.two_weights import (
    LAWS,
    Law,
    coefficient_from_weights,
    impossible,
    slopes_of_coefficient,
)
from notchflex.fit.measurements.csv import check_deviation
from notchflex.support import read_data_table

COLUMNS = {
    "weight_1": ("weight_1_g", "weight_1_sd_g"),
    "weight_2": ("weight_2_g", "weight_2_sd_g"),
    "turn_1": ("turn_1_deg", "turn_1_sd_deg"),
    "turn_2": ("turn_2_deg", "turn_2_sd_deg"),
}
"""Field of the readings to its column, and to that of its standard deviation."""


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

    weight_1: NDArray[np.float64]
    weight_2: NDArray[np.float64]
    turn_1: NDArray[np.float64]
    turn_2: NDArray[np.float64]
    deviation: NDArray[np.float64] = field(default_factory=lambda: np.zeros(0))
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
        arrays = [np.array(getattr(self, name), float, ndmin=1) for name in COLUMNS]
        count = len(arrays[0])
        deviation = np.array(self.deviation, float)
        if not deviation.size:
            deviation = np.full((count, 4), np.nan)
        if any(one.shape != (count,) for one in arrays) or deviation.shape != (count, 4):
            raise InputError.WRONG_SHAPE(
                "readings need four numbers each, and as many standard deviations"
            )
        if not count:
            raise InputError.NO_DATA("there are no readings; give at least one")
        if not np.isfinite(arrays).all() or np.isinf(deviation).any() or (deviation <= 0.0).any():
            raise InputError.NOT_FINITE(
                "readings must be finite, their standard deviations above 0 or NaN where not known"
            )
        for name, value in zip(COLUMNS, arrays, strict=True):
            object.__setattr__(self, name, value)
        object.__setattr__(self, "deviation", deviation)
        first, second, *turns = arrays
        wrong = impossible(first, second, turns[0], turns[1], self.law)
        if wrong is not None:
            raise InputError.OUT_OF_RANGE(f"{self.at(wrong[0])}: {wrong[1]}")

    def __len__(self) -> int:
        """Number of readings."""
        return len(self.weight_1)

    def __repr__(self) -> str:
        """Return the source and the number of readings."""
        return f"<FrictionReadings of {self.source}: {len(self)}>"

    def at(self, reading: int) -> str:
        """Return where a reading (from 0) stands, for messages."""
        if self.lines:
            return f"{self.source}, line {self.lines[reading]}"
        return f"{self.source}, reading {reading + 1}"

    @cached_property
    def coefficient(self) -> NDArray[np.float64]:
        """Coefficient of friction of every reading, (N,)."""
        return coefficient_from_weights(
            self.weight_1, self.weight_2, self.turn_1, self.turn_2, self.law
        )

    @cached_property
    def coefficient_deviation(self) -> NDArray[np.float64]:
        """Its standard deviation from those of the reading, (N,); NaN if none is known.

        To first order; those that are unknown count as 0.
        """
        slopes = slopes_of_coefficient(
            self.coefficient, self.weight_1, self.weight_2, self.turn_1, self.turn_2, self.law
        )
        is_given = ~np.isnan(self.deviation)
        part = slopes.T * np.where(is_given, self.deviation, 0.0)
        return np.where(is_given.any(axis=1), np.sqrt(np.sum(part**2, axis=1)), np.nan)

    @property
    def turn(self) -> NDArray[np.float64]:
        """Turn of the string over both edges, rad, (N,)."""
        return self.turn_1 + self.turn_2


def read_friction_rig(
    source: str | os.PathLike[str],
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
    missing = [column for column, _ in COLUMNS.values() if column not in table.header]
    if missing:
        words = f"column{'s'[: len(missing) - 1]} {', '.join(missing)}"
        raise InputError.TABLE_COLUMNS(
            f"{table.name}: the {words} {'are' if missing[1:] else 'is'} not there; "
            f"{table.columns}."
        )
    deviation = np.full((len(table), len(COLUMNS)), np.nan)
    values: dict[str, NDArray[np.float64]] = {}
    for number, (name, (column, spread)) in enumerate(COLUMNS.items()):
        values[name] = table.numbers(column)
        if spread in table.header:
            deviation[:, number] = table.numbers(spread, may_miss=True)
            check_deviation(table, spread, deviation[:, number])
        if column.endswith("_deg"):
            values[name] = np.radians(values[name])
            deviation[:, number] = np.radians(deviation[:, number])
    used = [name for pair in COLUMNS.values() for name in pair]
    return FrictionReadings(
        **values,
        deviation=deviation,
        law=law,
        source=table.name,
        lines=table.lines,
        ignored=table.unused(used),
    )
