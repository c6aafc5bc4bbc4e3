"""Sums of angles, sines and cosines that stay accurate where their terms cancel.

A cut that leaves little of the tube leaves a small angle α, and its area and moments are then
of order α³ to α⁷ while the terms of the closed forms are of order α: α − sin α cos α is
2α³/3. Each such sum is written once, as a list of terms, and evaluated from its Taylor series
below one radian and as it stands above.
"""

from collections.abc import Callable, Sequence
from fractions import Fraction
from math import factorial
from typing import Any

import numpy as np

from notchflex._arrays import xp
from notchflex._jax import jax

_SERIES_BELOW = 1.0  # rad; above it the closed forms lose at most two digits
_TERMS = 16  # of the series: the first one left out is below 1e-16 of the sum at one radian

Term = tuple[Fraction | int, int, str, int]
"""(c, n, "sin" or "cos", m) stands for c αⁿ sin(mα) or c αⁿ cos(mα)."""


def cancelling_sum(terms: Sequence[Term]) -> Callable[[jax.Array], jax.Array]:
    """Make a function of an angle that adds up `terms` without loss at small angles.

    Args:
        terms: Terms (c, n, "sin" or "cos", m) of the sum, c αⁿ sin(mα) or c αⁿ cos(mα), with
            exact (rational) c. All of them must be odd in α, or all of them even.

    Returns:
        The sum as a function of the angle in rad (any shape), relative error about 1e-14 for
        angles from 0 to π.

    Example:
        >>> import numpy as np
        >>> excess = cancelling_sum([(1, 1, "cos", 0), (-1, 0, "sin", 1)])  # α − sin α
        >>> print(f"{float(excess(xp.asarray(1e-5))) * 6e15:.10f}")  # α³/6
        1.0000000000
    """
    series: dict[int, Fraction] = {}
    for factor, power, kind, multiple in terms:
        start = 1 if kind == "sin" else 0
        for k in range(_TERMS + 4):
            order = 2 * k + start
            value = Fraction(factor) * (-1) ** k * Fraction(multiple**order, factorial(order))
            series[power + order] = series.get(power + order, Fraction(0)) + value
    first = min(order for order, value in series.items() if value)
    coefficients = [float(series[first + 2 * k]) for k in range(_TERMS)]

    def evaluate(angle: jax.Array) -> jax.Array:
        if isinstance(angle, np.ndarray) and angle.ndim == 0:  # of one notch: no arrays needed
            plain: Any = float(angle)
            return xp.asarray(near(plain) if plain < _SERIES_BELOW else far(plain))  # pyright: ignore[reportReturnType]
        return xp.where(angle < _SERIES_BELOW, near(angle), far(angle))

    def near(angle: Any) -> Any:
        square, total = angle * angle, coefficients[-1]
        for coefficient in reversed(coefficients[:-1]):
            total = total * square + coefficient
        return total * angle**first

    def far(angle: Any) -> Any:
        total = 0.0
        for factor, power, kind, multiple in terms:
            wave = xp.sin(multiple * angle) if kind == "sin" else xp.cos(multiple * angle)
            total = total + float(factor) * angle**power * wave
        return total

    return evaluate


def half_angle(radius: jax.Array, above: jax.Array, below: jax.Array) -> jax.Array:
    """Compute half of the angle of a circle beyond a chord, arccos(d / r), clipped.

    Args:
        radius: Radius r of the circle, mm.
        above: r − d, from the chord to the top of the circle, mm; given by itself because
            the difference would lose digits for small angles.
        below: r + d, from the bottom of the circle to the chord, mm.

    Returns:
        The angle in rad: 0 where the chord passes above the circle (`above` ≤ 0), π where it
        passes below, 2 atan(√(above / below)) between. Its derivative is finite everywhere.
    """
    cut = (above > 0.0) & (below > 0.0)
    above_safe = xp.where(cut, above, radius)
    below_safe = xp.where(cut, below, radius)
    angle = 2.0 * xp.arctan2(xp.sqrt(above_safe), xp.sqrt(below_safe))
    return xp.where(cut, angle, xp.where(above > 0.0, xp.pi, 0.0))
