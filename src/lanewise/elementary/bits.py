"""What elementary functions are built of: bits of floats, choices and polynomials.

Nothing here rounds in a way that a fused multiply-add could harm: a compiler may join a product
and a sum wherever it finds them.
"""

from collections.abc import Sequence
from typing import TypeAlias

from lanewise._jax import jax, jnp

Array: TypeAlias = jax.Array

SIGN = -(2**63)  # the sign bit alone
MANTISSA = 2**52 - 1
ONE = 1023 << 52  # bits of 1.0

SMALLEST = 2.0**-1022  # smaller ones have fewer digits; they count as zero
INFINITY = float("inf")
NAN = float("nan")

# Natural logarithm of 2 in parts of 32 and 53 bits, as in fdlibm (Sun Microsystems 1993,
# e_exp.c): products of the first with exponents are exact.
LN2 = (6.93147180369123816490e-01, 1.90821492927058770002e-10)

# A number below 2^51 added to this is rounded to an integer, whose bits are then the lowest ones.
# It is quicker than to round and to convert, which not every processor can do for vectors.
_ROUNDER = 1.5 * 2.0**52

# What one must add to pi/2 rounded is this times pi/2; the same holds for pi.
_BEYOND = 6.123233995736766e-17 / 1.5707963267948966


def to_bits(x: Array) -> Array:
    """Return the bits of floats as integers."""
    return jax.lax.bitcast_convert_type(x, jnp.int64)


def from_bits(bits: Array) -> Array:
    """Return the floats of these bits."""
    return jax.lax.bitcast_convert_type(bits, jnp.float64)


def sign_of(x: Array) -> Array:
    """Return the sign bit, all others being zero."""
    return to_bits(x) & SIGN


def flipped(x: Array, sign: Array) -> Array:
    """Return a float with its sign changed where `sign` has the sign bit set."""
    return from_bits(to_bits(x) ^ sign)


def select(which: Array, yes: Array | float, no: Array | float) -> Array:
    """Choose between two values; `jnp.where` would convert plain numbers first."""
    return jax.lax.select_n(which, _filled(which, no), _filled(which, yes))


def at_most(x: Array, limit: float) -> Array:
    """Return the smaller one, and NaN for NaN; this order is a single instruction on x86."""
    return select(x > limit, limit, x)


def nearest(x: Array) -> tuple[Array, Array]:
    """Round to integers, ties to even.

    Args:
        x: Floats below 2^51 in size; elsewhere what comes out means nothing.

    Returns:
        The integer n as a float, and bits whose lowest twelve are those of -n.
    """
    # XLA, which the tests use, makes x of x + c - c; this it leaves alone (jax 0.10.1).
    shifted = _ROUNDER - x
    return _ROUNDER - shifted, to_bits(shifted)


def as_float(integer: Array) -> Array:
    """Return 2^52 plus an integer below 2^52, as a float."""
    return from_bits(integer | (ONE + (52 << 52)))


def polynomial(x: Array, coefficients: Sequence[float]) -> Array:
    """Return the sum of coefficients times powers of x, from the power zero on.

    Two terms at a time, of long ones four: one or two products more than Horner's, which must
    wait for every single step.
    """
    terms: list[Array | float] = list(coefficients)
    for _ in range(2 if len(terms) > 8 else 1):
        pairs = [low + x * high for low, high in zip(terms[::2], terms[1::2], strict=False)]
        terms = [*pairs, *terms[len(pairs) * 2 :]]
        x = x * x
    value = terms[-1]
    for term in terms[-2::-1]:
        value = term + x * value
    return jnp.asarray(value)


def sum_of_angles(base: Array, angle: Array, small: Array) -> Array:
    """Return the sum of a multiple of pi/2 and two more parts, the last of them small.

    The digits of pi beyond double precision are added, too.
    """
    return (base + angle) + (base * _BEYOND + small)


def _filled(like: Array, value: Array | float) -> Array:
    if isinstance(value, jax.Array):
        return value
    return jnp.full(like.shape, value, jnp.int64 if isinstance(value, int) else jnp.float64)
