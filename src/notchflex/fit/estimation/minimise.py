"""Minimising a function within limits from its gradient and (approximate) curvature.

`scipy.optimize.least_squares` searches, with its trust region and its steps along limits. It takes
residuals: a function that is not a sum of squares is passed as residuals that have its value,
gradient and curvature. A trial value at which the model has no solution counts as infinite.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, NamedTuple, cast

import numpy as np
from jaxtyping import Float
from scipy.optimize import least_squares

_EVALUATIONS = 200
# Part of the objective that a full step may still promise to gain at the end: at a kink, such as
# where a notch closes, no step gains what the curvature promises.
_KINK = 1e-3

Vector = Float[np.ndarray, " k"]


class Cost(NamedTuple):
    """An objective at some values.

    Attributes:
        value: Its value, 0 or more.
        gradient: Its derivatives.
        curvature: Approximate second derivatives, positive semidefinite.
        residuals: The residuals it is made of.
        contributions: What each residual adds to the gradient.
    """

    value: float
    gradient: Vector
    curvature: Float[np.ndarray, "k k"]
    residuals: Any = None
    contributions: Float[np.ndarray, "r k"] = np.zeros((0, 0))


class Minimum(NamedTuple):
    """Result of one search.

    Attributes:
        values: The values.
        cost: The objective there, with derivatives; None if the search could not start.
        converged: Whether it is a minimum.
        reason: Why not, "" if it is.
        iterations: Number of steps.
        calls: Number of evaluations of the objective.
    """

    values: Vector
    cost: Cost | None
    converged: bool
    reason: str
    iterations: int
    calls: int


Objective = Callable[[Vector], Cost | None]
"""Values -> cost with its derivatives, or None if the model has no solution."""


def minimise(
    objective: Objective, start: Vector, lower: Vector, upper: Vector, *, tolerance: float = 1e-10
) -> Minimum:
    """Search for a minimum from a start, within limits; equal limits hold a value.

    The search stops if a step lowers the objective by less than `tolerance` of it.

    Example:
        >>> def bowl(at):
        ...     return Cost(float((at - 2.0) @ (at - 2.0)), 2.0 * (at - 2.0), 2.0 * np.eye(1))
        >>> minimise(bowl, np.zeros(1), np.zeros(1), np.ones(1)).values
        array([1.])
    """
    values = np.clip(np.asarray(start, float), lower, upper)
    first = objective(values)
    if first is None:
        return Minimum(values, None, False, "the model has no solution at the start", 0, 1)
    if (lower == upper).all():
        return Minimum(values, first, True, "", 0, 1)
    scaled = _Scaled(objective, values, first, lower, upper)
    result = least_squares(
        scaled.residuals,
        np.zeros(len(scaled.scale)),
        cast("Any", scaled.jacobian),  # SciPy's annotations omit functions here, and None below
        (scaled.least, scaled.most),
        method="dogbox",
        ftol=tolerance,
        xtol=1e-10,
        gtol=cast("Any", None),
        max_nfev=_EVALUATIONS,
    )
    cost = scaled.cost(result.x)
    assert cost is not None
    # How much lower a full step of the values that are not at a limit should be.
    residual, slopes = scaled.squares(cost)
    free = slopes[:, result.active_mask == 0]
    promised = 0.5 * np.sum((free @ np.linalg.lstsq(free, residual)[0]) ** 2)
    settled = promised <= _KINK * (1.0 + cost.value)
    reason = "" if settled else "no step lowers the objective (a kink, or rounding)"
    if result.status == 0:
        reason = f"not settled after {_EVALUATIONS} evaluations"
    values, calls = scaled.values(result.x), len(scaled.tried)
    return Minimum(values, cost, not reason, reason, int(result.njev) - 1, calls)


class _Scaled:
    """The objective of scaled steps of the values that are not held, as a sum of squares."""

    def __init__(
        self, objective: Objective, start: Vector, first: Cost, lower: Vector, upper: Vector
    ) -> None:
        self.objective, self.start, self.lower, self.upper = objective, start, lower, upper
        self.free = np.flatnonzero(lower < upper)
        size = np.where(start == 0.0, 1.0, np.abs(start))
        curvature = np.diag(first.curvature)
        is_known = curvature > 0.0
        scale = np.where(is_known, 1.0 / np.sqrt(np.where(is_known, curvature, 1.0)), size)
        self.scale = scale[self.free]
        self.least, self.most = (
            (limit - start)[self.free] / self.scale for limit in (lower, upper)
        )
        self.tried: dict[bytes, Cost | None] = {np.zeros(len(self.free)).tobytes(): first}

    def values(self, step: Vector) -> Vector:
        """Return the values after a step, exactly at a limit where the step is."""
        values, lower, upper = (one.copy() for one in (self.start, self.lower, self.upper))
        moved = values[self.free] + self.scale * step
        moved = np.where(step >= self.most, upper[self.free], moved)
        values[self.free] = np.where(step <= self.least, lower[self.free], moved)
        return np.clip(values, lower, upper)

    def cost(self, step: Vector) -> Cost | None:
        key = step.tobytes()
        if key not in self.tried:
            self.tried[key] = self.objective(self.values(step))
        return self.tried[key]

    def residuals(self, step: Vector) -> Float[np.ndarray, " k+1"]:
        cost = self.cost(step)
        return np.full(len(step) + 1, np.inf) if cost is None else self.squares(cost)[0]

    def jacobian(self, step: Vector) -> Float[np.ndarray, "k+1 k"]:
        cost = self.cost(step)
        assert cost is not None  # asked only where the residuals are finite
        return self.squares(cost)[1]

    def squares(self, cost: Cost) -> tuple[Float[np.ndarray, " k+1"], Float[np.ndarray, "k+1 k"]]:
        """Return residuals f with derivatives J: |f|^2 / 2 is the objective, J^T f its gradient.

        J^T J is its curvature, or more: the objective is never below 0, so no step may promise to
        lower it by more than its value.
        """
        gradient = self.scale * cost.gradient[self.free]
        curvature = cost.curvature[np.ix_(self.free, self.free)]
        sizes, axes = np.linalg.eigh(curvature * np.outer(self.scale, self.scale))
        is_known = sizes > 1e-12 * sizes[-1]
        root = np.sqrt(np.where(is_known, sizes, 1.0))
        along = np.where(is_known, axes.T @ gradient / root, 0.0)
        slopes = np.where(is_known, root, 0.0)[:, None] * axes.T
        stiffer = max(np.sqrt(along @ along / max(2.0 * cost.value, 1e-300)), 1.0)
        along, slopes = along / stiffer, slopes * stiffer
        rest = np.sqrt(max(2.0 * cost.value - along @ along, 0.0))
        return np.append(along, rest), np.vstack([slopes, np.zeros(len(self.scale))])
