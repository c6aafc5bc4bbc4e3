"""Derivatives of arrays by numbers of a robot, by central differences.

JAX cannot trace the validation of a robot and its conversion to arrays. The arrays are smooth
functions of the numbers; everything after them is differentiated exactly.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import lru_cache

import numpy as np
from jaxtyping import Float
from numpy.typing import ArrayLike

from notchflex.errors import InputError

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
    per_width = differences(lambda moved: vector_of(float(moved)), value, order)
    return per_width / width_at(value, order)


def differences(
    vector_of: Callable[[Float[np.ndarray, "*k"]], Float[np.ndarray, "*m"]],
    values: ArrayLike,
    order: int,
) -> Float[np.ndarray, "*m"]:
    """Differentiate by numbers that vary together, each in multiples of its `width_at`.

    Args:
        vector_of: As for `slope`.
        values: Where, one number or several.
        order: As for `slope`.

    Returns:
        The derivative per width.

    Raises:
        InputError: The numbers cannot be varied.
    """
    width = width_at(values, order)
    for side in (0, 1, -1):
        points, weights = _stencil(order, side)
        try:
            vectors = np.stack([vector_of(values + width * point) for point in points])
        except InputError:  # out of range
            continue
        vectors = np.where(np.isfinite(vectors), vectors, 0.0)
        # Constant entries give exactly 0, without rounding errors.
        return np.tensordot(weights, vectors - vectors[0], 1)
    raise InputError.OUT_OF_RANGE(f"the number cannot be varied around {np.ravel(values)[0]:g}")


def width_at(values: ArrayLike, order: int) -> Float[np.ndarray, "*k"]:
    """Return the widths of differences: relative to the numbers, or to 1 for 0."""
    size = np.abs(values)
    return _WIDTHS[order] * np.where(size == 0.0, 1.0, size)


@lru_cache
def _stencil(order: int, side: int) -> tuple[Float[np.ndarray, " p"], Float[np.ndarray, " p"]]:
    """Return points, in widths, and weights of the slope at 0 of their interpolant."""
    half = order // 2
    central = np.concatenate([np.arange(-half, 0.0), np.arange(1.0, half + 1.0)])
    points = side * np.arange(order + 1.0) if side else central
    powers = np.vander(points, increasing=True).T
    return points, np.linalg.solve(powers, np.eye(len(points))[1])
