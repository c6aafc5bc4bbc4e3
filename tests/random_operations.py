"""Operations that random programs are made of, exact (or correctly rounded) whatever their order.

Sums and products run over few digits. Elementary functions differ in the last digits; their
results, of the kind "e", are only moved and returned.
"""

from collections.abc import Callable, Sequence
from typing import Any, NamedTuple

import numpy as np
from jax import lax

from lanewise._jax import jnp

CONSTANTS = (0.5, -1.5, 2.0, 3.0, -1.0, 1.0, 0.25, -8.0)
INTEGERS = (1, 2, 3, 5, -1, -7, 63, 64, 1 << 40, -(1 << 63))
SPECIAL = (0.0, -0.0, np.inf, -np.inf, np.nan, 1.7e308, -1.7e308, 3e-308, 4503599627370497.5, 1e19)
DENORMAL = (5e-324, -5e-324, 2.2e-308, -1.1e-308)


class Value(NamedTuple):
    """An array and the kind of its numbers: f, i, b, or e for floats that are not exact."""

    array: Any
    kind: str


class Step(NamedTuple):
    """A function of earlier values, and the kinds of what it returns."""

    function: Callable[..., Sequence[Any]]
    operands: tuple[int, ...]
    kinds: str


def run(steps: Sequence[Step], arrays: Sequence[Any]) -> list[Any]:
    """Return all values: the given ones and those of the steps."""
    values = list(arrays)
    for step in steps:
        values += step.function(*[values[at] for at in step.operands])
    return values


def digits(x: Any) -> Any:
    """Return multiples of 1/8 up to 8 in size, so that sums of them are exact; inf and NaN stay."""
    few = lax.mul(lax.floor(lax.mul(lax.clamp(-8.0, x, 8.0), 8.0)), 0.125)
    return lax.select(lax.is_finite(x), few, x)


def signs(x: Any) -> Any:
    """Return -2, 1/2 or 1, so that products of them are exact."""
    return lax.select(lax.lt(x, filled_like(x, 0.0)), filled_like(x, -2.0), low_signs(x))


def low_signs(x: Any) -> Any:
    return lax.select(lax.gt(x, filled_like(x, 1.0)), filled_like(x, 1.0), filled_like(x, 0.5))


def filled_like(x: Any, value: Any) -> Any:
    return lax.full_like(x, value)


def _later(name: str) -> list[tuple[Callable[[Any], Any], str]]:
    """Return a function of few digits that not every JAX has, if this one has it."""
    function = getattr(lax, name, None)
    return [(lambda x: function(digits(x)), "f")] if function else []


def _within(low: float, high: float) -> Callable[[Any], Any]:
    return lambda x: lax.clamp(low, x, high)


def float_bits(x: Any) -> Any:
    """Return the bits of floats; those of NaN differ."""
    return lax.bitcast_convert_type(lax.select(lax.ne(x, x), filled_like(x, 1.0), x), np.int64)


def mirrored_by_bits(x: Any) -> Any:
    """Return -x, by way of its bits."""
    return lax.bitcast_convert_type(lax.bitwise_xor(float_bits(x), np.int64(-(2**63))), np.float64)


ELEMENTARY = [
    (lax.exp, (_within(-600.0, 600.0),)),
    (lax.exp2, (_within(-900.0, 900.0),)),
    (lax.expm1, (_within(-600.0, 600.0),)),
    (lambda x: lax.log(lax.abs(x)), (_within(1e-300, 1e300),)),
    (lax.log1p, (_within(-0.875, 1e300),)),
    (lax.logistic, (_within(-600.0, 600.0),)),
    (lax.cbrt, (_within(-1e280, 1e280),)),
    (lax.rsqrt, (_within(1e-300, 1e300),)),
    (lax.sin, (_within(-1e5, 1e5),)),
    (lax.cos, (_within(-1e5, 1e5),)),
    (lax.tan, (_within(-8.0, 8.0),)),
    (lax.asin, (_within(-1.0, 1.0),)),
    (lax.acos, (_within(-1.0, 1.0),)),
    (lax.atan, (_within(-1e300, 1e300),)),
    (lax.atan2, (_within(-1e100, 1e100), _within(-1e100, 1e100))),
    (lax.sinh, (_within(-600.0, 600.0),)),
    (lax.cosh, (_within(-600.0, 600.0),)),
    (lax.tanh, (_within(-1e300, 1e300),)),
    (lax.asinh, (_within(-1e100, 1e100),)),
    (lax.acosh, (_within(1.0, 1e100),)),
    (lax.atanh, (_within(-0.875, 0.875),)),
    (lax.pow, (_within(0.125, 8.0), _within(-8.0, 8.0))),
]

UNARY: dict[str, list[tuple[Callable[[Any], Any], str]]] = {
    "f": [
        (lax.neg, "f"),
        (lax.abs, "f"),
        (lambda x: lax.sqrt(lax.abs(x)), "f"),
        (lax.floor, "f"),
        (lax.ceil, "f"),
        (lambda x: lax.round(x, lax.RoundingMethod.TO_NEAREST_EVEN), "f"),
        (lambda x: lax.round(x, lax.RoundingMethod.AWAY_FROM_ZERO), "f"),
        (lax.sign, "f"),
        (lax.square, "f"),
        *_later("one_minus_square"),
        (lambda x: lax.integer_pow(digits(x), 3), "f"),
        (lambda x: lax.integer_pow(signs(x), -2), "f"),
        (lambda x: lax.clamp(-1.5, x, 2.0), "f"),
        (lax.is_finite, "b"),
        (lambda x: lax.convert_element_type(x, np.int64), "i"),
        (lambda x: lax.convert_element_type(x, bool), "b"),
    ],
    "i": [
        (lax.neg, "i"),
        (lax.abs, "i"),
        (lax.sign, "i"),
        (lax.bitwise_not, "i"),
        (lambda x: lax.integer_pow(x, 2), "i"),
        (lambda x: lax.convert_element_type(x, np.float64), "f"),
        (lambda x: lax.convert_element_type(x, bool), "b"),
    ],
    "b": [
        (lax.bitwise_not, "b"),
        (lambda x: lax.convert_element_type(x, np.float64), "f"),
        (lambda x: lax.convert_element_type(x, np.int64), "i"),
    ],
    "e": [(lax.neg, "e"), (lax.abs, "e")],
}
COMPARISONS = [(one, "b") for one in (lax.eq, lax.ne, lax.lt, lax.le, lax.gt, lax.ge)]
LOGIC = (lax.bitwise_and, lax.bitwise_or, lax.bitwise_xor)
SHIFTS = (lax.shift_left, lax.shift_right_logical, lax.shift_right_arithmetic)
BINARY: dict[str, list[tuple[Callable[[Any, Any], Any], str]]] = {
    "f": [(one, "f") for one in (lax.add, lax.sub, lax.mul, lax.div, lax.max, lax.min)]
    + COMPARISONS,
    "i": [(one, "i") for one in (lax.add, lax.sub, lax.mul, lax.div, lax.max, lax.min)]
    + [(one, "i") for one in (*LOGIC, *SHIFTS)]
    + COMPARISONS,
    "b": [(one, "b") for one in LOGIC] + COMPARISONS[:2],
    "e": [],
}
# What changes where zeros are known when a program is compiled: signs of zeros, what is not finite.
NOT_PADDED = (lax.div, lax.atan2)


def without_denormals(x: Any) -> Any:
    """Return floats with those that have fewer digits replaced."""
    return lax.select(lax.lt(lax.abs(x), filled_like(x, 1e-300)), filled_like(x, 0.5), x)


def index_within(index: Any) -> Any:
    return lax.clamp(np.int64(-100), index, np.int64(100))


def with_slice_of(x: Any, y: Any, start: int, axis: int) -> Any:
    """Return an array with one slice replaced by another's."""
    own = (slice(None),) * axis + (start,)
    return jnp.asarray(x).at[own].set(jnp.asarray(y)[own], mode="promise_in_bounds")
