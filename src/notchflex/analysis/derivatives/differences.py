"""Derivatives of plain functions by differences, accurate to about 1e-10."""

from __future__ import annotations

from collections.abc import Callable
from functools import lru_cache
from typing import TypeVar

import numpy as np
from jaxtyping import Float

from notchflex.errors import InputError

T = TypeVar("T")

# Width of a difference relative to the number, by order of accuracy. A short formula is accurate to
# rounding and allows a small width; integrals and special functions do not.
_WIDTHS = {2: 5e-6, 6: 1.3e-3}


def slope(
    vector_of: Callable[[float], Float[np.ndarray, "*m"]], value: float, *, order: int = 6
) -> Float[np.ndarray, "*m"]:
    """Differentiate by a number.

    Args:
        vector_of: The arrays of a value; entries may be infinite, and count as constant.
        value: Where. At the end of its range, such as a friction of 0, the derivative is inward.
        order: Order of accuracy: 6, or 2 with a third of the evaluations, for plain formulas.

    Returns:
        The derivative, accurate to about 1e-10.

    Raises:
        InputError: The number cannot be varied.
    """
    width, reason = _width(value, order), ""
    for side in (0, 1, -1):
        points, weights = _stencil(order, side)
        try:
            vectors = np.stack([vector_of(float(value + width * point)) for point in points])
        except InputError as error:  # out of range
            reason = str(error)
            continue
        vectors = np.where(np.isfinite(vectors), vectors, 0.0)
        # Constant entries give exactly 0, without rounding errors.
        return np.tensordot(weights, vectors - vectors[0], 1) / width
    raise InputError.OUT_OF_RANGE(f"the number cannot be varied around {value:g}: {reason}")


def nearby(robot_at: Callable[[float], T], value: float, order: int = 6) -> T:
    """Return what a function gives beside a number, to the side where it gives something.

    Raises:
        InputError: The number cannot be varied.
    """
    width, reason = _width(value, order), ""
    for moved in (value + width, value - width):
        try:
            return robot_at(moved)
        except InputError as error:
            reason = str(error)
    raise InputError.OUT_OF_RANGE(f"the number cannot be varied around {value:g}: {reason}")


def _width(value: float, order: int) -> float:
    """Return the width of differences: relative to the number, or to 1 for 0."""
    return _WIDTHS[order] * (abs(value) or 1.0)


@lru_cache
def _stencil(order: int, side: int) -> tuple[Float[np.ndarray, " p"], Float[np.ndarray, " p"]]:
    """Return points, in widths, and weights of the slope at 0 of their interpolant."""
    half = order // 2
    central = np.concatenate([np.arange(-half, 0.0), np.arange(1.0, half + 1.0)])
    points = side * np.arange(order + 1.0) if side else central
    powers = np.vander(points, increasing=True).T
    return points, np.linalg.solve(powers, np.eye(len(points))[1])
