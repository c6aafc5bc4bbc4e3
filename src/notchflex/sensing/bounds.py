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
from notchflex.sensing.search import ReadingProblem, bad_fit, best, best_of_all, extreme
from notchflex.solver.continuation import SolverState


@dataclass(frozen=True, eq=False)
class Bounds:
    """Ends of the set of forces that fit, reading by reading.

    Attributes:
        low: Smallest value of each component, N, (s, d).
        high: Largest value of each component, N, (s, d).
        limited: Whether the range of the search ends the set, not the readings, (s, d).
        no_force: How much worse no force fits than the best one, the least of all histories, (s,).
    """

    low: Float[np.ndarray, "s d"]
    high: Float[np.ndarray, "s d"]
    limited: Bool[np.ndarray, "s d"]
    no_force: Float[np.ndarray, " s"]


def bounds(history: History, level: float, progress: Progress | None = None) -> Bounds:
    """Follow the extreme histories beside the best one.

    Args:
        history: The best forces and their noise.
        level: Part of all cases that the interval of a component shall contain.
        progress: Called with the readings done and their number.
    """
    model, size = history.model, history.model.size
    most = float(chi2.ppf(level, 1))
    every = [sign * row for row in np.eye(size) for sign in (-1.0, 1.0)]
    extremes = [_Tracker(None, np.zeros(size), direction) for direction in every]
    count = len(history.best)
    low, high = np.zeros((count, size)), np.zeros((count, size))
    limited, no_force = np.zeros((count, size), bool), np.zeros(count)
    for number, found in enumerate(history.best):
        forces, worse = [found.force], []
        before = history.best[number - 1].state if number else None
        # The noise of the readings before is in the covariance for the best history, and for the
        # others in what they are.
        for tracker in [_Tracker(before, found.force, None), *extremes]:
            covariance = history.covariance if tracker.direction is None else history.alone
            white = whitening_of(covariance[number])
            problem = ReadingProblem(model, history.steps[number], tracker.state, white)
            at = best_of_all(problem, np.stack([tracker.force, found.force]))
            if bad_fit(at):  # no force makes this history fit: it was none, the best goes on
                problem = replace(problem, start=before)
                at = best(problem, found.force[None])
            for which, direction in enumerate(every):
                own = direction is tracker.direction
                if not own and size > 1 and tracker.direction is not None:
                    continue  # in space each follows its own component
                end = extreme(problem, at, direction, at.misfit + most)
                forces += [end.inside.force, end.force]
                limited[number, which // 2] |= end.limited
                if own:
                    tracker.state, tracker.force = end.inside.state, end.inside.force
            worse.append(problem.candidates(np.zeros((1, size)))[0].misfit - at.misfit)
        low[number], high[number] = np.min(forces, axis=0), np.max(forces, axis=0)
        no_force[number] = max(min(worse, default=0.0), 0.0)
        if progress is not None:
            progress(number + 1, count)
    return Bounds(low, high, limited, no_force)


@dataclass(eq=False)
class _Tracker:
    """A history that is followed: its last state and force, and what it keeps extreme if any."""

    state: SolverState | None
    force: Float[np.ndarray, " d"]
    direction: Float[np.ndarray, " d"] | None
