"""The step of a search: a small quadratic programme with linear limits."""

from __future__ import annotations

import numpy as np
from jaxtyping import Float
from scipy.optimize import nnls

# Weight of limits that cannot all be met, relative to the target.
_VIOLATION = 1e6


def least_step(
    hessian: Float[np.ndarray, "t t"],
    gradient: Float[np.ndarray, " t"],
    low: Float[np.ndarray, " t"],
    high: Float[np.ndarray, " t"],
    limits: Float[np.ndarray, "c t"],
    room: Float[np.ndarray, " c"],
) -> Float[np.ndarray, " t"]:
    r"""Minimise $d^T H d / 2 + g^T d$ where $l \le d \le h$ and $C d \le b$.

    The problem is turned into one of least distance and that into non-negative least squares
    (Lawson and Hanson 1974, *Solving Least Squares Problems*, ch. 23): exact, and some ten
    microseconds for few drives.

    Args:
        hessian: H, positive definite.
        gradient: g.
        low: l.
        high: h.
        limits: C.
        room: b.

    Returns:
        The step. Where the limits contradict each other it is within l and h, and violates the
        others little.
    """
    one = len(gradient) == 1
    free = -gradient / hessian[0, 0] if one else np.linalg.solve(hessian, -gradient)
    inside = (free >= low).all() and (free <= high).all()
    if inside and (not room.size or (limits @ free <= room).all()):
        return free
    if one and not room.size:
        return np.minimum(np.maximum(free, low), high)
    eye = np.eye(len(gradient))
    every = np.concatenate([eye, -eye, limits])
    excess = np.concatenate([free - high, low - free, limits @ free - room])
    factor = np.linalg.cholesky(hessian)
    inward = -np.linalg.solve(factor, every.T)  # columns: limits in the metric of the Hessian
    size = np.sqrt((inward**2).sum(axis=0))
    size[size == 0.0] = 1.0
    least = _least_distance(inward / size, excess / size)
    if least is None:
        broken = every[excess > 0.0]
        weight = _VIOLATION * np.trace(hessian) / max(float(np.sum(broken**2)), 1e-300)
        stiffer = hessian + weight * broken.T @ broken
        pull = weight * broken.T @ (broken @ free - excess[excess > 0.0])
        step = np.linalg.solve(stiffer, pull - gradient)
    else:
        step = free + np.linalg.solve(factor.T, least)
    return np.minimum(np.maximum(step, low), high)


def _least_distance(
    inward: Float[np.ndarray, "t c"], excess: Float[np.ndarray, " c"]
) -> Float[np.ndarray, " t"] | None:
    """Return the shortest z with inward^T z >= excess; None where there is none."""
    scale = float(np.abs(excess).max())
    rows = np.vstack([inward, excess / scale])
    goal = np.zeros(len(rows))
    goal[-1] = 1.0
    try:
        multipliers = nnls(rows, goal)[0]
    except RuntimeError:  # the iteration does not end
        return None
    left = goal - rows @ multipliers
    if left[-1] < 1e-14:
        return None
    return -scale * left[:-1] / left[-1]
