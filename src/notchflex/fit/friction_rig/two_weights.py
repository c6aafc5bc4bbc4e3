"""Friction from two weights on one string over two edges (Liu 2022, eq. 20-21).

The heavier weight m1 is just about to pull the string over edges at which it turns by a1 and a2,
so that each takes the ratio of the corner law. With q = (m1 - m2)/(m1 + m2) and b = tan(a / 2),

    q = mu (b1 + b2) / (1 + mu^2 b1 b2),

the sum of two hyperbolic tangents. Its smaller root is eq. 21, written below so that it is exact
for equal weights too, where the printed form is 0 / 0.
"""

from __future__ import annotations

import numpy as np
from jaxtyping import Float
from numpy.typing import ArrayLike

from notchflex._jax import constant
from notchflex.errors import InputError
from notchflex.mechanics.friction import CornerLaw

Readings = Float[np.ndarray, "*n"]


def coefficient_from_weights(
    weight_1: ArrayLike, weight_2: ArrayLike, turn_1: ArrayLike, turn_2: ArrayLike
) -> Readings:
    """Coefficient of friction of readings of the two-weight rig (Liu 2022, eq. 21).

    Args:
        weight_1: Weight that pulls, in any unit, (n,).
        weight_2: Weight that is just about to be lifted, in the same unit; no more than the other.
        turn_1: Angle by which the string turns over the first edge, rad, 0 to less than pi.
        turn_2: The same over the second edge, rad.

    Returns:
        The coefficient, (n,).

    Raises:
        InputError: A reading is impossible; the message tells which, counted from 1.

    Example:
        >>> mu = coefficient_from_weights(200.0, [150.0, 200.0], 0.5 * np.pi, 0.5 * np.pi)
        >>> mu.round(4).tolist()
        [0.0718, 0.0]
    """
    values = [np.asarray(v, float) for v in (weight_1, weight_2, turn_1, turn_2)]
    m1, m2, a1, a2 = np.broadcast_arrays(*values)
    found = impossible(m1, m2, a1, a2)
    if found is not None:
        raise InputError.OUT_OF_RANGE(f"reading {found[0] + 1}: {found[1]}")
    b1, b2 = np.tan(0.5 * a1), np.tan(0.5 * a2)
    part = (m1 - m2) / (m1 + m2)
    total = b1 + b2
    return 2.0 * part / (total + np.sqrt(total**2 - 4.0 * part**2 * b1 * b2))


def weight_held(
    weight_1: ArrayLike, coefficient: ArrayLike, turn_1: ArrayLike, turn_2: ArrayLike
) -> Readings:
    """Smaller weight that the larger one is just about to lift: the inverse of eq. 21.

    Args:
        weight_1: Weight that pulls, in any unit, (n,).
        coefficient: Coefficient of friction, one or one a reading.
        turn_1: Angle by which the string turns over the first edge, rad.
        turn_2: The same over the second edge, rad.

    Returns:
        The weight, in the unit of the other, (n,).

    Raises:
        InputError: Friction at an edge would hold any pull, and the corner law says nothing.

    Example:
        >>> print(f"{weight_held(200.0, 0.15, 1.5, 1.2):.3f} g")
        122.858 g
    """
    values = [np.asarray(v, float) for v in (weight_1, coefficient, turn_1, turn_2)]
    m1, mu, a1, a2 = np.broadcast_arrays(*values)
    law = CornerLaw(constant(mu))
    if not np.asarray(law.valid(constant(a1), constant(a2))).all():
        raise InputError.OUT_OF_RANGE(
            "an edge would hold any pull, because coefficient * tan(turn / 2) is 1 or more; give a "
            "smaller coefficient or turn"
        )
    first, second = law.bounds(constant(a1), constant(a2))
    return m1 * np.exp(-np.asarray(first) - np.asarray(second))


def slopes_of_coefficient(
    coefficient: Readings,
    weight_1: Readings,
    weight_2: Readings,
    turn_1: Readings,
    turn_2: Readings,
) -> Float[np.ndarray, "numbers n"]:
    """How the coefficient changes with each of the four numbers of a reading.

    By the implicit function theorem from ln(m1 / m2) = 2 artanh(mu b1) + 2 artanh(mu b2).

    Returns:
        Per unit of weight 1, of weight 2, and per rad of either turn.
    """
    b1, b2 = np.tan(0.5 * turn_1), np.tan(0.5 * turn_2)
    by_1, by_2 = 2.0 / (1.0 - (coefficient * b1) ** 2), 2.0 / (1.0 - (coefficient * b2) ** 2)
    by_coefficient = b1 * by_1 + b2 * by_2
    by_turns = [coefficient * by * 0.5 * (1.0 + b**2) for by, b in ((by_1, b1), (by_2, b2))]
    return np.stack([1.0 / weight_1, -1.0 / weight_2, *(-by for by in by_turns)]) / by_coefficient


def impossible(
    weight_1: Readings, weight_2: Readings, turn_1: Readings, turn_2: Readings
) -> tuple[int, str] | None:
    """Find the first reading that cannot be: its number from 0, and the rest of the sentence."""
    m1, m2, a1, a2 = (np.ravel(value) for value in (weight_1, weight_2, turn_1, turn_2))
    checks = (
        (~(m1 > 0.0) | ~(m2 > 0.0), "both weights must be above 0."),
        (
            ~((a1 >= 0.0) & (a1 < np.pi) & (a2 >= 0.0) & (a2 < np.pi)),
            "a string turns over an edge by 0 to less than 180 deg.",
        ),
        (
            m2 > m1,
            "weight 2 is larger than weight 1, which it cannot be while weight 1 pulls; swap them "
            "if the other one did.",
        ),
        (
            (a1 + a2 == 0.0) & (m1 != m2),
            "the string does not turn (0 deg over both edges), so that no friction could hold the "
            "difference of the weights.",
        ),
        (a1 + a2 == 0.0, "the string does not turn (0 deg over both edges), which tells nothing."),
    )
    wrong = [(int(np.argmax(bad)), words) for bad, words in checks if bad.any()]
    return min(wrong, key=lambda one: one[0]) if wrong else None


__all__ = [
    "coefficient_from_weights",
    "impossible",
    "slopes_of_coefficient",
    "weight_held",
]
