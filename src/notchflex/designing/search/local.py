"""One search from one start: SLSQP, least squares, linear programs where it begins far away.

Every step minimises the linearised sum plus a penalty on violated limits, within a box.
There is always a step, also where limits contradict each other at first, and no step leaves the
range in which derivatives predict anything: where a notch closes, the box shrinks.
"""

from __future__ import annotations

import contextlib
import warnings
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
from scipy.optimize import Bounds, NonlinearConstraint, least_squares, linprog, minimize

from notchflex.designing.model.wishes import Wish
from notchflex.designing.search.optimality import multipliers
from notchflex.designing.search.problem import (
    TOLERANCE,
    DesignEvaluation,
    DesignProblem,
    Scaled,
    Vector,
    squared,
)
from notchflex.designing.search.trajectories import DuplicateSearch, SearchTrajectory
from notchflex.designing.specification import DesignObjective

_EVALUATIONS = 30
_INSIDE, _PRECISION_OF_SQUARES = 1e-9, 1e-5
# A curve is followed well enough at this part of the distance at which its points are reached.
_ENOUGH = 0.1
# A residual where there is no robot, in sizes of those at the start.
_PENALTY = 1e2


class _Enough(Exception):  # noqa: N818 - no error
    """Ends a search whose curves are followed well enough."""


def is_sum_of_squares(problem: DesignProblem) -> bool:
    """Return whether all that is asked is to come near to something."""
    return (
        bool(problem.objectives) and not problem.rows and all(map(_is_square, problem.objectives))
    )


def _is_square(wish: Wish) -> bool:
    asked = wish.asked
    assert isinstance(asked, DesignObjective)
    return asked.target is not None or (wish.take == "rms" and asked.goal == "minimise")


def nearest_squares(
    problem: DesignProblem, z: Vector, first: DesignEvaluation
) -> tuple[Vector, DesignEvaluation, bool]:
    """Search for the least sum of squares by SciPy's trust region, from a start.

    Args:
        problem: The problem; `is_sum_of_squares`.
        z: The start, scaled.
        first: The robot there, with derivatives.

    Returns:
        The vector of the best robot met, that robot with derivatives, and whether the search
        settled.
    """
    span = problem.solver.variables.span
    best: list[tuple[Vector, DesignEvaluation]] = [(z, first)]
    last: list[tuple[Vector, DesignEvaluation | None]] = [(z, first)]
    enough = _enough(problem)
    large = _PENALTY * (1.0 + np.abs(_residuals(problem, first)[0]))

    def at(vector: Vector) -> DesignEvaluation | None:
        if not np.array_equal(vector, last[0][0]):
            last[0] = vector.copy(), problem.evaluate(vector)
            one = last[0][1]
            if one is not None and one.total < best[0][1].total:
                best[0] = vector.copy(), one
                if one.total <= enough:
                    raise _Enough
        return last[0][1]

    def residuals(vector: Vector) -> np.ndarray:
        one = at(vector)
        return large if one is None else _residuals(problem, one)[0]

    def jacobian(vector: Vector) -> np.ndarray:
        one = at(vector)
        full = None if one is None else problem.with_slopes(one, vector)
        if full is None:
            return np.zeros((len(large), problem.count))
        slopes = _residuals(problem, full)[1]
        assert slopes is not None
        return slopes * span

    settled = problem.count == 0 or first.total <= enough
    if not settled:
        try:
            settled = _least(residuals, jacobian, z)
        except _Enough:
            settled = True
    vector, one = best[0]
    full = problem.with_slopes(one, vector)
    return (z, first, False) if full is None else (vector, full, settled)


def _least(
    residuals: Callable[[Vector], np.ndarray], jacobian: Callable[[Vector], np.ndarray], z: Vector
) -> bool:
    """Run SciPy's search between 0 and 1; return whether it settled."""
    result = least_squares(
        residuals,
        np.clip(z, _INSIDE, 1.0 - _INSIDE),
        jacobian,  # pyright: ignore[reportArgumentType]
        (np.zeros(len(z)), np.ones(len(z))),
        ftol=_PRECISION_OF_SQUARES,
        xtol=_PRECISION_OF_SQUARES,
        gtol=1e-12,
        max_nfev=_EVALUATIONS,
    )
    return int(result.status) > 0


def is_followed(problem: DesignProblem, total: float) -> bool:
    """Return whether nothing but curves is asked, and all are followed well enough."""
    return is_sum_of_squares(problem) and total <= _enough(problem)


def _enough(problem: DesignProblem) -> float:
    """Return the sum at which all curves are followed well enough; below 0 with other targets."""
    if any(wish.curve is None for wish in problem.objectives):
        return -1.0
    parts = ((wish.asked, wish.curve) for wish in problem.objectives)
    return sum(
        asked.weight * (_ENOUGH * curve.within) ** 2
        for asked, curve in parts
        if isinstance(asked, DesignObjective) and curve is not None
    )


def _residuals(
    problem: DesignProblem, one: DesignEvaluation
) -> tuple[np.ndarray, np.ndarray | None]:
    """What is to be 0, and its derivatives; its sum of squares is the sum that is minimised."""
    source = one.point if one.has_slopes else one.point.plain
    readings = [squared(wish, source) for wish in problem.objectives]
    values = np.concatenate([reading.values for reading in readings])
    known = [reading.slopes for reading in readings if reading.slopes is not None]
    return values, np.concatenate(known) if len(known) == len(readings) else None


# Initial, largest and smallest box, in parts of the ranges of the variables.
_FIRST_BOX, _MAX_BOX, _MIN_BOX = 0.15, 0.5, 1e-4
# Penalty on violations in sizes of the sum, its factor while limits stay violated, its maximum.
_PRICE, _DEARER, _DEAREST = 10.0, 10.0, 1e5
# Gain ratio above which a step is accepted, and above which the box grows.
_ACCEPTED_GAIN, _GOOD_GAIN = 0.05, 0.7
# Predicted gain, or largest violation, below which SLSQP takes over.
_MIN_GAIN, _FEASIBLE = 1e-5, 1e-3
_STEPS = 30


@dataclass
class _Model:
    """Sum and rows, linear about a point."""

    problem: DesignProblem
    one: DesignEvaluation
    price: float
    size: float

    def merit(self, other: DesignEvaluation) -> float:
        """Return the merit function: the sum plus the price of violated limits."""
        violation = np.abs(self.problem.violation(other)).sum()
        return other.total / self.size + self.price * float(violation)

    def step(self, z: Vector, box: float) -> tuple[Vector, float]:
        """Return the best step within a box, and the predicted merit."""
        problem, one = self.problem, self.one
        span = problem.solver.variables.span
        assert one.objective.slopes is not None
        assert one.rows.slopes is not None
        n, m, k = problem.count, len(problem.rows), len(problem.bounds)
        sizes = problem.sizes if m else np.zeros(0)
        by = one.rows.slopes * span / sizes[:, None]
        low = np.array([row.lower for row in problem.rows])
        high = np.array([row.upper for row in problem.rows])
        matrix: list[np.ndarray] = []
        right: list[np.ndarray] = []
        for side, limit in ((1.0, high), (-1.0, low)):
            is_limited = np.isfinite(limit)
            give = -np.eye(m)[is_limited]
            matrix.append(
                np.hstack([side * by[is_limited], give, np.zeros((int(is_limited.sum()), k))])
            )
            right.append(
                side * (limit[is_limited] - one.rows.values[is_limited]) / sizes[is_limited]
            )
        for number, (bound, reading) in enumerate(zip(problem.bounds, one.bounded, strict=True)):
            assert reading.slopes is not None
            rows = np.zeros((len(reading.values), n + m + k))
            rows[:, :n] = bound.sign * reading.slopes * span
            rows[:, n + m + number] = -bound.sign
            matrix.append(rows)
            right.append(-bound.sign * reading.values)
        factors = [bound.factor / self.size for bound in problem.bounds]
        cost = np.concatenate(
            [one.objective.slopes[0] * span / self.size, np.full(m, self.price), factors]
        )
        limits = [(max(-box, -a), min(box, 1.0 - a)) for a in z.tolist()]
        limits += [(0.0, np.inf)] * m + [(-np.inf, np.inf)] * k
        every = np.concatenate([np.zeros((0, n + m + k)), *matrix])
        solution = linprog(cost, every, np.concatenate([np.zeros(0), *right]), bounds=limits)
        if solution.x is None:
            return np.zeros(n), self.merit(one)
        return solution.x[:n], float(solution.fun) + float(one.objective.values.sum()) / self.size


def approach(
    problem: DesignProblem,
    z: Vector,
    first: DesignEvaluation,
    iterations: int,
    trajectory: SearchTrajectory,
) -> tuple[Vector, DesignEvaluation, int]:
    """Step to where limits hold, or are missed by least.

    Args:
        problem: The problem.
        z: The start, scaled.
        first: The robot there, with derivatives.
        iterations: Most steps.
        trajectory: Records every step; ends a duplicate search.

    Returns:
        Where it ended, the robot there with derivatives, and the number of steps.
    """
    one, box, price = first, _FIRST_BOX, _PRICE
    done = 0
    while done < min(iterations, _STEPS) and problem.count:
        if problem.worst(one) <= _FEASIBLE:
            break
        model = _Model(problem, one, price, problem.total_size)
        step, promised = model.step(z, box)
        merit = model.merit(one)
        gain = merit - promised
        if gain <= _MIN_GAIN * max(1.0, abs(merit)) or box < _MIN_BOX:
            if problem.worst(one) <= TOLERANCE or price >= _DEAREST or box < _MIN_BOX:
                break
            price *= _DEARER
            continue
        done += 1
        other = problem.evaluate(np.clip(z + step, 0.0, 1.0))
        part = -1.0 if other is None else (merit - model.merit(other)) / gain
        full = None
        if other is not None and part > _ACCEPTED_GAIN:
            full = problem.with_slopes(other, z + step)
        if full is None:
            box = 0.4 * min(box, float(np.abs(step).max()))
            continue
        z, one = np.clip(z + step, 0.0, 1.0), full
        trajectory.record(z)
        box = min(_MAX_BOX, 2.0 * box) if part > _GOOD_GAIN else box
    return z, one, done


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
