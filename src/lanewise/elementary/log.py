"""Logarithms and the inverses of the hyperbolic functions out of basic operations.

Coefficients were fitted as those of `elementary_angles`.
"""

import numpy as np

from lanewise._jax import jax, jnp
from lanewise.elementary.bits import (
    INFINITY,
    LN2,
    MANTISSA,
    NAN,
    ONE,
    SIGN,
    SMALLEST,
    Array,
    as_float,
    at_most,
    flipped,
    from_bits,
    polynomial,
    select,
    sign_of,
    to_bits,
)

# (log((1 + s)/(1 - s)) / s - 2)/z, z = s², 1/sqrt(2) < (1 + s)/(1 - s) < sqrt(2): error 2^-59
LOG = (
    0.6666666666666734,
    0.39999999999416597,
    0.28571428742081717,
    0.2222219859604276,
    0.18183563446092477,
    0.15314067419488286,
    0.14795822849299792,
)

# (atanh(s)/s - 1)/z, z = s², |s| < 0.2007: error 2^-55.8
_ATANH = (
    0.33333333333336507,
    0.19999999997997508,
    0.14285714712700356,
    0.11111068014760905,
    0.09093228851745447,
    0.07624074622440523,
    0.07692042449985323,
)

# Bits of 0.7071, a little below the root of 1/2, as in fdlibm (e_log.c)
_ROOT_HALF = 0x3FE6A09E << 32


def log(x: Array) -> Array:
    """Return the natural logarithm."""
    parts, exponent, _ = split(x, 1.0)
    return _checked(_log_of_parts(parts - 1.0, exponent), x)


def log2(x: Array) -> Array:
    """Return the logarithm to base 2; that of a power of 2 is exact."""
    parts, negative, _ = split(x, 1.0)
    return _checked(_log_of_parts(parts - 1.0, 0.0 * negative) / sum(LN2) - negative, x)


def log1p(x: Array) -> Array:
    """Return the logarithm of 1 + x, with all digits near zero."""
    result, total = _log_above(0.5, -0.5 * x)
    return _checked(result, total)


def asinh(x: Array) -> Array:
    """Return the inverse of the hyperbolic sine."""
    size = abs(x)
    some = at_most(size, 1e100)  # its square must not overflow; the quotient is 1 long before
    less = -0.25 * size
    # asinh(x) = log1p(x + x²/(1 + sqrt(1 + x²)))
    result, _ = _log_above(0.25, less + less * (some / (1.0 + jnp.sqrt(1.0 + some * some))))
    return flipped(select(size < INFINITY, result, size), sign_of(x))


def acosh(x: Array) -> Array:
    """Return the inverse of the hyperbolic cosine."""
    # acosh(1 + a) = log1p(a + sqrt(a² + 2 a)); where the square overflows, the root is a
    less = -0.25 * (x - 1.0)
    result, _ = _log_above(
        0.25, select(less < -1e150, 2.0 * less, less - jnp.sqrt(less * (less - 0.5)))
    )
    return select(x < 1.0, NAN, select(x < INFINITY, result, x))


def atanh(x: Array) -> Array:
    """Return the inverse of the hyperbolic tangent."""
    size = abs(x)
    # The quotient (1 + x)/(1 - x) is 2^k (1 + s)/(1 - s); the bits of a float are nearly its
    # logarithm, so that those of the quotient need not be known for k.
    ratio = to_bits(1.0 + size) - to_bits(1.0 - size) + (1 << 51)
    exponent = jax.lax.shift_right_logical(ratio, 52)
    power = from_bits((ratio & ~MANTISSA) + ONE)
    # s = ((1 + x) - 2^k (1 - x))/((1 + x) + 2^k (1 - x)); near zero 1 + x has lost digits of x, and
    # near one 1 + 2^k those of 1.
    product = power * (1.0 - size)
    above = select(size < 0.5, (1.0 - power) + size * (1.0 + power), (1.0 + size) - product)
    part = above / ((1.0 + size) + product)
    z = part * part
    count = as_float(exponent) - 2.0**52
    small = (part * z) * polynomial(z, _ATANH) + count * (0.5 * LN2[1])
    result = count * (0.5 * LN2[0]) + (part + small)
    return flipped(
        select(size < 1.0, result, select(size == 1.0, INFINITY, NAN)),
        sign_of(x),
    )


def _log_above(unit: float, less: Array) -> tuple[Array, Array]:
    """Return log((unit - less)/unit), unit being 1/2 or 1/4, and unit - less.

    With a unit below one it cannot overflow where twice or four times as much is wanted.
    """
    total = unit - less
    lost = less - (unit - total)
    part, exponent, shrink = split(total, unit)
    # 1 - part rather than part - 1, so that -0 remains -0
    return _log_of_parts(lost * shrink - (1.0 - part), exponent), total


def split(x: Array, unit: float) -> tuple[Array, Array, Array]:
    """Split x/unit in a float between the roots of 1/2 and of 2 and a power of two.

    Returns:
        The float; the negative exponent of the power, as a float; minus one by the power of two
        that is split off x itself.
    """
    raised = to_bits(x) + (ONE - _ROOT_HALF)
    exponent = as_float(jax.lax.shift_right_logical(raised, 52))
    negative = (2.0**52 + 1023.0 + np.log2(unit)) - exponent
    shrink = from_bits((2 * ONE + SIGN) - (raised & ~MANTISSA))
    return from_bits((raised & MANTISSA) + _ROOT_HALF), negative, shrink


def _log_of_parts(above: Array, negative: Array) -> Array:
    """Return log((1 + f) 2^k); the order of its sums is that of fdlibm (e_log.c)."""
    part = above / (2.0 + above)
    z = part * part
    half = 0.5 * above * above
    series = z * polynomial(z, LOG)
    small = half - (part * (half + series) - negative * LN2[1])
    return (above - small) - negative * LN2[0]


def _checked(result: Array, x: Array) -> Array:
    """Return the logarithm of x, also where x is zero, negative or infinite."""
    none = select(x < 0.0, NAN, -INFINITY)
    return select(x < SMALLEST, none, select(x < INFINITY, result, x))
