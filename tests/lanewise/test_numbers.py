"""Numbers at the edges: folded when a program is compiled or computed when it is run, as XLA."""

import numpy as np
import pytest
from jax import lax

from lanewise import Program, UnsupportedPrimitiveError, lower, machine_code
from lanewise._jax import jax, jnp
from lanewise.lowering import primitives

EDGES = [0.0, -0.0, 1.0, -1.5, 2.5, 0.49999999999999994, 1e19, -1e19, np.inf, -np.inf, np.nan]
INTEGERS = [0, 1, -1, 7, -7, 63, 64, -(1 << 63), (1 << 63) - 1, 1 << 40]


def compiled(function, *arrays, sizes=()):
    lowered, tree = lower(function, arrays, sizes)
    program = Program(machine_code(lowered.text, 0), lowered.sizes, lowered.memory, None)
    leaves = jax.tree.leaves(tree)
    return [one.reshape(leaf.shape) for one, leaf in zip(program(arrays), leaves, strict=True)]


def check(function, known, sizes=()):
    """Compare with XLA, for known numbers and for the same numbers as an argument."""
    wanted = np.asarray(jax.jit(function)(known), float)
    at_run_time, folded = compiled(
        lambda x: (function(_like(x, known)), function(jnp.asarray(known))),
        np.asarray(known, float).view(float) if known.dtype == float else _bits(known),
        sizes=sizes,
    )
    np.testing.assert_array_equal(at_run_time, wanted)
    np.testing.assert_array_equal(folded, wanted)


def _bits(integers):
    """Integers as floats of the same bits."""
    return integers.view(float)


def _like(x, known):
    return x if known.dtype == float else lax.bitcast_convert_type(x, np.int64)


@pytest.mark.parametrize("sizes", [(), (11,)])
@pytest.mark.parametrize(
    "function",
    [
        lambda x: lax.round(x, lax.RoundingMethod.AWAY_FROM_ZERO),
        lambda x: lax.round(x, lax.RoundingMethod.TO_NEAREST_EVEN),
        lambda x: lax.convert_element_type(x, np.int64),
        lambda x: lax.div(x, lax.full_like(x, 8.0)),
        lambda x: lax.max(x, lax.full_like(x, -0.0)),
        lax.sign,
        lax.floor,
        jnp.cumsum,
    ],
)
def test_floats(function, sizes):
    check(function, np.array(EDGES), sizes)


@pytest.mark.parametrize("divisor", [0, 1, -1, 2, -7, 1 << 40])
def test_division_of_integers(divisor):
    check(lambda x: lax.div(x, lax.full_like(x, divisor)), np.array(INTEGERS))
    check(lambda x: lax.div(lax.full_like(x, divisor), x), np.array(INTEGERS))


@pytest.mark.parametrize(
    "shift", [lax.shift_left, lax.shift_right_logical, lax.shift_right_arithmetic]
)
def test_shifts_by_any_count(shift):
    check(lambda x: shift(x[::-1], x), np.array(INTEGERS))
    check(lambda x: shift(x, lax.full_like(x, 65)), np.array(INTEGERS))


@pytest.mark.parametrize(
    "function",
    [
        lambda x: x + x,
        lambda x: x * 3,
        lambda x: -x,
        abs,
        jnp.sign,
        lambda x: x**2,
        lambda x: jnp.max(x) + jnp.min(x),
        lambda x: lax.cumsum(x, reverse=True),
        lambda x: lax.cummax(x),
        lambda x: jnp.prod(x[1:4]),
    ],
)
def test_integers_wrap_around(function):
    check(function, np.array(INTEGERS))
    check(function, np.array(INTEGERS), (len(INTEGERS),))


@pytest.mark.parametrize("mode", ["clip", "fill"])
def test_computed_indices_out_of_bounds(mode):
    def function(x):
        index = lax.convert_element_type(x, np.int64)
        return jnp.take(x, index, mode=mode), jnp.take(x, jnp.array([-9, 1, 9]), mode="clip")

    values = np.array([2.0, -3.0, 7.0, 1.0])
    for got, want in zip(compiled(function, values), jax.jit(function)(values), strict=True):
        np.testing.assert_array_equal(got, want)


def test_a_recomputed_function():
    (result,) = compiled(jax.checkpoint(lambda x: 2.0 * x), np.arange(3.0))
    np.testing.assert_array_equal(result, [0.0, 2.0, 4.0])


def test_a_function_with_a_rule_for_vmap():
    @jax.custom_batching.custom_vmap
    def until_all_are_small(x):
        return jax.lax.while_loop(lambda y: jnp.any(y > 1.0), lambda y: 0.5 * y, x)

    @until_all_are_small.def_vmap
    def _(size, batched, x):
        del size
        return until_all_are_small(x), batched[0]

    (result,) = compiled(jax.vmap(until_all_are_small), np.array([1.0, 6.0, 0.5]))
    np.testing.assert_array_equal(result, [0.125, 0.75, 0.0625])


@pytest.mark.parametrize("dtype", [np.float32, np.uint64, np.complex128])
def test_other_numbers_are_refused(dtype):
    with pytest.raises(UnsupportedPrimitiveError, match=np.dtype(dtype).name):
        lower(lambda x: lax.convert_element_type(x, dtype), [np.ones(3)], ())


def test_a_primitive_that_another_jax_writes_otherwise_is_named(monkeypatch):
    monkeypatch.setitem(primitives.PRIMITIVES, "sign", lambda *_: {}["axis"])
    with pytest.raises(UnsupportedPrimitiveError, match=f"`sign` as JAX {jax.__version__}") as info:
        lower(jnp.sign, [np.ones(3)], ())
    assert info.value.primitive == "sign"
