"""The points of a search for a target: values, slopes, error, and room to the limits."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float

from notchflex.control.program.response import Response
from notchflex.control.search.problem import Problem

# Limits count as kept within this part of them; those smaller than the second number (N, mm, or a
# strain) within parts of it.
KEPT, _MIN_LIMIT = 1e-7, 1e-3
# What a violation of limits, as parts of them, counts beside the error.
_PENALTY = 1e4


@dataclass(frozen=True, eq=False)
class SearchPoint:
    """A point of a search; f driven tendons.

    Attributes:
        moved: What the drives have moved beyond the dead bands, (t,).
        drive: The drives, (t,).
        response: The state there.
        slopes: Slopes of all asked quantities by the driven tendons, (all, f).
        stuck: Which driven tendons stick.
        miss: Weighted differences from the target.
        error: Its size.
        limits: Slopes of limited quantities, as parts of the limits, (c, f).
        room: How far each is from its limit.
    """

    moved: Float[np.ndarray, " t"]
    drive: Float[np.ndarray, " t"]
    response: Response
    slopes: Float[np.ndarray, "all f"]
    stuck: Bool[np.ndarray, " f"]
    miss: Float[np.ndarray, " m"]
    error: float
    limits: Float[np.ndarray, "c f"]
    room: Float[np.ndarray, " c"]

    @property
    def excess(self) -> float:
        """Largest violation of a limit, as a part of it."""
        return largest_violation(self.room)

    @property
    def merit(self) -> float:
        """Merit function: the squared error, plus a penalty for violated limits."""
        if not self.response.converged:
            return np.inf
        return self.error**2 + penalty(self.room)


def limit_rows(
    problem: Problem, values: Float[np.ndarray, " all"], slopes: Float[np.ndarray, "all f"]
) -> tuple[Float[np.ndarray, "c f"], Float[np.ndarray, " c"]]:
    """Return slopes of limited quantities and their distances from the limits, as parts of them.

    Args:
        problem: The limits.
        values: Quantities of a state.
        slopes: Their slopes.
    """
    if not problem.bounds:
        return slopes[:0], slopes[:0, 0]
    rows, room = [], []
    for bound in problem.bounds:
        at = problem.model.slices[bound.quantity]
        given = np.isfinite(bound.limit)
        scale = np.maximum(np.abs(bound.limit[given]), _MIN_LIMIT)
        left = bound.side * (bound.limit - values[at])[given] / scale
        is_limited = np.isfinite(left)
        rows.append((bound.side * slopes[at][given] / scale[:, None])[is_limited])
        room.append(left[is_limited])
    return np.concatenate(rows), np.concatenate(room)


def largest_violation(room: Float[np.ndarray, " c"]) -> float:
    """Return by how much the most violated limit is broken, as a part of it; 0 if none is."""
    return max(0.0, -float(room.min())) if room.size else 0.0


def penalty(room: Float[np.ndarray, " c"]) -> float:
    """Return what broken limits count beside the squared error."""
    if not room.size:
        return 0.0
    broken = np.minimum(room, 0.0)
    return _PENALTY * float(broken @ broken)
