"""Exponential and hyperbolic functions out of basic operations.

Coefficients were fitted as those of `elementary_angles`.
"""

import numpy as np

from lanewise.elementary.bits import (
    INFINITY,
    LN2,
    ONE,
    Array,
    at_most,
    flipped,
    from_bits,
    nearest,
    polynomial,
    select,
    sign_of,
    to_bits,
)

_QUARTER = ONE - (2 << 52)  # bits of 1/4
_HALF = ONE - (1 << 52)

LOG2_E = 1.4426950408889634

# The largest argument of exp, and the smallest whose result has all its digits
_EXP_RANGE = (-708.3964185322641, 709.782712893384)

# (sinh(r)/r - 1)/z and (1 - cosh(r))/z, z = r², |r| < ln(2)/2: errors 2^-61 and 2^-57.7
_SINH = (
    0.16666666666666677,
    0.008333333333321376,
    0.00019841269886868108,
    2.7557243373674978e-06,
    2.510935699091002e-08,
)
_COSH = (
    -0.5000000000000014,
    -0.04166666666650274,
    -0.0013888888950063206,
    -2.4801487008987312e-05,
    -2.7632262881656393e-07,
)


def exp(x: Array) -> Array:
    """Return the exponential function."""
    count, minus = nearest(x * LOG2_E)
    return exp_of_parts(x, less_powers(x, count), minus)


def exp2(x: Array) -> Array:
    """Return the power of two."""
    count, minus = nearest(x)
    result = _scaled(1.0 + _expm1_near_zero((x - count) * np.log(2)), minus)
    return select(x >= 1024.0, INFINITY, select(x < -1022.0, 0.0, result))


def expm1(x: Array) -> Array:
    """Return the exponential function less one, with all digits near zero."""
    x = select(x < -40.0, -40.0, at_most(x, 710.0))
    count, minus = nearest(x * LOG2_E)
    near = _expm1_near_zero(less_powers(x, count))
    # half of the power of two, as 2^1024 is none; this order keeps the sign of a zero
    half = from_bits(_HALF - (minus << 52))
    return 2.0 * (half * near - (0.5 - half))


def logistic(x: Array) -> Array:
    """Return the logistic function 1/(1 + exp(-x))."""
    return 1.0 / (1.0 + exp(-x))


def sinh(x: Array) -> Array:
    """Return the hyperbolic sine."""
    up, down, odd, even = _halves(x)
    return flipped(2.0 * ((up - down) + ((up + down) * odd - (up - down) * even)), sign_of(x))


def cosh(x: Array) -> Array:
    """Return the hyperbolic cosine."""
    up, down, odd, even = _halves(x)
    return 2.0 * ((up + down) + ((up - down) * odd - (up + down) * even))


def tanh(x: Array) -> Array:
    """Return the hyperbolic tangent."""
    twice = at_most(abs(x) * 2.0, 40.0)
    count, minus = nearest(twice * LOG2_E)
    near = _expm1_near_zero(less_powers(twice, count))
    whole = from_bits(ONE - (minus << 52))
    grown = whole * near + (whole - 1.0)  # exp(2|x|) - 1
    return flipped(grown / (grown + 2.0), sign_of(x))


def _halves(x: Array) -> tuple[Array, Array, Array, Array]:
    """Compute the parts of sinh and cosh.

    Returns:
        A quarter of 2^n and of 2^-n, n being the nearest to |x|/ln(2); sinh(r) and 1 - cosh(r) of
        the rest r.
    """
    size = at_most(abs(x), 710.5)
    count, minus = nearest(size * LOG2_E)
    cubic, even, rest = _odd_and_even(less_powers(size, count))
    up = from_bits(_QUARTER - (minus << 52))
    down = select(size < 100.0, from_bits(_QUARTER + (minus << 52)), 0.0)
    return up, down, rest + cubic, even


def less_powers(x: Array, count: Array) -> Array:
    """Return x less the logarithm of 2^n."""
    return (x - count * LN2[0]) - count * LN2[1]


def _odd_and_even(rest: Array) -> tuple[Array, Array, Array]:
    """Return sinh(r) - r, 1 - cosh(r) and r."""
    z = rest * rest
    return (rest * z) * polynomial(z, _SINH), z * polynomial(z, _COSH), rest


def _expm1_near_zero(rest: Array) -> Array:
    cubic, even, rest = _odd_and_even(rest)
    return rest - (even - cubic)  # so that -0 remains -0


def exp_of_parts(x: Array, rest: Array, minus: Array) -> Array:
    """Return exp(x); `rest` is x less n ln(2), `minus` the lowest bits of -n."""
    result = _scaled(1.0 + _expm1_near_zero(rest), minus)
    return select(x > _EXP_RANGE[1], INFINITY, select(x < _EXP_RANGE[0], 0.0, result))


def _scaled(value: Array, minus: Array) -> Array:
    """Return a float times 2^n by adding to its exponent; `minus` is the lowest bits of -n."""
    return from_bits(to_bits(value) - (minus << 52))
