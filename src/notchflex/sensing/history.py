"""Forces reading by reading along a history, and the noise that they inherit.

The model is followed from reading to reading with the tensions that were measured, and the force of
every reading is found in turn: what the contacts remember of it passes on to the next.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Float

from notchflex import EquilibriumPath
from notchflex.analysis.tangent import PathTangents
from notchflex.sensing.model import SensingModel, SensingStep
from notchflex.sensing.search import Candidate, ReadingProblem, best, best_of_all
from notchflex.solver.residual import SolverState
from notchflex.support import Change

Progress = Callable[[int, int], None]

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
    best: list[Candidate]
    covariance: list[Float[np.ndarray, "m m"]]
    alone: list[Float[np.ndarray, "m m"]]
    by_force: list[Float[np.ndarray, "m d"]]
    by_drive: list[Float[np.ndarray, "m t"]]
    gain: list[Float[np.ndarray, "d noises"]]

    @property
    def linear(self) -> float:
        """Largest deviation of a force that is of first order, N."""
        return LINEAR * self.model.largest


def estimate(model: SensingModel, progress: Progress | None = None) -> History:
    """Find the force of every reading, one after the other; without their noise yet."""
    history = History(model, [], [], [], [], [], [], [])
    state, force = None, np.zeros(model.size)
    for number in range(len(model.readings)):
        step, candidate = _estimate_one(model, number, state, force)
        if not np.isfinite(candidate.misfit):
            break
        history.steps.append(step)
        history.best.append(candidate)
        state, force = candidate.state, candidate.force
        if progress is not None:
            progress(number + 1, len(model.readings))
    return history


def _estimate_one(
    model: SensingModel, number: int, state: SolverState | None, force: Float[np.ndarray, " d"]
) -> tuple[SensingStep, Candidate]:
    step = model.step(number)
    problem = ReadingProblem(model, step, state, np.diag(step.variance**-0.5))
    at = best_of_all(problem, force[None])
    if not len(step.entries):
        return step, at
    if np.isfinite(at.misfit):
        drives = model.drive_slopes(state, at.solved.alone, number)[step.entries]
        noise = np.diag(step.variance) + (drives * step.driving) @ drives.T
        problem = replace(problem, whitening=whitening_of(noise))
        at = best(problem, at.force[None])
    if state is not None and np.isfinite(at.misfit):
        way = model.between_readings(state, number, np.stack([force, at.force]))
        step = replace(step, variance=step.variance + way[step.entries] ** 2)
    return step, at


def whitening_of(covariance: Float[np.ndarray, "m m"]) -> Float[np.ndarray, "m m"]:
    """Return the matrix that makes deviations of a covariance independent of unit variance."""
    if not len(covariance):
        return covariance
    return np.linalg.inv(np.linalg.cholesky(covariance))


def with_noise(history: History) -> History:
    """Carry the noise of all readings through a history, to first order.

    A noise is one number that was read in one reading. It changes the force of its own reading and,
    by what the contacts remember, those after it.
    """
    model, steps, candidate = history.model, history.steps, history.best
    history = History(model, steps, candidate, [], [], [], [], [])
    if not candidate:
        return history
    forces = np.array([one.force for one in candidate])
    path = model.follow(forces)
    by_drive, by_force = _slopes_along(model, path)
    for k, own in enumerate(by_drive[range(len(candidate)), range(len(candidate))]):
        if not np.isfinite(own).all():
            start = candidate[k - 1].state if k else None
            by_drive[k, k] = model.drive_slopes(start, candidate[k].solved.alone, k).T
    # What is not known of the memory of so hard a state is left out.
    by_drive, by_force = np.nan_to_num(by_drive), np.nan_to_num(by_force)
    sizes = [len(step.entries) for step in steps]
    tendons = by_drive.shape[2]
    first = np.cumsum([0, *sizes])
    noises = int(first[-1]) + len(steps) * tendons
    before = np.zeros((model.size, noises))
    for k, step in enumerate(steps):
        rows = step.entries
        read = np.zeros((len(rows), noises))
        read[np.arange(len(rows)), first[k] + np.arange(len(rows))] = np.sqrt(step.variance)
        for j in range(k, -1, -1):
            columns = slice(int(first[-1]) + j * tendons, int(first[-1]) + (j + 1) * tendons)
            read[:, columns] -= by_drive[j, k][:, rows].T * np.sqrt(steps[j].driving)
            if j == k:
                history.alone.append(read @ read.T)
            else:
                read -= by_force[j, k][:, rows].T @ history.gain[j]
        covariance = read @ read.T
        white = whitening_of(covariance)
        history.by_force.append(by_force[k, k][:, rows].T)
        history.by_drive.append(by_drive[k, k][:, rows].T)
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


def _slopes_along(
    model: SensingModel, path: EquilibriumPath
) -> tuple[Float[np.ndarray, "s s t outputs"], Float[np.ndarray, "s s d outputs"]]:
    """Change of each reading by the command of each tendon, and by the force, of each before."""
    tangents = PathTangents(path, model.outputs)
    results = []
    for changes in (model.drive_changes(path), model.force_changes(path)):
        slopes = []
        for step in range(len(path)):
            row = []
            for change in changes:
                load = np.zeros((len(path), len(change)))
                load[step] = change
                along = tangents.along([Change(load, None)])[0]
                parts = [along[name].reshape(len(path), -1) for name in model.outputs]
                row.append(np.concatenate(parts, axis=1))
            slopes.append(np.stack(row, axis=1))
        results.append(np.array(slopes))
    return results[0], results[1]
