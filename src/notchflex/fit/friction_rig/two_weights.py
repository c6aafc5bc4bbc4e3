"""Friction from two weights on one string over two edges.

The heavier weight m1 is just about to pull the string over edges at which it turns by a1 and a2.
Capstan friction, which robots have by default, gives mu = ln(m1 / m2) / (a1 + a2).

By the corner law (Liu 2022, eq. 20-21) each edge takes its ratio. With q = (m1 - m2)/(m1 + m2) and
b = tan(a / 2),

    q = mu (b1 + b2) / (1 + mu^2 b1 b2),

the sum of two hyperbolic tangents. Its smaller root is eq. 21, written below so that it is exact
for equal weights too, where the printed form is 0 / 0.
"""

from __future__ import annotations

from typing import Literal

import numpy as np
from jaxtyping import Float
from numpy.typing import ArrayLike

from notchflex import InputError
from notchflex._jax import constant
from notchflex.mechanics.friction import CornerLaw

Readings = Float[np.ndarray, "*n"]
Law = Literal["capstan", "corner"]
LAWS: tuple[Law, ...] = ("capstan", "corner")
"""Friction laws of an edge."""


def coefficient_from_weights(
    weight_1: ArrayLike,
    weight_2: ArrayLike,
    turn_1: ArrayLike,
    turn_2: ArrayLike,
    law: Law = "capstan",
) -> Readings:
    """Return the coefficient of friction of readings of the two-weight rig.

    Args:
        weight_1: Weight that pulls, in any unit, (n,).
        weight_2: Weight that is just about to be lifted, in the same unit; no more than the other.
        turn_1: Turn of the string over the first edge or round the first rod, rad, (n,); for the
            corner law less than pi.
        turn_2: Turn over the second edge, rad, (n,).
        law: The friction law of an edge; "corner" is that of Liu 2022 (eq. 21).

    Returns:
        The coefficient, (n,).

    Raises:
        InputError: A reading is impossible; the message names it, counted from 1.

    Example:
        >>> mu = coefficient_from_weights(200.0, [150.0, 200.0], 0.5 * np.pi, 0.5 * np.pi)
        >>> mu.round(4).tolist()
        [0.0916, 0.0]
    """
    m1, m2, a1, a2 = _floats(weight_1, weight_2, turn_1, turn_2)
    wrong = impossible(m1, m2, a1, a2, law)
    if wrong is not None:
        raise InputError.OUT_OF_RANGE(f"reading {wrong[0] + 1}: {wrong[1]}")
    if law == "capstan":
        return np.log(m1 / m2) / (a1 + a2)
    b1, b2 = np.tan(0.5 * a1), np.tan(0.5 * a2)
    part = (m1 - m2) / (m1 + m2)
    total = b1 + b2
    return 2.0 * part / (total + np.sqrt(total**2 - 4.0 * part**2 * b1 * b2))


def weight_held(
    weight_1: ArrayLike,
    coefficient: ArrayLike,
    turn_1: ArrayLike,
    turn_2: ArrayLike,
    law: Law = "capstan",
) -> Readings:
    """Return the weight that the larger one is just about to lift.

    It is the inverse of `coefficient_from_weights`.

    Args:
        weight_1: Weight that pulls, in any unit, (n,).
        coefficient: Coefficient of friction, one or one a reading.
        turn_1: Turn of the string over the first edge, rad, (n,).
        turn_2: Turn over the second edge, rad, (n,).
        law: The friction law of an edge.

    Returns:
        The weight, in the unit of the other, (n,).

    Raises:
        InputError: Friction at an edge would hold any pull, and the corner law says nothing.

    Example:
        >>> print(f"{weight_held(200.0, 0.15, 1.5, 1.2):.3f} g")
        133.395 g
    """
    m1, mu, a1, a2 = _floats(weight_1, coefficient, turn_1, turn_2)
    if law == "capstan":
        return m1 * np.exp(-mu * (a1 + a2))
    corner, turns = CornerLaw(constant(mu)[..., None]), constant(np.stack([a1, a2], axis=-1))
    if not corner.valid(turns).all():
        raise InputError.OUT_OF_RANGE(
            "an edge would hold any pull, because coefficient * tan(turn / 2) is 1 or more; give a "
            "smaller coefficient or turn"
        )
    return m1 * np.exp(-np.sum(corner.bounds(turns), axis=-1))


def slopes_of_coefficient(
    coefficient: Readings,
    weight_1: Readings,
    weight_2: Readings,
    turn_1: Readings,
    turn_2: Readings,
    law: Law = "capstan",
) -> Float[np.ndarray, "4 n"]:
    """Return derivatives of the coefficient by the weights, and by the turns per rad.

    Those of the corner law by the implicit function theorem from
    ln(m1 / m2) = 2 artanh(mu b1) + 2 artanh(mu b2).
    """
    if law == "capstan":
        turn = turn_1 + turn_2
        return np.stack([1.0 / weight_1, -1.0 / weight_2, -coefficient, -coefficient]) / turn
    b1, b2 = np.tan(0.5 * turn_1), np.tan(0.5 * turn_2)
    by_1, by_2 = 2.0 / (1.0 - (coefficient * b1) ** 2), 2.0 / (1.0 - (coefficient * b2) ** 2)
    by_coefficient = b1 * by_1 + b2 * by_2
    by_turns = [coefficient * by * 0.5 * (1.0 + b**2) for by, b in ((by_1, b1), (by_2, b2))]
    return np.stack([1.0 / weight_1, -1.0 / weight_2, *(-by for by in by_turns)]) / by_coefficient


def _floats(*values: ArrayLike) -> tuple[Readings, ...]:
    return np.broadcast_arrays(*(np.asarray(value, float) for value in values))


def impossible(
    weight_1: Readings, weight_2: Readings, turn_1: Readings, turn_2: Readings, law: Law
) -> tuple[int, str] | None:
    """Return number (from 0) and reason of the first impossible reading; None if there is none."""
    m1, m2, a1, a2 = (np.ravel(value) for value in (weight_1, weight_2, turn_1, turn_2))
    most, limit = (np.inf, "or more") if law == "capstan" else (np.pi, "to less than 180 deg")
    checks = (
        (~(m1 > 0.0) | ~(m2 > 0.0), "both weights must be above 0."),
        (
            ~((a1 >= 0.0) & (a1 < most) & (a2 >= 0.0) & (a2 < most)),
            f"a string turns over an edge by 0 {limit} (friction law: {law}).",
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
        (
            a1 + a2 == 0.0,
            "the string does not turn (0 deg over both edges), so friction has no effect.",
        ),
    )
    wrong = [(int(np.argmax(bad)), words) for bad, words in checks if bad.any()]
    return min(wrong, key=lambda reading: reading[0]) if wrong else None
