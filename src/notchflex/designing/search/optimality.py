"""Multipliers of the active limits of a design.

At the best robot the sum can only fall across limits: its gradient is a combination of those of the
limits reached, with factors of the right sign. The factors say what a limit costs.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float
from scipy.optimize import lsq_linear

from notchflex.designing.search.problem import DesignEvaluation, DesignProblem, Vector

# Tolerance of active limits, relative to their size or to the span of a variable.
_REACHED = 1e-5
_REST = 1e-3
# A gradient below this part of the steepest one is flat.
_FLAT = 1e-4


@dataclass(frozen=True)
class ActiveLimit:
    """An active limit.

    Attributes:
        row: Number of the row, or of the variable.
        is_variable: Whether it is a limit of a variable.
        side: 1 for the greatest value, -1 for the least, 0 for an equality.
        cost: Change of the sum per unit of the limit, in the units of the user.
    """

    row: int
    is_variable: bool
    side: int
    cost: float


@dataclass(frozen=True)
class Multipliers:
    """Active limits of a design, with their costs.

    Attributes:
        held: Active limits.
        rest: What is left of the gradient of the sum, relative.
    """

    held: tuple[ActiveLimit, ...]
    rest: float

    @property
    def is_stationary(self) -> bool:
        """Whether no small change improves the design, to first order."""
        return self.rest <= _REST


def multipliers(problem: DesignProblem, z: Vector, one: DesignEvaluation) -> Multipliers:
    """Find the limits that are reached and what they cost.

    Args:
        problem: The problem.
        z: The scaled variables.
        one: The robot there.
    """
    span = problem.solver.variables.span
    count = problem.count
    assert one.objective.slopes is not None
    assert one.rows.slopes is not None
    gradient = one.objective.slopes[0] * span
    held, columns, low, high = _reached(problem, z, one)
    # Which of the largest numbers a bound lies on, and in which parts, is found with the rest.
    parts: list[np.ndarray] = []
    targets: list[float] = []
    groups: list[int] = []
    for k, (bound, reading) in enumerate(zip(problem.bounds, one.bounded, strict=True)):
        assert reading.slopes is not None
        top = reading.values.max() if bound.side == "above" else reading.values.min()
        size = max(np.ptp(reading.values), abs(top), 1e-12)
        near = np.flatnonzero(np.abs(reading.values - top) <= _REACHED * size)
        targets.append(1.0)
        for number in near:
            parts.append(bound.factor * reading.slopes[number] * span)
            groups.append(k)
    sizes_of = [float(np.linalg.norm(part)) for part in (gradient, *parts)]
    gross = max(*sizes_of, _FLAT * problem.steepest, 1e-300)
    matrix = np.stack([*columns, *parts], axis=1) if columns or parts else np.zeros((count, 0))
    right = -gradient
    lower, upper = (
        np.array([*low, *(0.0 for _ in parts)]),
        np.array([*high, *(np.inf for _ in parts)]),
    )
    if targets:  # the parts of a bound make one together
        weight = 1e3 * gross
        more = np.zeros((len(targets), matrix.shape[1]))
        for number, k in enumerate(groups):
            more[k, len(columns) + number] = weight
        matrix, right = (
            np.concatenate([matrix, more]),
            np.concatenate([right, weight * np.array(targets)]),
        )
    if matrix.shape[1] == 0:
        rest = float(np.linalg.norm(gradient))
        return Multipliers((), rest / gross if rest > 0.0 else 0.0)
    sizes = np.linalg.norm(matrix, axis=0)
    sizes = np.where(sizes > 0.0, sizes, 1.0)
    solved = lsq_linear(matrix / sizes, right, (lower, upper), tol=1e-12)
    factors = solved.x / sizes
    rest = float(np.linalg.norm((matrix @ factors - right)[:count]))
    costs = tuple(
        ActiveLimit(row, is_variable, side, _cost(problem, row, is_variable, side, float(factor)))
        for (row, is_variable, side), factor in zip(held, factors, strict=False)
    )
    return Multipliers(costs, rest / gross)


def _cost(problem: DesignProblem, row: int, is_variable: bool, side: int, factor: float) -> float:
    """Change of the sum per unit of the limit."""
    if is_variable:
        return -factor * side / problem.solver.variables.span[row]
    return -factor * side if side else -factor


def _reached(
    problem: DesignProblem, z: Vector, one: DesignEvaluation
) -> tuple[list[tuple[int, bool, int]], list[np.ndarray], list[float], list[float]]:
    """Limits reached, the gradients of what they limit, and the signs of their factors."""
    span = problem.solver.variables.span
    held: list[tuple[int, bool, int]] = []
    columns: list[np.ndarray] = []
    low: list[float] = []
    high: list[float] = []
    assert one.rows.slopes is not None
    numbers, slopes = one.rows.values, one.rows.slopes * span
    for k, row in enumerate(problem.rows):
        for side, limit in ((1, row.upper), (-1, row.lower)):
            if row.is_equality and side < 0:
                continue
            if not np.isfinite(limit) or side * (limit - numbers[k]) > _REACHED * problem.sizes[k]:
                continue
            held.append((k, False, 0 if row.is_equality else side))
            columns.append(slopes[k] if row.is_equality else side * slopes[k])
            low.append(-np.inf if row.is_equality else 0.0)
            high.append(np.inf)
    unit: Float[np.ndarray, "v v"] = np.eye(problem.count)
    for k in range(problem.count):
        for side, limit in ((1, 1.0), (-1, 0.0)):
            if abs(z[k] - limit) <= _REACHED:
                held.append((k, True, side))
                columns.append(side * unit[k])
                low.append(0.0)
                high.append(np.inf)
    return held, columns, low, high
