"""Readings of the sensors along a history, their noise, and readings taken as one.

A model that follows the noise of a held tendon pulls it to and fro: its contacts slide to the
largest reading and remember it. So consecutive readings that noise explains are averaged before the
model follows them; their mean has less noise. Whether the force was the same in all of them is not
known: what each says of it is in `own_reading`.
"""

from __future__ import annotations

import math
from dataclasses import astuple, dataclass, fields
from typing import Any

import numpy as np
from jaxtyping import Float, Int
from numpy.typing import ArrayLike

from notchflex import InputError, Robot
from notchflex.support import AXES, check_number, check_pulls, short_repr

MAX_READINGS = 2000
"""More readings than this are refused: the time grows with the square of their number."""

# Negative tensions up to this number of standard deviations may be noise.
_MAX_NOISE = 10.0

_LARGEST = 1e6  # of a deviation; with more a sensor tells nothing

PerTendon = Float[np.ndarray, "s t"]
Table = Float[np.ndarray, "s m"]


@dataclass(frozen=True)
class SensorNoise:
    """Standard deviations of the noise of the sensors, independent from reading to reading.

    Args:
        tension: Of the measured tensions, N.
        stroke: Of the measured strokes, mm.
        tip: Of each coordinate of the measured tip position, mm.
        angle: Of the measured notch angles, rad; half a degree by default.

    Raises:
        InputError: A number that is negative or more than a million.

    Example:
        >>> SensorNoise(tension=0.02).stroke
        0.01
    """

    tension: float = 0.01
    stroke: float = 0.01
    tip: float = 0.1
    angle: float = math.radians(0.5)

    def __post_init__(self) -> None:
        """Check the numbers."""
        for one in fields(self):
            what = f"the {one.name} of SensorNoise"
            value = check_number(getattr(self, one.name), what)
            if not 0.0 <= value <= _LARGEST:
                raise InputError.OUT_OF_RANGE(
                    f"{what} is a standard deviation from 0 to {_LARGEST:g}; got {value:g}"
                )
            object.__setattr__(self, one.name, value)


@dataclass(frozen=True, eq=False)
class Readings:
    """Readings of the sensors along a history of s readings; NaN where nothing was measured.

    Attributes:
        tension: Tensions at the base, N, (s, t).
        stroke: Strokes since the free robot, mm, (s, t).
        tip: Positions of the tip in the world, mm, (s, 3).
        angles: Angles of the notches, rad, (s, n).
        noise: Standard deviations of the sensors.
        count: How many readings each row is the mean of, (s,).
    """

    tension: PerTendon
    stroke: PerTendon
    tip: Float[np.ndarray, "s 3"]
    angles: Float[np.ndarray, "s n"]
    noise: SensorNoise
    count: Float[np.ndarray, " s"]

    def __len__(self) -> int:
        """Number of readings."""
        return len(self.tension)

    @property
    def commands(self) -> tuple[PerTendon, PerTendon]:
        """Tensions and strokes that drive the model: the stroke where no tension was measured.

        A negative tension is the offset of a sensor, 0 N in the model.
        """
        no_tension = np.isnan(self.tension)
        return np.maximum(self.tension, 0.0), np.where(no_tension, self.stroke, np.nan)

    @property
    def driving_deviation(self) -> PerTendon:
        """Standard deviation of what drives the model, N or mm."""
        return np.where(np.isnan(self.tension), self.noise.stroke, self.noise.tension)

    @property
    def read(self) -> dict[str, Table]:
        """Measured values that the model must reproduce, by quantity.

        The stroke of a slack tendon says nothing: it is left out where the tension cannot be told
        from 0.
        """
        slack = ~(self.tension > 3.0 * self.noise.tension)
        return {**self.compared, "stroke": np.where(slack, np.nan, self.stroke)}

    @property
    def compared(self) -> dict[str, Table]:
        """Sensor values that the model computes, by quantity."""
        return {"stroke": self.stroke, "tip_position": self.tip, "notch_angle": self.angles}

    @property
    def deviation(self) -> dict[str, float]:
        """Standard deviation of each of these."""
        noise = self.noise
        return {"stroke": noise.stroke, "tip_position": noise.tip, "notch_angle": noise.angle}


def readings_of(
    robot: Robot,
    tensions: ArrayLike | None,
    strokes: ArrayLike | None,
    tip: ArrayLike | None,
    angles: ArrayLike | None,
    noise: SensorNoise,
) -> Readings:
    """Check readings and give them one form.

    Raises:
        InputError: Unequal numbers of readings, wrong shapes, infinite numbers, a reading in which
            a tendon has neither tension nor stroke, or nothing that the force could change.
    """
    if not isinstance(noise, SensorNoise):  # pyright: ignore[reportUnnecessaryIsInstance]
        raise InputError.WRONG_TYPE(
            f"noise must be a notchflex.SensorNoise; got {short_repr(noise)}"
        )
    columns = {
        "tensions": (tensions, robot.number_of_tendons, "one per tendon, N"),
        "strokes": (strokes, robot.number_of_tendons, "one per tendon, mm"),
        "tip": (tip, len(AXES), "x, y and z, mm"),
        "angles": (angles, robot.number_of_notches, "one per notch, rad"),
    }
    tables = {
        name: _table(value, name, width, form)
        for name, (value, width, form) in columns.items()
        if value is not None
    }
    counts = {name: len(table) for name, table in tables.items()}
    if len(set(counts.values())) > 1:
        raise InputError.WRONG_SHAPE(
            "all sensors need the same number of readings; got "
            + ", ".join(f"{count} of {name}" for name, count in counts.items())
        )
    rows = max(counts.values(), default=0)
    if rows == 0:
        raise InputError.NO_DATA("there are no readings; give tensions and strokes")
    if rows > MAX_READINGS:
        raise InputError.OUT_OF_RANGE(
            f"a history has at most {MAX_READINGS} readings; got {rows}. Leave out readings "
            "between the points where a tendon reverses"
        )
    whole = (
        tables.get(name, np.full((rows, width), np.nan)) for name, (_, width, _) in columns.items()
    )
    readings = Readings(*whole, noise=noise, count=np.ones(rows))
    _check_driven(readings)
    return readings


def _check_driven(readings: Readings) -> None:
    check_pulls(readings.tension, _MAX_NOISE * readings.noise.tension)
    neither = np.isnan(readings.tension) & np.isnan(readings.stroke)
    if neither.any():
        row, tendon = np.argwhere(neither)[0]
        raise InputError.MISSING_VALUE(
            f"reading {row + 1} has neither tension nor stroke of tendon {tendon + 1}; give one of "
            "them, 0 N for a slack tendon"
        )
    if not any(np.isfinite(values).any() for values in readings.read.values()):
        raise InputError.TOO_FEW_DATA(
            "no reading depends on the force: give tension and stroke of a tendon that is pulled, "
            "or the tip or the angles of the notches"
        )


def _table(value: Any, name: str, width: int, form: str) -> Float[np.ndarray, "s w"]:
    try:
        if isinstance(value, str | bytes) or np.asarray(value).dtype.kind not in "iufO":
            raise TypeError
        table = np.array(value, float)
    except (TypeError, ValueError, OverflowError):
        raise InputError.WRONG_TYPE(
            f"{name} must be numbers, readings by columns ({form}); got {short_repr(value)}"
        ) from None
    if table.ndim == 1:
        table = table[:, None] if width == 1 else table[None]
    if table.ndim != 2 or table.shape[1] != width:
        raise InputError.WRONG_SHAPE(
            f"{name} must have the shape readings by {width} ({form}); got {table.shape}"
        )
    if np.isinf(table).any():
        raise InputError.NOT_FINITE(f"{name} has an infinite number; give NaN where not measured")
    return table


# Standard deviations by which a reading may differ from the mean of those before it.
_SAME = 3.0


def merged(readings: Readings) -> tuple[Readings, Int[np.ndarray, " s"]]:
    """Merge consecutive readings that noise explains.

    Returns:
        The means, with how many readings each one is of, and the number of the mean, counted from
        0, that every reading went into.
    """
    noise = readings.noise
    tables = [readings.tension, readings.stroke, readings.tip, readings.angles]
    deviations = np.repeat(astuple(noise), [table.shape[1] for table in tables])
    values = np.concatenate(tables, axis=1)
    group = np.zeros(len(values), int)
    total, size = values[0], 1
    for number, row in enumerate(values[1:], 1):
        far = np.abs(row - total / size) > _SAME * deviations * np.sqrt(1.0 + 1.0 / size)
        is_same = np.array_equal(np.isnan(row), np.isnan(total)) and not far.any()
        total, size = (total + row, size + 1) if is_same else (row, 1)
        group[number] = group[number - 1] + (not is_same)
    count = np.bincount(group)
    rows = np.split(np.arange(len(group)), np.cumsum(count)[:-1])
    means = (np.array([table[some].mean(axis=0) for some in rows]) for table in tables)
    return Readings(*means, noise=noise, count=count.astype(float)), group
