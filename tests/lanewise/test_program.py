"""Programs of the small compiler against what JAX makes of the same functions."""

from fractions import Fraction

import numpy as np
import pytest
from jax.extend.core import Primitive

from lanewise import Program, UnsupportedPrimitiveError, lower, machine_code
from lanewise.ir import graph
from notchflex._jax import jax, jnp

# Fewer than a vector's lanes, as many, more, and several vectors.
SIZES = (1, 3, 8, 27)
ROUNDING = 1e-13


def given(size):
    return np.random.default_rng(size).normal(size=6 * size + 4)


def program(function, given, long, by_row=None):
    lowered, tree = lower(function, given, long, by_row)
    code = machine_code(lowered.text, 0)
    return Program(code, lowered.sizes, lowered.memory, by_row), tree


def single(function, *arrays, long):
    made, tree = program(function, arrays, long)
    leaves = jax.tree.leaves(tree)
    return [one.reshape(leaf.shape) for one, leaf in zip(made([*arrays]), leaves, strict=True)]


def check(function, *arrays, long):
    """One by one and as rows of a batch, the program finds what JAX finds."""
    wanted = [np.asarray(one, float) for one in jax.tree.leaves(jax.jit(function)(*arrays))]
    for own, want in zip(single(function, *arrays, long=long), wanted, strict=True):
        np.testing.assert_allclose(own, want, rtol=ROUNDING, atol=ROUNDING)
    rows = [np.stack([array * (1.0 + 0.1 * row) for row in range(11)]) for array in arrays]
    wanted = jax.tree.leaves(jax.jit(jax.vmap(function))(*rows))
    made, _ = program(function, arrays, long, [True] * len(arrays))
    for own, want in zip(made(rows), wanted, strict=True):
        want = np.asarray(want, float).reshape(11, -1)
        np.testing.assert_allclose(own, want, rtol=ROUNDING, atol=ROUNDING)


def parted(vector, size):
    return vector[: 6 * size].reshape(size, 3, 2), vector[6 * size :]


@pytest.mark.parametrize("size", SIZES)
def test_products_and_choices_lane_by_lane(size):
    def function(vector):
        table, few = parted(vector, size)
        products = jnp.einsum("nij,nkj->nik", table, table)
        chosen = jnp.where(products > 0.3, products, few[0] - 2.0 * products)
        return chosen, jnp.sqrt(jnp.abs(products)), few[1] * table[:, 1], few[:2] / few[2]

    check(function, given(size), long=(size, size + 1))


@pytest.mark.parametrize("size", SIZES)
def test_what_goes_from_lane_to_lane(size):
    def function(vector):
        table, few = parted(vector, size)
        along = jnp.cumsum(table[:, 0], axis=0)
        back = jnp.cumsum(table[::-1, 1, 0])[::-1]
        shifted = jnp.concatenate([few[:1], along[:-1, 0]]) * back
        pairs = table[0 : size // 2 * 2 : 2] - table[1 : size // 2 * 2 : 2]
        joined = jnp.concatenate([pairs, table[size // 2 * 2 :]]) * 3.0
        woven = jnp.stack([table[:, 0], table[:, 1]], axis=1).reshape(2 * size, 2) + 1.0
        return along, back, shifted, joined, woven

    check(function, given(size), long=(size, size + 1))


@pytest.mark.parametrize("size", SIZES)
def test_sums_and_extremes(size):
    def function(vector):
        table, few = parted(vector, size)
        flat = jnp.concatenate([table.ravel(), few])
        large = table > 0.0
        return (
            table.sum(axis=0),
            table.max(axis=(0, 2)),
            table.min(),
            table.prod(axis=1),
            jnp.max(jnp.abs(flat)),
            jnp.linalg.norm(flat),
            large.any(axis=0),
            large.all(axis=1),
            (1.0 * large).sum(),
            jnp.einsum("nij,nk->ijk", table, table[:, 0]),
            jnp.argmax(table, axis=1),
            jnp.argmin(table[:, 0, 0]),
        )

    check(function, given(size), long=(size, size + 1))


@pytest.mark.parametrize("size", SIZES)
def test_loops_and_conditions(size):
    def function(vector):
        table, few = parted(vector, size)

        def grown(state):
            count, row, other = state
            return count + 1, other + 0.5 * row, row + 0.1 * jnp.max(other)

        def going(state):
            return (state[0] < 5) & (jnp.sum(jnp.abs(state[1])) < 40.0)

        looped = jax.lax.while_loop(going, grown, (0, table[:, 0, 0], table[:, 1, 1]))

        def step(carry, item):
            place, row = item

            def yes():
                found = jax.lax.while_loop(
                    lambda state: state[0] < place,
                    lambda state: (state[0] + 1.0, 0.9 * state[1] + table[:, 0, 1]),
                    (0.0, carry[:size]),
                )
                return jnp.concatenate([found[1], carry[size:]]), found[0]

            def no():
                return carry, jnp.sum(row)

            moved, told = jax.lax.cond(row[0, 0] > 0.0, yes, no)
            return moved, jnp.concatenate([moved, told[None]])

        start = jnp.concatenate([table[:, 2, 0], few])
        places = 1.0 * jnp.minimum(jnp.arange(size), 2)
        return looped, jax.lax.scan(step, start, (places, table), reverse=size % 2 == 0)

    check(function, given(size), long=(size, size + 1))


@pytest.mark.parametrize("size", SIZES)
def test_loops_that_others_do_not_change_stand_before_them(size):
    """Loops of the argument, of constants alone, and one that the loop around it does change."""

    def grown(start):
        return jax.lax.scan(lambda one, step: (one * 0.5 + step, one), start, jnp.arange(4.0))

    def function(vector):
        table, few = parted(vector, size)

        def step(total, factor):
            of_vector, of_row = grown(table[:, 0]), grown(factor * table[:, 1])
            total = total + of_vector[0] * of_row[1][2].sum() + grown(jnp.ones((1, 2)))[0]
            return total, (of_vector[1][1], of_row[0])

        return jax.lax.scan(step, jnp.zeros((size, 2)), few[:3])

    check(function, given(size), long=(size, size + 1))


def test_a_choice_between_known_zeros_is_no_operation():
    def function(vector):
        zeros = jnp.zeros(4)
        return vector + jnp.where(vector > 0.0, zeros, -zeros)

    assert "select" not in lower(function, [np.ones(4)], (4,))[0].text


@pytest.mark.parametrize("size", [3, 13])
def test_picking_and_putting(size):
    def function(vector):
        table, few = parted(vector, size)
        places = jnp.clip(jnp.abs(3.0 * table[:, :2, 0]), 0, 2).astype(int)
        picked = jax.vmap(lambda row, at: row[at])(table, places)
        put = table.at[:, 1].set(few[0]).at[:, 0].add(2.0)
        return picked, put, table[:, np.array([2, 0])], jnp.pad(table, ((1, 0), (0, 0), (0, 2)))

    check(function, given(size), long=(size, size + 1))


def test_whole_numbers_and_functions_of_angles():
    def function(values):
        whole = jnp.round(3.0 * values).astype(int)
        bits = jax.lax.shift_left(whole + 1023, 2) ^ 5
        return (
            -whole,
            bits,
            jnp.sign(values),
            values**3,
            values**-2,
            jnp.clip(values, -0.5, 0.5),
            jnp.exp(values),
            jnp.log(jnp.abs(values)),
            jnp.tan(values),
            jnp.arctan2(values, values[::-1]),
            jnp.arctanh(0.3 * values),
            jnp.isfinite(values / 0.0),
            jnp.maximum(values, jnp.nan),
        )

    check(function, 0.3 * given(1), long=())


def test_rows_of_their_own_and_what_all_share():
    size = 5

    def function(shared, own):
        return shared.reshape(size, 2) * own[:size, None] + jnp.cumsum(shared[:size])[:, None]

    shared, own = np.arange(10.0), np.random.default_rng(0).normal(size=(19, 7))
    made, _ = program(function, [shared, own[0]], (size,), (False, True))
    (found,) = made([shared, own])
    wanted = jax.vmap(function, in_axes=(None, 0))(shared, own)
    np.testing.assert_allclose(found, np.asarray(wanted).reshape(19, -1), rtol=ROUNDING)
    (none,) = made([shared, own[:0]])
    assert none.shape == (0, 10)


@pytest.mark.parametrize("size", SIZES)
def test_a_loop_over_what_all_rows_share(size):
    """The entries of a step are the same in all rows, and meet what differs in them."""

    def function(shared, own):
        def step(total, one):
            return total + one[1] * own[0], (total * one, one[0] * own[:2], jnp.flip(one))

        return jax.lax.scan(step, own[1], shared.reshape(size, 2))

    shared, own = given(size)[: 2 * size], np.random.default_rng(0).normal(size=(11, 3))
    made, _ = program(function, [shared, own[0]], (size,), (False, True))
    wanted = jax.tree.leaves(jax.vmap(function, in_axes=(None, 0))(shared, own))
    for found, want in zip(made([shared, own]), wanted, strict=True):
        want = np.asarray(want).reshape(11, -1)
        np.testing.assert_allclose(found, want, rtol=ROUNDING, atol=ROUNDING)


def primitive(name, function):
    """JAX's primitive of that name; where this JAX is too old, one that computes the same."""
    if hasattr(jax.lax, f"{name}_p"):
        return getattr(jax.lax, f"{name}_p").bind
    made = Primitive(name)
    made.def_impl(function)
    made.def_abstract_eval(lambda x, *_: x)
    return made.bind


@pytest.mark.parametrize("values", [np.linspace(-3.0, 3.0, 13), 1.0 + 1e-9 * np.arange(9.0)])
def test_primitives_of_later_versions_of_jax(values):
    """JAX 0.12 writes derivatives of arc cosines and polynomials by primitives of their own."""
    one_minus_square = primitive("one_minus_square", lambda x: (1 + x) * (1 - x))
    horner = primitive("polynomial", lambda x, a, b, c: a + x * (b + x * c))

    def function(x):
        whole = one_minus_square(jnp.round(4.0 * x).astype(int))
        return one_minus_square(x), whole, horner(x, *(jnp.float64(one) for one in (1.5, -2.0, 3)))

    exact = np.array([1 - Fraction(one) ** 2 for one in values], float)
    wanted = exact, 1 - np.round(4.0 * values) ** 2, 1.5 + values * (3.0 * values - 2.0)
    for own, want in zip(single(function, values, long=(len(values),)), wanted, strict=True):
        np.testing.assert_allclose(own, want, rtol=1e-15)


def test_what_is_not_known_is_said(monkeypatch):
    with pytest.raises(UnsupportedPrimitiveError, match="sort"):
        program(jnp.sort, [np.ones(4)], (4,))
    assert graph._MAX_NODES == 1_000_000
    monkeypatch.setattr(graph, "_MAX_NODES", 4_000)
    with pytest.raises(UnsupportedPrimitiveError, match="4000"):
        program(lambda v: jnp.sin(v[:, None] * v[None, :] + 1.0), [np.ones(70)], ())
    program(lambda v: jnp.sin(v[:, None] * v[None, :] + 1.0), [np.ones(10)], ())


@pytest.mark.parametrize("size", SIZES)
def test_lanes_picked_in_any_order(size):
    """Every second lane, shifted ones, and a few of several rows put together."""

    def function(vector):
        table, _ = parted(vector, size)
        rows = jnp.sin(table[:, :, 0]) * table[:, :, 1]
        even, odd = rows[::2], rows[1::2]
        joined = even[: len(odd)] * odd
        mixed = jnp.concatenate([rows[size // 2 :], rows[: size // 2, ::-1]])
        around = rows[(7 * np.arange(size)) % size]
        return joined, mixed * rows, around - rows, rows[1:] / (2.0 + rows[:-1])

    check(function, given(size), long=(size, size + 1))


def eliminated(vector, size, width):
    """Loops along the lanes over small matrices that are computed and used lane by lane."""
    table = jnp.sin(jnp.moveaxis(jnp.reshape(vector, (width, width, size)), -1, 0))

    def step(carry, matrix):
        own = carry @ (matrix + jnp.eye(width))
        return own / (1.0 + jnp.sum(own**2)), (own, own[0, 0] > 0.1, own[:0])

    last, (found, signs, none) = jax.lax.scan(step, jnp.eye(width), table, reverse=size % 2 == 0)
    back = jax.lax.scan(lambda one, own: (one @ own, one), last, found)[1]
    return last, found * table, jnp.where(signs, back[:, 0, 1], 0.5), none


@pytest.mark.parametrize("size", SIZES)
def test_loops_along_the_lanes(size):
    vector = np.random.default_rng(size).normal(size=9 * size)
    check(lambda x: eliminated(x, size, 3), vector, long=(size, size + 1))


def test_arrays_that_are_read_only_or_empty():
    made, _ = program(lambda x, y: (2.0 * x, y + 1.0), [np.ones(3), np.ones(0)], ())
    fixed = np.arange(3.0)
    fixed.flags.writeable = False
    twice, none = made([fixed, np.ones(0)])
    assert twice.tolist() == [0.0, 2.0, 4.0]
    assert none.size == 0
