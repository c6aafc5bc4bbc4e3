"""Powers and roots out of basic operations."""

from lanewise._jax import jax, jnp
from lanewise.elementary.bits import (
    INFINITY,
    LN2,
    NAN,
    SIGN,
    SMALLEST,
    Array,
    as_float,
    at_most,
    flipped,
    from_bits,
    nearest,
    polynomial,
    select,
    sign_of,
    to_bits,
)
from lanewise.elementary.exp import LOG2_E, exp_of_parts, less_powers
from lanewise.elementary.log import LOG, split

# Keeps the first 26 digits, so that the product of two such numbers is exact
_FIRST_DIGITS = ~(2**27 - 1)

# With this exponent every power of a float is 0, 1 or infinite.
_LARGEST_EXPONENT = 1e22


def pow(x: Array, y: Array) -> Array:
    """Return a power with any exponent; special values are those of C."""
    size = abs(x)
    exponent = at_most(y, _LARGEST_EXPONENT)
    exponent = select(exponent < -_LARGEST_EXPONENT, -_LARGEST_EXPONENT, exponent)

    # The logarithm is multiplied by the exponent, and its error with it: it needs more digits than
    # a float has. It comes in two parts, the first of 26 digits.
    first, second = _long_log(size)
    first_factor = _first_digits(exponent)
    product = first_factor * first
    small = (exponent - first_factor) * first + exponent * second
    total = product + small
    count, minus = nearest(total * LOG2_E)
    result = exp_of_parts(total, less_powers(product, count) + small, minus)

    half = 0.5 * exponent
    whole = jnp.floor(exponent) == exponent
    odd = whole & (jnp.floor(half) != half)
    result = select(~whole & (x < 0.0), NAN, result)
    extreme = select((size < 1.0) ^ (y < 0.0), 0.0, INFINITY)
    result = select((size >= SMALLEST) & (size < INFINITY), result, extreme)
    result = flipped(result, select(odd, to_bits(x), 0) & SIGN)
    result = select((x != x) | (y != y), NAN, result)
    return select((x == 1.0) | (y == 0.0), 1.0, result)


def _long_log(x: Array) -> tuple[Array, Array]:
    """Return the logarithm in two parts: the first 26 digits, and the rest.

    As in fdlibm (Sun Microsystems 1993, e_pow.c), but with the series of `log`.
    """
    part, negative, _ = split(x, 1.0)
    above, whole = part - 1.0, part + 1.0
    inverse = 1.0 / whole
    # s = (m - 1)/(m + 1) in two parts
    s = _first_digits(above * inverse)
    divisor = _first_digits(whole)
    s_rest = ((above - s * divisor) - s * (part - (divisor - 1.0))) * inverse
    s_both = s + s_rest
    z = s_both * s_both
    small = 2.0 * s_rest + (s_both * z) * polynomial(z, LOG)
    # The larger parts are added, and what that loses is kept.
    large, twice = -(negative * LN2[0]), 2.0 * s
    total = large + twice
    small = ((large - total) + twice) + (small - negative * LN2[1])
    first = _first_digits(total + small)
    return first, small - (first - total)


def _first_digits(x: Array) -> Array:
    return from_bits(to_bits(x) & _FIRST_DIGITS)


def cbrt(x: Array) -> Array:
    """Return the cube root."""
    size = abs(x)
    # A third of the bits, negative, is nearly the logarithm of 1/cbrt(x). The constant makes the
    # error equal on both sides: (1 - error)^(-1/3) is fitted for |error| < 0.1022 to 2^-18.
    bits = as_float(jax.lax.shift_right_logical(to_bits(size), 12))
    guess = bits * (-1 / 3) + (2.0**54 / 3 + (1364 - 0.068) * 2.0**40)
    inverse = from_bits(to_bits(guess) << 12)
    error = 1.0 - (size * inverse) * (inverse * inverse)
    inverse = inverse + inverse * error * polynomial(
        error, (0.3333276529251053, 0.22347621049345312, 0.1746982186324532)
    )
    error = 1.0 - (size * inverse) * (inverse * inverse)
    inverse = inverse + inverse * error * (1 / 3 + error * (2 / 9))
    square = inverse * inverse
    root = size * square
    # one step of Newton's; a quarter of the cube, because the cube may overflow
    excess = (root * root) * (0.25 * root) - 0.25 * size
    root = root - excess * (square * (4 / 3))
    fine = (size >= SMALLEST) & (size < INFINITY)
    return flipped(select(fine, root, size), sign_of(x))


def rsqrt(x: Array) -> Array:
    """Return the inverse of the square root."""
    return 1.0 / jnp.sqrt(x)
