"""Where the constraints cannot be met together: the robot that misses them least."""

from __future__ import annotations

from typing import Any

import numpy as np
from scipy.optimize import least_squares

from notchflex.designing.search.problem import DesignEvaluation, DesignProblem, Vector

_EVALUATIONS = 60
_INSIDE = 1e-10


def nearest(
    problem: DesignProblem, z: Vector, first: DesignEvaluation
) -> tuple[Vector, DesignEvaluation]:
    """Search for the smallest sum of squares of what constraints are missed by, in their sizes.

    Args:
        problem: The problem.
        z: The start, scaled.
        first: The robot there.

    Returns:
        The best robot met, and its vector.
    """
    span = problem.solver.variables.span
    best = [z, first]
    last: list[Any] = [z, first]

    def at(vector: Vector) -> DesignEvaluation:
        if not np.array_equal(vector, last[0]):
            found = problem.evaluate(vector)
            if found is None:
                return last[1]
            last[:] = [vector.copy(), found]
            if problem.worst(found) < problem.worst(best[1]):  # pyright: ignore
                best[:] = [vector.copy(), found]
        return last[1]

    def residuals(vector: Vector) -> np.ndarray:
        found = at(vector)
        penalty = 0.0 if np.array_equal(vector, last[0]) else 1e3
        return problem.violation(found) + penalty

    def jacobian(vector: Vector) -> np.ndarray:
        found = at(vector)
        full = problem.with_slopes(found, last[0])
        if full is None:
            return np.zeros((len(problem.rows), problem.count))
        found = last[1] = full
        missed = problem.violation(found) != 0.0
        assert found.rows.slopes is not None
        return np.where(missed[:, None], found.rows.slopes * span / problem.sizes[:, None], 0.0)

    if problem.count and problem.rows:
        least_squares(
            residuals,
            np.clip(z, _INSIDE, 1.0 - _INSIDE),
            jacobian,  # pyright: ignore[reportArgumentType]
            (np.zeros(problem.count), np.ones(problem.count)),
            ftol=1e-10,
            xtol=1e-10,
            gtol=1e-12,
            max_nfev=_EVALUATIONS,
        )
    full = problem.with_slopes(best[1], best[0])  # pyright: ignore
    return (z, first) if full is None else (best[0], full)  # pyright: ignore
