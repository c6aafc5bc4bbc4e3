"""One search from one start: SLSQP with exact derivatives, trust-constr where it stalls."""

from __future__ import annotations

import contextlib
import warnings
from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np
from scipy.optimize import Bounds, NonlinearConstraint, minimize

from notchflex.designing.search.optimality import multipliers
from notchflex.designing.search.problem import DesignEvaluation, DesignProblem, Vector
from notchflex.designing.search.rows import TOLERANCE
from notchflex.designing.search.scaled import Scaled
from notchflex.designing.search.squares import is_sum_of_squares, nearest_squares
from notchflex.designing.search.trajectories import DuplicateSearch, SearchTrajectory
from notchflex.designing.search.trust_region import approach

# SLSQP estimates the Hessian, which a kink (a closing notch) invalidates: it restarts at its end
# point, at most this number of times, while the sum falls by this part.
_AGAIN, _GAIN = 4, 1e-7
# It ends if the sum falls by less than this part in this number of iterations.
_STALLED, _PATIENCE = 1e-10, 4
_PRECISION = 1e-14
# Largest violation at the start of SLSQP, in sizes of the limits.
_MAX_VIOLATION = 0.02
_TRUST = 40


class _Stop(Exception):  # noqa: N818 - no error
    """Ends a search without further progress."""


class LocalOptimum(NamedTuple):
    """Result of a local search.

    Attributes:
        z: The scaled variables.
        evaluation: The robot there, with derivatives; None if the search could not begin.
        stationary: Whether no small change improves it, to first order.
        iterations: Number of iterations.
        trajectory: Scaled variables after each step.
    """

    z: Vector
    evaluation: DesignEvaluation | None
    stationary: bool
    iterations: int
    trajectory: tuple[Vector, ...] = ()


def search_from(
    problem: DesignProblem, z: Vector, iterations: int, settled: Sequence[LocalOptimum] = ()
) -> LocalOptimum:
    """Search from a start by SLSQP.

    Args:
        problem: The problem.
        z: The start.
        iterations: Most iterations.
        settled: Converged searches: this one ends at their robot if it meets their trajectory.

    Returns:
        The best robot.
    """
    trajectory = SearchTrajectory([one.trajectory for one in settled])
    try:
        optimum = _search(problem, z, iterations, trajectory)
    except DuplicateSearch as met:
        return settled[met.number]._replace(iterations=len(trajectory.steps))
    return optimum._replace(trajectory=(*trajectory.steps, optimum.z))


def _search(
    problem: DesignProblem, z: Vector, iterations: int, trajectory: SearchTrajectory
) -> LocalOptimum:
    first = problem.evaluate(z)
    first = None if first is None else problem.with_slopes(first, z)
    if first is None:
        return LocalOptimum(z, None, False, 0)
    stationary = False
    if is_sum_of_squares(problem):
        z, first, settled = nearest_squares(problem, z, first)
        return LocalOptimum(z, first, settled or is_stationary(problem, z, first), 0)
    z, one, done = approach(problem, z, first, iterations, trajectory)
    best = z, one
    if problem.worst(one) > _MAX_VIOLATION:  # limits that contradict each other here
        return LocalOptimum(z, one, False, done)
    for _ in range(_AGAIN):
        before = best
        best, more = _slsqp(problem, *best, iterations - done, trajectory)
        done += more
        stationary = is_stationary(problem, *best)
        if stationary or done >= iterations or not _gained(problem, before[1], best[1]):
            break
    return LocalOptimum(*best, stationary, done)


def search_on(problem: DesignProblem, optimum: LocalOptimum, iterations: int) -> LocalOptimum:
    """Go on by trust-constr where SLSQP ended without having settled."""
    if optimum.evaluation is None or problem.count == 0:
        return optimum
    best, more = _trust(problem, optimum.z, optimum.evaluation, min(_TRUST, iterations))
    if _gained(problem, optimum.evaluation, best[1]):
        again = search_from(problem, best[0], iterations)
        return again._replace(iterations=optimum.iterations + more + again.iterations)
    return optimum._replace(iterations=optimum.iterations + more)


def is_stationary(problem: DesignProblem, z: Vector, one: DesignEvaluation) -> bool:
    """Return whether all constraints hold and no small change improves a design to first order."""
    return problem.worst(one) <= TOLERANCE and multipliers(problem, z, one).is_stationary


def _gained(problem: DesignProblem, before: DesignEvaluation, after: DesignEvaluation) -> bool:
    if problem.worst(before) > TOLERANCE:
        return problem.worst(after) < 0.9 * problem.worst(before)
    return before.total - after.total > _GAIN * max(abs(before.total), 1e-12)


def _slsqp(
    problem: DesignProblem,
    z: Vector,
    first: DesignEvaluation,
    iterations: int,
    trajectory: SearchTrajectory,
) -> tuple[tuple[Vector, DesignEvaluation], int]:
    scaled = Scaled(problem, first, z, best=(z, first))
    history: list[tuple[float, float]] = []

    def watch(y: np.ndarray) -> None:
        evaluation = scaled.evaluation(y)
        if evaluation is None:
            return
        trajectory.record(np.clip(y[: problem.count], 0.0, 1.0))
        history.append((problem.worst(evaluation), scaled.value(y)))
        if len(history) <= _PATIENCE:
            return
        (before, value_before), (now, value) = history[-1 - _PATIENCE], history[-1]
        settled = abs(value_before - value) <= _STALLED * max(abs(value), 1e-12)
        if settled and abs(before - now) <= 1e-3 * TOLERANCE + _STALLED * before:
            raise _Stop

    with warnings.catch_warnings():
        warnings.simplefilter("ignore", RuntimeWarning)  # a step out of the limits is clipped
        with contextlib.suppress(_Stop):
            minimize(
                scaled.value,
                scaled.y,
                jac=scaled.gradient,
                bounds=scaled.limits,
                constraints=scaled.constraints,
                method="SLSQP",
                callback=watch,
                options={"maxiter": max(iterations, 1), "ftol": _PRECISION},
            )
    return _best(problem, scaled), len(history)


def _trust(
    problem: DesignProblem, z: Vector, first: DesignEvaluation, iterations: int
) -> tuple[tuple[Vector, DesignEvaluation], int]:
    scaled = Scaled(problem, first, z, best=(z, first))
    limits: Any = [
        NonlinearConstraint(one["fun"], 0.0, 0.0 if one["type"] == "eq" else np.inf, one["jac"])
        for one in scaled.constraints
    ]
    low = np.array([-np.inf if a is None else a for a, _ in scaled.limits])
    high = np.array([np.inf if b is None else b for _, b in scaled.limits])
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # it warns of rows that depend on each other
        result: Any = minimize(
            scaled.value,
            np.clip(scaled.y, low + 1e-6, high - 1e-6),
            jac=scaled.gradient,
            bounds=Bounds(low, high, keep_feasible=True),  # pyright: ignore[reportArgumentType]
            constraints=limits,
            method="trust-constr",
            options={"maxiter": iterations, "gtol": 1e-8},
        )
    return _best(problem, scaled), int(result.nit)


def _best(problem: DesignProblem, scaled: Scaled) -> tuple[Vector, DesignEvaluation]:
    """The best robot that a search met, with its derivatives."""
    assert scaled.best is not None
    z, one = scaled.best
    full = problem.with_slopes(one, z)
    return (scaled.start, scaled.first) if full is None else (z, full)
