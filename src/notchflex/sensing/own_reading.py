"""The evidence of one reading that was averaged with others.

The model follows the means, for its contacts must not follow the noise. That noise explains how far
readings are apart does not show that the force was the same in all of them. So the force and the
interval of each are found from its own numbers and its own noise, at the tension of the mean and
from the state before it.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Float, Int

from notchflex.sensing.history import History, known_inverse, whitening_of
from notchflex.sensing.model import SensingStep
from notchflex.sensing.readings import Readings


@dataclass(frozen=True, eq=False)
class OwnReading:
    """One reading, compared with the model of the mean that it went into.

    Attributes:
        number: Which reading, from 0.
        step: The mean, with the numbers of this reading at the tension of the mean.
        extra: Covariance of its noise beyond that of the mean, (m, m).
        part: Which part of its distance from the mean is taken for a change of the force, 0 to 1.
        information: Slopes by the force, whitened by its own noise, (m, d).
        gain: Change of its force by every unit of noise of the mean, (d, noises).
        more: The same by its own noise beyond that, (d, m).
    """

    number: int
    step: SensingStep
    extra: Float[np.ndarray, "m m"]
    part: float
    information: Float[np.ndarray, "m d"]
    gain: Float[np.ndarray, "d noises"]
    more: Float[np.ndarray, "d m"]


def own_readings(
    history: History, readings: Readings, group: Int[np.ndarray, " s"]
) -> list[list[OwnReading]]:
    """Return the readings of every mean of a history.

    Args:
        history: The means, with their noise.
        readings: The readings before they were averaged.
        group: Which mean each went into, counted from 0.
    """
    compared = np.concatenate([readings.compared[name] for name in history.model.outputs], axis=1)
    tension, stroke = readings.commands
    drives = np.where(np.isnan(stroke), tension, stroke)
    every = range(len(history.best))
    rows = [np.flatnonzero(group == number) for number in every]
    return [_of_mean(history, one, rows[one], compared, drives[rows[one]]) for one in every]


def _of_mean(
    history: History,
    number: int,
    rows: Int[np.ndarray, " n"],
    compared: Float[np.ndarray, "s outputs"],
    drives: Float[np.ndarray, "n t"],
) -> list[OwnReading]:
    step, by_drive = history.steps[number], history.by_drive[number]
    count = len(rows)
    # What one reading differs from the mean, but for what its tension explains.
    measured = compared[np.ix_(rows, step.entries)] - (drives - drives.mean(axis=0)) @ by_drive.T
    noise = np.diag(step.noise) + by_drive * (step.driving * count) @ by_drive.T
    part = _change(measured - step.measured, noise + np.diag(step.resolution))
    extra = noise * (1.0 - 1.0 / count)
    white = whitening_of(history.covariance[number] + extra)
    information = white @ history.by_force[number]
    inverse = known_inverse(information, history.linear) @ white
    scale = np.sqrt(step.noise), by_drive * np.sqrt(step.driving * count)
    root = np.sqrt(1.0 - 1.0 / count) * np.concatenate([np.diag(scale[0]), scale[1]], axis=1)
    rest = extra, part, information, history.gain[number], inverse @ root
    if count == 1:  # it is its mean, to the last digit
        return [OwnReading(int(rows[0]), step, *rest)]
    return [
        OwnReading(int(row), replace(step, measured=values), *rest)
        for row, values in zip(rows, measured, strict=True)
    ]


def _change(apart: Float[np.ndarray, "n m"], noise: Float[np.ndarray, "m m"]) -> float:
    """Return the part of distances from a mean that noise does not explain.

    As James and Stein estimate means (Efron and Morris 1973, *Stein's Estimation Rule and Its
    Competitors*): 0 where the distances are those of noise alone, towards 1 where they are larger.
    """
    freedom = (len(apart) - 1) * apart.shape[1]
    if not freedom:
        return 0.0
    total = float(((apart @ whitening_of(noise).T) ** 2).sum())
    return 1.0 - freedom / total if total > freedom else 0.0
