"""Finding the least value of a function whose slope and (about) curvature are known, within limits.

A damped Newton step (Levenberg 1944, Marquardt 1963): the curvature is that of the objective with
the residuals' own curvature left out, so it is never negative. Values at a limit that want to leave
it are held there. A trial value at which the model has no solution counts as too high.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np
from jaxtyping import Bool, Float

from notchflex.fit.estimation.curvature import unit_free

# Damping at first, by how much it falls and grows, and where no smaller step is worth a trial.
_FIRST, _FALL, _GROW, _MOST = 1e-3, 0.2, 4.0, 1e12
_ITERATIONS = 100
# What a full step may still promise at a kink, of the objective.
_KINK = 1e-3


class Cost(NamedTuple):
    """An objective at some values.

    Attributes:
        value: Its value.
        gradient: Its derivatives.
        curvature: About its second derivatives, never negative.
        residuals: What it was made of.
        shares: What each residual adds to the gradient.
    """

    value: float
    gradient: Float[np.ndarray, " k"]
    curvature: Float[np.ndarray, "k k"]
    residuals: Any = None
    shares: Float[np.ndarray, "r k"] = np.zeros((0, 0))


class Minimum(NamedTuple):
    """Where a search ended.

    Attributes:
        values: The values.
        cost: The objective there, with slopes; None where it could not start.
        converged: Whether nothing lower is near.
        reason: Why not, "" where it is.
        iterations: Steps taken.
        calls: How often the objective was evaluated.
    """

    values: Float[np.ndarray, " k"]
    cost: Cost | None
    converged: bool
    reason: str
    iterations: int
    calls: int


Objective = Callable[[Float[np.ndarray, " k"]], Cost | None]
"""Values -> cost with its slopes, or None where the model has no solution."""


def minimise(
    objective: Objective,
    start: Float[np.ndarray, " k"],
    lower: Float[np.ndarray, " k"],
    upper: Float[np.ndarray, " k"],
    *,
    tolerance: float = 1e-10,
) -> Minimum:
    """Search from a start for the least value.

    Args:
        objective: The function.
        start: Where to begin.
        lower: Least values allowed.
        upper: Greatest values allowed.
        tolerance: Stop where a full step promises to lower the objective by less than this,
            absolute and relative to it.

    Returns:
        Where it ended, converged or why not.

    Example:
        >>> def bowl(at):
        ...     return Cost(float((at - 2.0) @ (at - 2.0)), 2.0 * (at - 2.0), 2.0 * np.eye(1))
        >>> minimise(bowl, np.zeros(1), np.zeros(1), np.ones(1)).values
        array([1.])
    """
    at = np.clip(np.asarray(start, float), lower, upper)
    cost = objective(at)
    calls = 1
    if cost is None:
        return Minimum(at, None, False, "the model has no solution at the start", 0, calls)
    damping = _FIRST
    size = np.zeros(len(at))
    for iteration in range(_ITERATIONS):
        size = np.maximum(size, np.diag(cost.curvature))
        if _promised(cost, at, lower, upper) <= tolerance * (1.0 + abs(cost.value)):
            return Minimum(at, cost, True, "", iteration, calls)
        while True:
            step = _step(cost, at, lower, upper, damping * np.where(size > 0.0, size, 1.0))
            promised = -(cost.gradient @ step + 0.5 * step @ cost.curvature @ step)
            trial = objective(np.clip(at + step, lower, upper)) if promised > 0.0 else None
            calls += 1
            gain = -1.0 if trial is None else (cost.value - trial.value) / promised
            if trial is not None and gain > 1e-4:
                break
            damping *= _GROW
            if damping > _MOST:
                return _at_kink(cost, at, lower, upper, iteration, calls)
        at = np.clip(at + step, lower, upper)
        damping = max(damping * (_FALL if gain > 0.5 else 1.0 if gain > 0.1 else 2.0), 1e-12)
        cost = trial
    return Minimum(at, cost, False, f"not settled after {_ITERATIONS} steps", _ITERATIONS, calls)


def _at_kink(
    cost: Cost, at: np.ndarray, lower: np.ndarray, upper: np.ndarray, iteration: int, calls: int
) -> Minimum:
    """Where no step, however small, lowers the objective: a kink, or rounding.

    Measurements at which a notch closes make kinks; if a full step would not have gained much
    either, that is as good as any other minimum.
    """
    settled = _promised(cost, at, lower, upper) <= _KINK * (1.0 + abs(cost.value))
    reason = "" if settled else "no step lowers the objective (a kink, or rounding)"
    return Minimum(at, cost, settled, reason, iteration, calls)


def free_of_limits(
    gradient: Float[np.ndarray, " k"],
    at: Float[np.ndarray, " k"],
    lower: Float[np.ndarray, " k"],
    upper: Float[np.ndarray, " k"],
) -> Bool[np.ndarray, " k"]:
    """Which values may move: not those at a limit that the slope pushes against."""
    return ~(((at <= lower) & (gradient > 0.0)) | ((at >= upper) & (gradient < 0.0)))


def _promised(cost: Cost, at: np.ndarray, lower: np.ndarray, upper: np.ndarray) -> float:
    """By how much a full step would lower the objective, were it as simple as its curvature."""
    free = free_of_limits(cost.gradient, at, lower, upper)
    plain = unit_free(cost.curvature[np.ix_(free, free)])
    values, vectors = np.linalg.eigh(plain.curvature)
    along = vectors.T @ (cost.gradient[free] / plain.size)
    known = values > 1e-12
    return 0.5 * float(np.sum(along[known] ** 2 / values[known]))


def _step(
    cost: Cost, at: np.ndarray, lower: np.ndarray, upper: np.ndarray, damping: np.ndarray
) -> Float[np.ndarray, " k"]:
    """The damped step that ends within the limits; what would pass one stops there."""
    step = np.zeros(len(at))
    free = free_of_limits(cost.gradient, at, lower, upper)
    for _ in range(len(at)):
        if not free.any():
            break
        held = cost.curvature[np.ix_(free, ~free)] @ step[~free]
        matrix = cost.curvature[np.ix_(free, free)] + np.diag(damping[free])
        step[free] = np.linalg.solve(matrix, -(cost.gradient[free] + held))
        beyond = free & ((at + step < lower) | (at + step > upper))
        if not beyond.any():
            break
        step[beyond] = np.clip(at + step, lower, upper)[beyond] - at[beyond]
        free &= ~beyond
    return step


__all__ = ["Cost", "Minimum", "Objective", "free_of_limits", "minimise"]
