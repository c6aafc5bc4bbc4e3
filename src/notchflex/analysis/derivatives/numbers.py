"""How the arrays of a chain change with the numbers of the robot file.

A robot is checked and turned into arrays by plain Python, once; JAX cannot look into that. Each
number is varied instead, by central differences of three widths extrapolated to none (Richardson):
the arrays are smooth functions of the numbers, and what is left is rounding, some 1e-12 of them.
Everything after the arrays is differentiated exactly.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from jaxtyping import Float

from notchflex.errors import InputError

# Widest difference, of the number itself, and how often it is halved.
_WIDTH, _HALVINGS = 4e-3, 2


def slope(
    vector_of: Callable[[Float[np.ndarray, " k"]], Float[np.ndarray, " chain"]],
    numbers: Float[np.ndarray, " k"],
    index: int,
    halvings: int = _HALVINGS,
) -> Float[np.ndarray, " chain"]:
    """Derivative by one of the numbers.

    With one halving less it takes a third less time, and is right to some 1e-9. At the end of the
    range that a number may have, such as a friction of 0, it is that inward.
    """
    width = _WIDTH * (abs(numbers[index]) or 1.0)
    for points in (_CENTRAL, _FORWARD, -_FORWARD):
        try:
            return _extrapolated(vector_of, np.array(numbers), index, width, points, halvings)
        except InputError:  # beyond what the number may be
            continue
    raise InputError.OUT_OF_RANGE(f"number {index + 1} cannot be varied around {numbers[index]:g}")


# Where to look, in widths: both sides, or one side only at the end of a range.
_CENTRAL = np.array([-1.0, 1.0])
_FORWARD = np.array([0.0, 1.0, 2.0])


def _extrapolated(
    vector_of: Callable[..., np.ndarray],
    numbers: np.ndarray,
    index: int,
    width: float,
    points: np.ndarray,
    halvings: int,
) -> np.ndarray:
    """Differences of ever smaller widths, extrapolated to none."""
    # Weights that give the slope at 0 of the polynomial through the points.
    powers = np.vander(points, increasing=True).T
    weights = np.linalg.solve(powers, np.eye(len(points))[1])
    table: list[np.ndarray] = []
    for halving in range(halvings + 1):
        own = width / 2**halving
        values = []
        for point in points:
            varied = numbers.copy()
            varied[index] += own * point
            found = vector_of(varied)
            values.append(np.where(np.isfinite(found), found, 0.0))  # infinite stays infinite
        row = [weights @ np.stack(values) / own]
        # The error has the even powers of the width from 2 on, from one side all of them.
        for order, before in enumerate(table):
            power = 2.0 ** (2 * (order + 1) if len(points) == 2 else order + 2)
            row.append((power * row[-1] - before) / (power - 1.0))
        table = row
    return table[-1]


__all__ = ["slope"]
