"""Compute exponentials, logarithms, powers, angles and hyperbolic functions by basic operations.

The compiler traces the functions of `ELEMENTARY` in place of JAX's primitives. They use sums,
products, quotients, square roots, comparisons, selections and the bits of floats; neither branches
nor tables. Products and sums may be fused.

Results are within 1.5 units in the last place (`exp`, `log`, `sin`, `cos`, `atan`) or within 3
(others). Those of `pow` are within 4 between 1e-40 and 1e40, within 40 beyond; those of `cbrt`
within 6 for arguments below 1e-288. Angles are turned back exactly up to 1e6 rad; from there on the
error of the argument grows to a few units of its own last place, and beyond 1e15 rad sin is 0.
Arguments and results too small for all their digits count as zero.
"""

from collections.abc import Callable

from lanewise.elementary.angles import acos, asin, atan, atan2, cos, sin, tan
from lanewise.elementary.bits import Array
from lanewise.elementary.exp import cosh, exp, exp2, expm1, logistic, sinh, tanh
from lanewise.elementary.log import acosh, asinh, atanh, log, log1p, log2
from lanewise.elementary.power import cbrt, pow, rsqrt

_FUNCTIONS = (
    *(exp, exp2, expm1, log, log1p, log2, logistic, pow, cbrt, rsqrt),
    *(sin, cos, tan, asin, acos, atan, atan2),
    *(sinh, cosh, tanh, asinh, acosh, atanh),
)
ELEMENTARY: dict[str, Callable[..., Array]] = {one.__name__: one for one in _FUNCTIONS}
"""The function in place of each of JAX's primitives, by its name."""
