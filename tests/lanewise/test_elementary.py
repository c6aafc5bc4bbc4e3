"""Transcendental functions out of basic operations against the C library's long doubles."""

from collections.abc import Callable
from math import inf, nan, pi
from typing import Any

import numpy as np
import pytest

from lanewise.elementary import ELEMENTARY
from notchflex._jax import jax, jnp

Wide = np.longdouble
COUNT = 20_000
SMALLEST = 2.0**-1022
LARGEST = np.finfo(float).max

# What a compiler of basic operations knows
ALLOWED = """
    add sub mul div neg abs sqrt max min sign select_n eq ne lt le gt ge and or not xor round floor
    is_finite integer_pow square convert_element_type bitcast_convert_type shift_left
    shift_right_logical shift_right_arithmetic broadcast_in_dim
"""

# A long double of as many digits as a double would show nothing.
wide = pytest.mark.skipif(
    np.finfo(Wide).nmant < 63, reason="the C library has no long double of 64 digits"
)

random = np.random.default_rng(11)


def _evenly(low: float, high: float) -> np.ndarray:
    return random.uniform(low, high, COUNT)


def _over_scales(low: float, high: float) -> np.ndarray:
    return np.exp(random.uniform(np.log(low), np.log(high), COUNT))


def _both_signs(values: np.ndarray) -> np.ndarray:
    return values * random.choice([-1.0, 1.0], values.shape)


def _all(*values: np.ndarray) -> np.ndarray:
    return np.concatenate(values)


TINY = _both_signs(_over_scales(1e-300, 1.0))
REAL = _all(TINY, _both_signs(_over_scales(1e-3, 1e300)), _evenly(-3, 3))
NEAR_ONE = _both_signs(1 - _over_scales(1e-16, 0.5))
UNIT = _all(TINY, _evenly(-1, 1), NEAR_ONE)
# Floats next to multiples of pi/2, where few digits of what remains are those of the argument
QUARTERS = np.arange(-2000, 2001) * (pi / 2)
ANGLES = _all(TINY, _evenly(-8, 8), _evenly(-1e3, 1e3), QUARTERS, _both_signs(_over_scales(1, 1e6)))
NEXT_TO_ONE = 1 + _both_signs(_over_scales(1e-15, 1e-3))
POSITIVE = _all(_over_scales(2.3e-308, LARGEST), _evenly(0.5, 2), NEXT_TO_ONE)
BASES = _all(_over_scales(1e-300, 1e300), _over_scales(0.5, 2), NEXT_TO_ONE)
# Exponents with results between 1e-40 and 1e40
EXPONENTS = np.clip(
    random.uniform(-90, 90, BASES.size) / np.where(BASES == 1, 1, np.log(BASES)), -1e18, 1e18
)

# Arguments, the function in long doubles, how many units in the last place it may differ
CASES: dict[str, tuple[tuple[np.ndarray, ...], Callable[..., Any], float]] = {
    "exp": ((_all(TINY, _evenly(-708.3, 709.78), _evenly(-2, 2)),), np.exp, 1.1),
    "exp2": ((_all(TINY, _evenly(-1021.9, 1023.9), _evenly(-2, 2)),), np.exp2, 1.2),
    "expm1": ((_all(TINY, _evenly(-60, 709.78), _evenly(-2, 2)),), np.expm1, 2.5),
    "log": ((POSITIVE,), np.log, 1.0),
    "log1p": ((_all(TINY, abs(REAL), _evenly(-1, 2), -abs(NEAR_ONE)),), np.log1p, 1.5),
    "log2": ((POSITIVE,), np.log2, 1.9),
    "logistic": ((_all(TINY, _evenly(-700, 700)),), lambda x: 1 / (1 + np.exp(-x)), 2.5),
    "cbrt": ((REAL[abs(REAL) > 1e-288],), np.cbrt, 1.2),
    "rsqrt": ((POSITIVE,), lambda x: 1 / np.sqrt(x), 1.5),
    "sin": ((ANGLES,), np.sin, 1.1),
    "cos": ((ANGLES,), np.cos, 1.1),
    "tan": ((ANGLES,), np.tan, 2.7),
    "asin": ((UNIT,), np.arcsin, 2.3),
    "acos": ((UNIT,), np.arccos, 1.4),
    "atan": ((REAL,), np.arctan, 1.5),
    "atan2": (
        (_all(REAL, _evenly(-1, 1), TINY), _all(REAL[::-1], _evenly(-1, 1), _evenly(-1, 1))),
        np.arctan2,
        1.9,
    ),
    "sinh": ((_all(TINY, _evenly(-710.4, 710.4), _evenly(-2, 2)),), np.sinh, 2.5),
    "cosh": ((_all(TINY, _evenly(-710.4, 710.4), _evenly(-2, 2)),), np.cosh, 1.7),
    "tanh": ((REAL,), np.tanh, 2.8),
    "asinh": ((_all(REAL, _both_signs(POSITIVE[POSITIVE > 1e-306])),), np.arcsinh, 2.0),
    "acosh": (
        (1 + _all(_over_scales(1e-15, 1), _evenly(0, 5), _over_scales(1, 1e308)),),
        np.arccosh,
        2.9,
    ),
    "atanh": ((UNIT[abs(UNIT) < 1],), np.arctanh, 2.8),
    "pow": ((BASES, EXPONENTS), np.power, 4.0),
}

EXTREMES = (-inf, -3.0, -2.5, -2.0, -1.0, -0.5, -0.0, 0.0, 0.5, 1.0, 2.0, 2.5, 3.0, inf, nan)


def _computed(name: str, *arguments: np.ndarray) -> np.ndarray:
    return np.asarray(jax.jit(ELEMENTARY[name])(*map(jnp.asarray, arguments)))


def _differences(got: np.ndarray, wanted: np.ndarray) -> np.ndarray:
    """Differences in units in the last place; results too small for all digits are left out."""
    rounded = wanted.astype(float)
    kept = np.isfinite(rounded) & (abs(rounded) > SMALLEST)
    assert kept.mean() > 0.9
    unit = np.spacing(abs(rounded[kept])).astype(Wide)
    return (abs(got[kept].astype(Wide) - wanted[kept]) / unit).astype(float)


def test_every_function_is_compared():
    assert CASES.keys() == ELEMENTARY.keys()
    for name in ELEMENTARY:
        primitive = getattr(jax.lax, f"{name}_p", None)
        assert name == "log2" if primitive is None else primitive.name == name  # from JAX 0.12 on


@wide
@pytest.mark.parametrize("name", CASES)
def test_within_units_in_the_last_place(name: str):
    arguments, function, limit = CASES[name]
    with np.errstate(over="ignore", under="ignore"):
        wanted = function(*(argument.astype(Wide) for argument in arguments))
    differences = _differences(_computed(name, *arguments), wanted)
    assert differences.max() <= limit


@wide
def test_power_loses_digits_with_very_large_results_only():
    base = _over_scales(0.5, 2)
    exponent = _evenly(-690, 690) / np.log(base)
    wanted = np.power(base.astype(Wide), exponent.astype(Wide))
    assert _differences(_computed("pow", base, exponent), wanted).max() < 40


@pytest.mark.parametrize("name", CASES)
def test_special_values(name: str):
    """Zeros of either sign, ends of the domain and beyond, overflow, infinities, NaN."""
    arguments, function, _ = CASES[name]
    values = EXTREMES
    if len(arguments) == 1 and name not in ("sin", "cos", "tan"):
        values = (*EXTREMES, 709.79, LARGEST, 1e300, -1e300)
    pairs = [grid.ravel() for grid in np.meshgrid(*[np.array(values)] * len(arguments))]
    with np.errstate(all="ignore"):
        wanted = function(*pairs)
    got = _computed(name, *pairs)
    np.testing.assert_allclose(got, wanted, rtol=1e-15)
    zero = wanted == 0
    np.testing.assert_array_equal(np.signbit(got[zero]), np.signbit(wanted[zero]))


def test_turns_of_large_numbers_stay_in_bounds():
    x = _all(_both_signs(_over_scales(1e6, LARGEST)), np.array([LARGEST, -LARGEST]))
    sine, cosine, tangent = (_computed(name, x) for name in ("sin", "cos", "tan"))
    assert max(abs(sine).max(), abs(cosine).max()) <= 1
    np.testing.assert_allclose(sine**2 + cosine**2, 1, rtol=1e-11)
    assert np.isfinite(tangent).all()
    # Half a unit of the argument moves the sine as much as is lost.
    some = abs(x) < 1e12
    assert (abs(sine - np.sin(x))[some] <= np.spacing(abs(x[some]))).all()


@pytest.mark.parametrize("name", ELEMENTARY)
def test_basic_operations_only(name: str):
    shape = (2, 3)
    arguments = [jnp.full(shape, 0.5, float)] * len(CASES[name][0])
    traced = jax.make_jaxpr(ELEMENTARY[name])(*arguments)
    (result,) = traced.out_avals
    assert result.shape == shape
    assert result.dtype == jnp.float64
    operations = list(_operations(traced.jaxpr))
    assert {operation.primitive.name for operation in operations} <= set(ALLOWED.split())
    for operation in operations:
        if operation.primitive.name == "convert_element_type":
            assert operation.invars[0].aval.dtype != operation.outvars[0].aval.dtype


def _operations(jaxpr: Any) -> Any:
    for operation in jaxpr.eqns:
        inner = [value for value in operation.params.values() if hasattr(value, "jaxpr")]
        if operation.primitive.name in ("jit", "pjit"):
            for one in inner:
                yield from _operations(one.jaxpr)
        else:
            yield operation
