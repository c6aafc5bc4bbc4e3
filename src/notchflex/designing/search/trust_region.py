"""Feasible points from distant starts: linear programs within a trust region.

Every step minimises the linearised sum plus a penalty on violated limits, within a box.
There is always a step, also where limits contradict each other at first, and no step leaves the
range in which derivatives predict anything: where a notch closes, the box shrinks.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.optimize import linprog

from notchflex.designing.search.problem import DesignEvaluation, DesignProblem, Vector
from notchflex.designing.search.rows import TOLERANCE
from notchflex.designing.search.trajectories import SearchTrajectory

# Initial, largest and smallest box, in parts of the ranges of the variables.
_FIRST_BOX, _MAX_BOX, _MIN_BOX = 0.15, 0.5, 1e-4
# Penalty on violations in sizes of the sum, its factor while limits stay violated, its maximum.
_PRICE, _DEARER, _DEAREST = 10.0, 10.0, 1e5
# Gain ratio above which a step is accepted, and above which the box grows.
_ACCEPTED_GAIN, _GOOD_GAIN = 0.05, 0.7
# Predicted gain, or largest violation, below which SLSQP takes over.
_MIN_GAIN, _MAX_VIOLATION = 1e-5, 1e-3
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
        if problem.worst(one) <= _MAX_VIOLATION:
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
