"""Readings that differ by no more than noise, taken as one.

A model that follows the noise of a held tendon pulls it to and fro: its contacts slide to the
largest reading and remember it. So consecutive readings that noise explains are averaged before the
model follows them; their mean has less noise. Whether the force was the same in all of them is not
known: what each says of it is in `own_reading`.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from jaxtyping import Float, Int

from notchflex.sensing.readings import Readings

# Standard deviations by which a reading may differ from the mean of those before it.
_SAME = 3.0


def merged(readings: Readings) -> tuple[Readings, Int[np.ndarray, " s"]]:
    """Merge consecutive readings that noise explains.

    Returns:
        The means, with how many readings each one is of, and the number of the mean, counted from
        0, that every reading went into.
    """
    noise = readings.noise
    sensors = (readings.tension, readings.stroke, readings.tip, readings.angles)
    values = np.concatenate(sensors, axis=1)
    deviations = np.concatenate(
        [
            np.full(table.shape[1], one)
            for table, one in zip(
                sensors, (noise.tension, noise.stroke, noise.tip, noise.angle), strict=True
            )
        ]
    )
    group = _groups(values, deviations)
    count = np.bincount(group)
    means = [_means(table, group) for table in sensors]
    tension, stroke, tip, angles = means
    joined = replace(
        readings, tension=tension, stroke=stroke, tip=tip, angles=angles, count=count.astype(float)
    )
    return joined, group


def _groups(
    values: Float[np.ndarray, "s m"], deviations: Float[np.ndarray, " m"]
) -> Int[np.ndarray, " s"]:
    """Return which group every reading belongs to."""
    group = np.zeros(len(values), int)
    total, size = values[0].copy(), 1
    for number, row in enumerate(values[1:], 1):
        apart = np.abs(row - total / size)
        same_sensors = np.array_equal(np.isnan(row), np.isnan(total))
        if same_sensors and not (apart > _SAME * deviations * np.sqrt(1.0 + 1.0 / size)).any():
            total, size = total + row, size + 1
            group[number] = group[number - 1]
        else:
            total, size = row.copy(), 1
            group[number] = group[number - 1] + 1
    return group


def _means(table: Float[np.ndarray, "s m"], group: Int[np.ndarray, " s"]) -> np.ndarray:
    first = np.flatnonzero(np.diff(group, prepend=-1))
    size = np.diff(np.append(first, len(group)))
    means = np.add.reduceat(table, first, axis=0) / size[:, None]
    # One reading alone stays what it is, to the last digit.
    return np.where((size == 1)[:, None], table[first], means)
