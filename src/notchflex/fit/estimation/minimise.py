"""Finding the least value of a function whose gradient and (about) curvature are known, in limits.

`scipy.optimize.least_squares` does the search: its trust region, and its steps along limits. It
takes residuals; a function that is no sum of squares is given to it as residuals that have its
value, gradient and curvature. A trial value at which the model has no solution counts as too high.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, NamedTuple, cast

import numpy as np
from jaxtyping import Float
from scipy.optimize import least_squares

_EVALUATIONS = 200
# What a full step may still promise where the search ends, of the objective: at a kink, such as
# where a notch closes, no step gains what the curvature promises.
_KINK = 1e-3


class Cost(NamedTuple):
    """An objective at some values.

    Attributes:
        value: Its value, 0 or more.
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
        tolerance: Stop where a step lowers the objective by less than this part of it.

    Returns:
        Where it ended, converged or why not.

    Example:
        >>> def bowl(at):
        ...     return Cost(float((at - 2.0) @ (at - 2.0)), 2.0 * (at - 2.0), 2.0 * np.eye(1))
        >>> minimise(bowl, np.zeros(1), np.zeros(1), np.ones(1)).values
        array([1.])
    """
    first = np.clip(np.asarray(start, float), lower, upper)
    cost = objective(first)
    if cost is None:
        return Minimum(first, None, False, "the model has no solution at the start", 0, 1)
    own, size = np.diag(cost.curvature), np.where(first == 0.0, 1.0, np.abs(first))
    scale = np.where(own > 0.0, 1.0 / np.sqrt(np.where(own > 0.0, own, 1.0)), size)
    least, most = (lower - first) / scale, (upper - first) / scale
    tried: dict[bytes, Cost | None] = {np.zeros(len(first)).tobytes(): cost}

    def values(moved: Float[np.ndarray, " k"]) -> Float[np.ndarray, " k"]:
        at = np.where(moved <= least, lower, np.where(moved >= most, upper, first + scale * moved))
        return np.clip(at, lower, upper)

    def cost_at(moved: Float[np.ndarray, " k"]) -> Cost | None:
        key = moved.tobytes()
        if key not in tried:
            tried[key] = objective(values(moved))
        return tried[key]

    def residuals(moved: Float[np.ndarray, " k"]) -> Float[np.ndarray, " k+1"]:
        came = cost_at(moved)
        return np.full(len(moved) + 1, np.inf) if came is None else _squares(came, scale)[0]

    def jacobian(moved: Float[np.ndarray, " k"]) -> Float[np.ndarray, "k+1 k"]:
        came = cost_at(moved)
        assert came is not None  # asked only where the residuals are finite
        return _squares(came, scale)[1]

    found = least_squares(
        residuals,
        np.zeros(len(first)),
        cast("Any", jacobian),  # SciPy's annotations forget functions, and that it may be None
        (least, most),
        method="dogbox",
        ftol=tolerance,
        xtol=1e-10,
        gtol=cast("Any", None),
        max_nfev=_EVALUATIONS,
    )
    at, cost = values(found.x), cost_at(found.x)
    assert cost is not None
    # How much lower a full step of the values that are not at a limit should be.
    residual, slopes = _squares(cost, scale)
    free = slopes[:, found.active_mask == 0]
    promised = 0.5 * np.sum((free @ np.linalg.lstsq(free, residual)[0]) ** 2)
    settled = promised <= _KINK * (1.0 + cost.value)
    reason = "" if settled else "no step lowers the objective (a kink, or rounding)"
    if found.status == 0:
        reason = f"not settled after {_EVALUATIONS} evaluations"
    return Minimum(at, cost, not reason, reason, int(found.njev) - 1, len(tried))


def _squares(
    cost: Cost, scale: Float[np.ndarray, " k"]
) -> tuple[Float[np.ndarray, " k+1"], Float[np.ndarray, "k+1 k"]]:
    """Residuals f with slopes J of scaled values: |f|^2 / 2 is the objective, J^T f its gradient.

    J^T J is its curvature, or more: the objective is never below 0, so no step may promise to
    lower it by more than its value.
    """
    sizes, axes = np.linalg.eigh(cost.curvature * np.outer(scale, scale))
    known = sizes > 1e-12 * sizes[-1]
    root = np.sqrt(np.where(known, sizes, 1.0))
    along = np.where(known, axes.T @ (scale * cost.gradient) / root, 0.0)
    slopes = np.where(known, root, 0.0)[:, None] * axes.T
    stiffer = max(np.sqrt(along @ along / max(2.0 * cost.value, 1e-300)), 1.0)
    along, slopes = along / stiffer, slopes * stiffer
    rest = np.sqrt(max(2.0 * cost.value - along @ along, 0.0))
    return np.append(along, rest), np.vstack([slopes, np.zeros(len(scale))])


__all__ = ["Cost", "Minimum", "Objective", "minimise"]
