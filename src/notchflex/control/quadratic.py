"""The step of a search: a small quadratic programme with linear limits."""

from __future__ import annotations

import numpy as np
from jaxtyping import Float
from scipy.optimize import nnls

# Limits that cannot all be met weigh so much more than the target.
_VIOLATION = 1e6


def least_step(
    hessian: Float[np.ndarray, "t t"],
    gradient: Float[np.ndarray, " t"],
    limits: Float[np.ndarray, "c t"],
    room: Float[np.ndarray, " c"],
) -> Float[np.ndarray, " t"]:
    r"""Minimise $d^T H d / 2 + g^T d$ where $C d \le b$.

    The problem is turned into one of least distance and that into non-negative least squares
    (Lawson and Hanson 1974, *Solving Least Squares Problems*, ch. 23): exact, and a few
    microseconds for few drives.

    Args:
        hessian: H, positive definite.
        gradient: g.
        limits: C.
        room: b.

    Returns:
        The step. Where the limits contradict each other, the one that violates them least.
    """
    free = np.linalg.solve(hessian, -gradient)
    excess = limits @ free - room
    if not (excess > 0.0).any():
        return free
    factor = np.linalg.cholesky(hessian)
    inward = -np.linalg.solve(factor, limits.T)  # columns: limits in the metric of the Hessian
    size = np.linalg.norm(inward, axis=0)
    size[size == 0.0] = 1.0
    least = _least_distance(inward / size, excess / size)
    if least is None:
        broken = limits[excess > 0.0]
        weight = _VIOLATION * np.trace(hessian) / max(float(np.sum(broken**2)), 1e-300)
        stiffer = hessian + weight * broken.T @ broken
        return np.linalg.solve(stiffer, weight * broken.T @ room[excess > 0.0] - gradient)
    return free + np.linalg.solve(factor.T, least)


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
