"""The set of forces that fit the readings: what noise and stuck friction leave open.

A tendon that sticks keeps its stroke while the force changes, and what the contacts then remember
depends on the force that acted. So beside the best history others are followed, one for each
component and sign, that keep the component as large, or as small, as the readings allow in every
reading. The ends of the interval are the extremes of all of them.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Bool, Float
from scipy.stats import chi2

from notchflex.sensing.history import History, OwnReading, Progress, state_after, whitening_of
from notchflex.sensing.model import Force, SolvedState
from notchflex.sensing.search import ReadingProblem, best, best_of_all, extreme, fits_badly

Forces = Float[np.ndarray, "s d"]


@dataclass(frozen=True, eq=False)
class Bounds:
    """Ends of the set of forces that fit, reading by reading, before averaging.

    Attributes:
        force: The best force, N, (s, d).
        low: Smallest value of each component, N, (s, d).
        high: Largest value of each component, N, (s, d).
        limited: Whether the range of the search ends the set, not the readings, (s, d).
        no_force: How much worse no force fits than the best one, the least of all histories, (s,).
    """

    force: Forces
    low: Forces
    high: Forces
    limited: Bool[np.ndarray, "s d"]
    no_force: Float[np.ndarray, " s"]


def bounds(
    history: History,
    readings: list[list[OwnReading]],
    level: float,
    progress: Progress | None = None,
) -> Bounds:
    """Follow the extreme histories beside the best one.

    Args:
        history: The best forces and their noise.
        readings: The readings that went into each of its means.
        level: Part of all cases that the interval of a component shall contain.
        progress: Called with the means done and their number.
    """
    size, count = history.model.size, sum(map(len, readings))
    most = float(chi2.ppf(level, 1))
    rest = np.zeros(size)
    best = _Tracker(None, rest)
    extremes = [
        _Tracker(None, rest, component, side) for component in range(size) for side in (-1.0, 1.0)
    ]
    force, low, high = np.zeros((3, count, size))
    ends = Bounds(force, low, high, np.zeros((count, size), bool), np.zeros(count))
    for number, members in enumerate(readings):
        point = history.best[number]
        first: list[_Tracker] = []
        after = extremes
        for reading in members:
            # The first reading comes from the state before; the force of another may change after
            # that, with tendons held: from the mean, or from the ends of the first. None goes on
            # from the one before it, whose noise the contacts would remember.
            before = [replace(best, force=point.variables), *(first or extremes)]
            after = _add(ends, history, number, reading, before, most)
            first = first or after
            best = _Tracker(state_after(point), point.variables)
        extremes = after
        if progress is not None:
            progress(number + 1, len(history.best))
    return ends


def _add(
    ends: Bounds,
    history: History,
    number: int,
    reading: OwnReading,
    trackers: list[_Tracker],
    most: float,
) -> list[_Tracker]:
    """Find the ends of one reading; return the extreme histories that go on to it."""
    model, mean, row = history.model, history.best[number].variables, reading.number
    forces: list[np.ndarray] = []
    after: list[_Tracker] = []
    worse = np.inf
    for tracker in trackers:
        # The noise of the readings before is in the covariance for the best history, and for the
        # others in what they are.
        covariance = history.alone if tracker.side else history.covariance
        white = whitening_of(covariance[number] + reading.extra)
        problem = ReadingProblem(model, reading.step, tracker.state, white)
        point = best_of_all(problem, [tracker.force, mean])
        if point is None or fits_badly(point):
            # No force makes this history fit: it was none, the best goes on.
            problem = replace(problem, start=trackers[0].state)
            point = best(problem, [mean]) or history.best[number]
        if not tracker.side:
            # What noise does not explain of its distance from the mean is a change of the force.
            ends.force[row] = mean + reading.part * (point.variables - mean)
            forces.append(ends.force[row])
        least = point.merit
        for goal in trackers[1:]:
            own = goal is tracker
            if not own and model.size > 1 and tracker.side:
                continue  # in space each follows its own component
            end = extreme(problem, point, goal.component, goal.side, least + most)
            forces += [end.inside.variables, end.force]
            ends.limited[row, goal.component] |= end.limited
            if own:
                inside = end.inside
                after.append(replace(goal, state=state_after(inside), force=inside.variables))
        worse = min(worse, float(problem.misfits(np.zeros((1, model.size)))[0]) - least)
    ends.low[row], ends.high[row] = np.min(forces, axis=0), np.max(forces, axis=0)
    ends.no_force[row] = max(worse, 0.0)
    return after


@dataclass(frozen=True, eq=False)
class _Tracker:
    """A history that is followed: its last state and force, and what it keeps extreme if any."""

    state: SolvedState
    force: Force
    component: int = 0
    side: float = 0.0
