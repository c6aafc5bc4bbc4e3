"""Sine, cosine, tangent and their inverses, by sums, products, quotients and choices alone.

Coefficients whose source is not named were fitted for this file: Remez' exchange for the smallest
relative error of the function, each coefficient rounded before those after it were fitted.
"""

import numpy as np

from lanewise._jax import jnp
from lanewise.elementary.bits import (
    SIGN,
    Array,
    flipped,
    nearest,
    polynomial,
    select,
    sign_of,
    sum_of_angles,
    to_bits,
)

_TWO_OVER_PI = 2 / np.pi

# pi/2 in parts of 33, 33 and 53 bits, as in fdlibm (Sun Microsystems 1993, e_rem_pio2.c): products
# with integers up to 2^20 are exact for the first two.
_HALF_PI = (1.57079632673412561417, 6.07710050630396597660e-11, 2.02226624879595063154e-21)

# Beyond, neighbouring floats are 1/8 of a radian apart, and `nearest` comes to its end.
_LARGEST_TURN = 1e15

# (sin(r)/r - 1)/z and (cos(r) - 1 + z/2)/z², z = r², |r| < pi/4: errors 2^-57.8 and 2^-63
_SIN = (
    -0.1666666666666663,
    0.00833333333332184,
    -0.0001984126982935819,
    2.755731353819257e-06,
    -2.505073429452164e-08,
    1.5895424505009408e-10,
)
_COS = (
    0.0416666666666666,
    -0.0013888888888874457,
    2.4801587289652272e-05,
    -2.755731439353845e-07,
    2.087572785345149e-09,
    -1.1359827020337065e-11,
)

# (atan(t)/t - 1)/z, z = t², t < 1: error 2^-56.2
_ATAN = (
    -0.3333333333333307,
    0.19999999999951748,
    -0.14285714282582934,
    0.11111111007004675,
    -0.09090906999097899,
    0.07692279767490717,
    -0.06666403380783896,
    0.05880523937182753,
    -0.052535045128604387,
    0.047222922137302545,
    -0.04219159129339739,
    0.03664286664273743,
    -0.029907661348860744,
    0.021992379004924612,
    -0.013910292311221728,
    0.007205192111889631,
    -0.002890263747714776,
    0.0008334955495083031,
    -0.00015268843057713224,
    1.328305314102458e-05,
)

# (asin(s)/s - 1)/z, z = s², s < 1/2: error 2^-55.9
_ASIN = (
    0.16666666666665408,
    0.07500000000337141,
    0.04464285682821833,
    0.030381959141695364,
    0.022371757932902612,
    0.01735970659326441,
    0.013885216861834852,
    0.0121693371080018,
    0.006527418535120957,
    0.019529827458919798,
    -0.016226765561698914,
    0.031914034714411614,
)


def sin(x: Array) -> Array:
    """Return the sine."""
    minus, sine, cosine = _turned(x)
    value = select((minus & 1) != 0, cosine, sine)
    return flipped(value, (to_bits(x) ^ ((minus + 1) << 62)) & SIGN)


def cos(x: Array) -> Array:
    """Return the cosine."""
    minus, sine, cosine = _turned(x)
    value = select((minus & 1) != 0, sine, cosine)
    # bit 1 of -n is the sign
    return flipped(value, (minus << 62) & SIGN)


def tan(x: Array) -> Array:
    """Return the tangent."""
    minus, sine, cosine = _turned(x)
    odd = (minus & 1) != 0
    value = select(odd, cosine, sine) / select(odd, sine, cosine)
    return flipped(value, sign_of(x) ^ (minus << 63))


def _turned(x: Array) -> tuple[Array, Array, Array]:
    """Return the lowest bits of -n, n pi/2 being nearest to |x|, and sine and cosine of the rest.

    Numbers too large for an angle are taken as 0.
    """
    size = abs(x)
    size = select(size < _LARGEST_TURN, size, size - size)  # NaN for infinity
    count, minus = nearest(size * _TWO_OVER_PI)
    first = size - count * _HALF_PI[0]
    angle = first - count * _HALF_PI[1]
    # what `angle` has lost by rounding, and the last part of pi/2
    rest = ((first - angle) - count * _HALF_PI[1]) - count * _HALF_PI[2]
    z = angle * angle
    cubic = (angle * z) * polynomial(z, _SIN)
    cosine = 1.0 - (0.5 * z - ((z * z) * polynomial(z, _COS) - (angle + cubic) * rest))
    return minus, angle + (cubic + rest * cosine), cosine


def atan(x: Array) -> Array:
    """Return the arc tangent."""
    size = abs(x)
    large = size > 1.0
    slope = select(large, -1.0 / size, size)
    base = select(large, np.pi / 2, 0.0)
    return flipped(sum_of_angles(base, slope, _atan_less(slope)), sign_of(x))


def atan2(y: Array, x: Array) -> Array:
    """Return the angle of the point (x, y), with the quadrants and signed zeros of C."""
    height, width = abs(y), abs(x)
    steep, left = height > width, to_bits(x) < 0
    short, long = select(steep, width, height), select(steep, height, width)
    # 0/0 is 0 here, and infinity by infinity 1
    slope = select(short == long, select(long == 0.0, 0.0, 1.0), short / long)
    slope = select(steep ^ left, -slope, slope)
    base = select(steep, np.pi / 2, select(left, np.pi, 0.0))
    return flipped(sum_of_angles(base, slope, _atan_less(slope)), sign_of(y))


def _atan_less(slope: Array) -> Array:
    """Return atan(t) - t for |t| <= 1."""
    z = slope * slope
    return (slope * z) * polynomial(z, _ATAN)


def asin(x: Array) -> Array:
    """Return the arc sine."""
    size = abs(x)
    # asin(x) = pi/2 - 2 asin(sqrt((1 - x)/2))
    large = size > 0.5
    z = select(large, 0.5 - 0.5 * size, size * size)
    part = select(large, -2.0 * jnp.sqrt(z), size)
    base = select(large, np.pi / 2, 0.0)
    return flipped(sum_of_angles(base, part, _asin_less(part, z)), sign_of(x))


def acos(x: Array) -> Array:
    """Return the arc cosine."""
    size = abs(x)
    # acos(x) = 2 asin(sqrt((1 - x)/2)) = pi/2 - asin(x)
    large = size > 0.5
    z = select(large, 0.5 - 0.5 * size, size * size)
    part = select(large, flipped(2.0 * jnp.sqrt(z), sign_of(x)), -x)
    base = select(large, select(x < 0.0, np.pi, 0.0), np.pi / 2)
    return sum_of_angles(base, part, _asin_less(part, z))


def _asin_less(part: Array, z: Array) -> Array:
    """Return asin(s) - s times a factor; z is s², `part` is s times that factor."""
    return (part * z) * polynomial(z, _ASIN)
