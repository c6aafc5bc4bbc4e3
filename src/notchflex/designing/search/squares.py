"""Designs without constraints that are to come near to targets or curves: least squares."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from scipy.optimize import least_squares

from notchflex.designing.model.wishes import Wish
from notchflex.designing.search.problem import DesignEvaluation, DesignProblem, Vector
from notchflex.designing.search.rows import squared
from notchflex.designing.specification.asked import DesignObjective

_EVALUATIONS = 30
_INSIDE, _PRECISION = 1e-9, 1e-5
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
        ftol=_PRECISION,
        xtol=_PRECISION,
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
