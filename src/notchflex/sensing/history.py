"""Forces reading by reading along a history, and the noise that they inherit.

The model is followed from reading to reading with the tensions that were measured, and the force of
every reading is found in turn: what the contacts remember of it passes on to the next.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Float, Int

from notchflex.search.least_squares import SearchPoint
from notchflex.sensing.model import Force, SensingModel, SensingStep, SolvedState
from notchflex.sensing.readings import Readings
from notchflex.sensing.search import ReadingProblem, best, best_of_all

Progress = Callable[[int, int], None]
Covariance = Float[np.ndarray, "m m"]

LINEAR = 0.1
"""A deviation beyond this part of the range of the search is none of first order."""


@dataclass(frozen=True, eq=False)
class History:
    """The best forces of a history.

    Attributes:
        model: The robot and its readings.
        steps: The readings, as they are compared.
        best: What fits best, reading by reading, up to the first that does not converge.
        covariance: Of the deviations of each reading by the noise of all up to it, (m, m) each.
        alone: The same by the noise of this reading alone, (m, m) each.
        by_force: Slopes of each reading by its force, (m, d) each.
        by_drive: Slopes of each reading by what drives the model in it, (m, t) each.
        gain: Change of each force by every unit of noise, (d, noises) each.
    """

    model: SensingModel
    steps: list[SensingStep]
    best: list[SearchPoint]
    covariance: list[Covariance]
    alone: list[Covariance]
    by_force: list[Float[np.ndarray, "m d"]]
    by_drive: list[Float[np.ndarray, "m t"]]
    gain: list[Float[np.ndarray, "d noises"]]

    @property
    def linear(self) -> float:
        """Largest deviation of a force that is of first order, N."""
        return LINEAR * self.model.largest


def state_after(point: SearchPoint) -> SolvedState:
    """Return the solved state of a force, to go on from."""
    path = point.solution
    return path.prepared.state.unpack(path.run.states[-1])


def estimate(model: SensingModel, progress: Progress | None = None) -> History:
    """Find the force of every reading, one after the other; without their noise yet."""
    history = History(model, [], [], [], [], [], [], [])
    state, force = None, np.zeros(model.size)
    for number in range(len(model.readings)):
        step, point = _estimate_one(model, number, state, force)
        if point is None:
            break
        history.steps.append(step)
        history.best.append(point)
        state, force = state_after(point), point.variables
        if progress is not None:
            progress(number + 1, len(model.readings))
    return history


def _estimate_one(
    model: SensingModel, number: int, state: SolvedState, force: Force
) -> tuple[SensingStep, SearchPoint | None]:
    step = model.step(number)
    problem = ReadingProblem(model, step, state, np.diag(step.variance**-0.5))
    point = best_of_all(problem, [force])
    if point is None or not len(step.entries):
        return step, point
    drives = model.drive_slopes(state, point.solution, number)[step.entries]
    noise = np.diag(step.variance) + (drives * step.driving) @ drives.T
    point = best(replace(problem, whitening=whitening_of(noise)), [point.variables])
    if state is not None and point is not None:
        way = model.between_readings(state, number, np.stack([force, point.variables]))
        step = replace(step, variance=step.variance + way[step.entries] ** 2)
    return step, point


def whitening_of(covariance: Covariance) -> Covariance:
    """Return the matrix that makes deviations of a covariance independent of unit variance."""
    return np.linalg.inv(np.linalg.cholesky(covariance))


def with_noise(history: History) -> History:
    """Carry the noise of all readings through a history, to first order.

    A noise is one number that was read in one reading. It changes the force of its own reading and,
    by what the contacts remember, those after it.
    """
    model, steps, points = history.model, history.steps, history.best
    history = History(model, steps, points, [], [], [], [], [])
    if not points:
        return history
    path = model.follow(np.array([point.variables for point in points]))
    every = range(len(points))
    by_drive = np.array([model.slopes(path, step, of_drives=True) for step in every])
    by_force = np.array([model.slopes(path, step) for step in every])
    for k in every:
        if not np.isfinite(by_drive[k, k]).all():
            start = state_after(points[k - 1]) if k else None
            by_drive[k, k] = model.drive_slopes(start, points[k].solution, k)
    # What is not known of the memory of so hard a state is left out.
    by_drive, by_force = np.nan_to_num(by_drive), np.nan_to_num(by_force)
    sizes = [len(step.entries) for step in steps]
    tendons = by_drive.shape[-1]
    first = np.cumsum([0, *sizes])
    noises = int(first[-1]) + len(steps) * tendons
    before = np.zeros((model.size, noises))
    for k, step in enumerate(steps):
        rows = step.entries
        read = np.zeros((len(rows), noises))
        read[np.arange(len(rows)), first[k] + np.arange(len(rows))] = np.sqrt(step.variance)
        for j in range(k, -1, -1):
            columns = slice(int(first[-1]) + j * tendons, int(first[-1]) + (j + 1) * tendons)
            read[:, columns] -= by_drive[j, k][rows] * np.sqrt(steps[j].driving)
            if j == k:
                history.alone.append(read @ read.T)
            else:
                read -= by_force[j, k][rows] @ history.gain[j]
        covariance = read @ read.T
        white = whitening_of(covariance)
        history.by_force.append(by_force[k, k][rows])
        history.by_drive.append(by_drive[k, k][rows])
        slopes = white @ history.by_force[-1]
        gain = known_inverse(slopes, history.linear)
        before = before + gain @ (white @ read - slopes @ before)
        history.covariance.append(covariance)
        history.gain.append(before)
    return history


def known_inverse(slopes: Float[np.ndarray, "m d"], most: float) -> Float[np.ndarray, "d m"]:
    """Return the least-squares solution, without directions whose deviation exceeds `most`.

    There the tendons stick, or nothing is read: to first order the noise would move the force by
    any amount, while what the contacts remember of it stays within the interval.

    Args:
        slopes: Change of whitened readings by the force.
        most: Largest deviation that counts, N.
    """
    left, values, right = np.linalg.svd(slopes, full_matrices=False)
    kept = values * most > 1.0
    inverse = np.where(kept, 1.0 / np.where(kept, values, 1.0), 0.0)
    return (right.T * inverse) @ left.T


# A reading that was averaged with others. The model follows the means, for its contacts must not
# follow the noise. That noise explains how far readings are apart does not show that the force was
# the same in all of them. So the force and the interval of each are found from its own numbers and
# its own noise, at the tension of the mean and from the state before it.


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
    extra: Covariance
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
    # The part of the distances from the mean that noise does not explain, as James and Stein
    # estimate means (Efron and Morris 1973, *Stein's Estimation Rule and Its Competitors*): 0 where
    # they are those of noise alone, towards 1 where they are larger.
    apart, freedom = measured - step.measured, (count - 1) * measured.shape[1]
    whitening = whitening_of(noise + np.diag(step.resolution))
    total = float(((apart @ whitening.T) ** 2).sum())
    part = 1.0 - freedom / total if total > freedom else 0.0
    extra = noise * (1.0 - 1.0 / count)
    white = whitening_of(history.covariance[number] + extra)
    information = white @ history.by_force[number]
    inverse = known_inverse(information, history.linear) @ white
    scale = np.sqrt(step.noise), by_drive * np.sqrt(step.driving * count)
    root = np.sqrt(1.0 - 1.0 / count) * np.concatenate([np.diag(scale[0]), scale[1]], axis=1)
    rest = extra, part, information, history.gain[number], inverse @ root
    return [
        OwnReading(int(row), replace(step, measured=values), *rest)
        for row, values in zip(rows, measured, strict=True)
    ]
