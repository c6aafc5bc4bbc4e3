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

from notchflex.sensing.history import History, Progress, whitening_of
from notchflex.sensing.own_reading import OwnReading
from notchflex.sensing.search import Known, ReadingProblem, bad_fit, best, best_of_all, extreme
from notchflex.solver.residual import SolverState


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

    force: Float[np.ndarray, "s d"]
    low: Float[np.ndarray, "s d"]
    high: Float[np.ndarray, "s d"]
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
    size = history.model.size
    most = float(chi2.ppf(level, 1))
    directions = [sign * row for row in np.eye(size) for sign in (-1.0, 1.0)]
    extremes = [_Tracker(None, np.zeros(size), direction) for direction in directions]
    state = None
    count = sum(map(len, readings))
    force, low, high = np.zeros((3, count, size))
    ends = Bounds(force, low, high, np.zeros((count, size), bool), np.zeros(count))
    for number, (candidate, members) in enumerate(zip(history.best, readings, strict=True)):
        before = [_Tracker(state, candidate.force, None), *extremes]
        for column, one in enumerate(members):
            # The first reading comes from the state before; the force of another may change after
            # that, with tendons held: from the mean, or from the ends of the first. None goes on
            # from the one before it, whose noise the contacts would remember.
            trackers = [replace(tracker) for tracker in before]
            _add(ends, history, number, one, trackers, most)
            extremes = trackers[1:]
            if column == 0:
                before = [_Tracker(candidate.state, candidate.force, None), *extremes]
        state = candidate.state
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
) -> None:
    """Find the ends of one reading; the trackers go on to it."""
    model, candidate, row = history.model, history.best[number], reading.number
    before, size = trackers[0].state, history.model.size
    forces: list[np.ndarray] = []
    worse: list[float] = []
    solved = _SolvedFrom()
    for tracker in trackers:
        # The noise of the readings before is in the covariance for the best history, and for the
        # others in what they are.
        covariance = history.covariance if tracker.direction is None else history.alone
        white = whitening_of(covariance[number] + reading.extra)
        problem = ReadingProblem(
            model, reading.step, tracker.state, white, solved.known(tracker.state)
        )
        at = best_of_all(problem, np.stack([tracker.force, candidate.force]))
        if bad_fit(at):  # no force makes this history fit: it was none, the best goes on
            problem = replace(problem, start=before, known=solved.known(before))
            at = best(problem, candidate.force[None])
        if tracker is trackers[0]:
            # What noise does not explain of its distance from the mean is a change of the force.
            ends.force[row] = candidate.force + reading.part * (at.force - candidate.force)
            forces = [ends.force[row]]
        for which, direction in enumerate(one.direction for one in trackers[1:]):
            assert direction is not None
            own = direction is tracker.direction
            if not own and size > 1 and tracker.direction is not None:
                continue  # in space each follows its own component
            end = extreme(problem, at, direction, at.misfit + most)
            forces += [end.inside.force, end.force]
            ends.limited[row, which // 2] |= end.limited
            if own:
                tracker.state, tracker.force = end.inside.state, end.inside.force
        worse.append(problem.candidates(np.zeros((1, size)))[0].misfit - at.misfit)
    ends.low[row], ends.high[row] = np.min(forces, axis=0), np.max(forces, axis=0)
    ends.no_force[row] = max(min(worse, default=0.0), 0.0)


@dataclass(eq=False)
class _Tracker:
    """A history that is followed: its last state and force, and what it keeps extreme if any."""

    state: SolverState | None
    force: Float[np.ndarray, " d"]
    direction: Float[np.ndarray, " d"] | None


class _SolvedFrom:
    """Results in one reading, by their initial state: histories may share one."""

    def __init__(self) -> None:
        """Begin with nothing."""
        self._known: list[tuple[SolverState | None, Known]] = []

    def known(self, state: SolverState | None) -> Known:
        """Return what was solved from a state."""
        for one, known in self._known:
            if one is state:
                return known
        self._known.append((state, {}))
        return self._known[-1][1]
