"""Whole functions as one kernel of the CPU: the same numbers, whatever they are given."""

import re

import numpy as np
import pytest

from notchflex._jax import in_one_kernel, jax, jit, jnp

_MATRIX = np.linspace(-1.0, 1.0, 16).reshape(4, 4)
# XLA itself makes one kernel of a loop over less than 1 kB.
_LARGE = np.linspace(-0.1, 0.1, 900).reshape(30, 30)
_MARK = 'xla_cpu_small_call="true"'


def _halved_until_small(matrix: jax.Array, unused: jax.Array) -> tuple[jax.Array, jax.Array]:
    """A loop, a branch, a product, a sum and a value that goes through as it is."""

    def step(state: tuple[jax.Array, jax.Array]) -> tuple[jax.Array, jax.Array]:
        value, count = state
        turned = jax.lax.cond(count % 2 == 0, lambda: value @ matrix, lambda: jnp.sin(value))
        return 0.5 * turned, count + 1

    value, count = jax.lax.while_loop(
        lambda state: jnp.sum(state[0] ** 2) > 1e-3, step, (matrix, jnp.zeros((), int))
    )
    return value, count


def _calls(text: str) -> int:
    """How many operations of a program are calls of such a kernel."""
    return sum(_MARK in line for line in text.splitlines() if re.search(r" call\(", line))


@pytest.mark.parametrize("short", [True, False])
def test_same_numbers(short: bool) -> None:
    program = jit(lambda *given: in_one_kernel(_halved_until_small, *given, short=short))
    value, count = program(_MATRIX, np.ones(3))
    plain, steps = _halved_until_small(jnp.asarray(_MATRIX), jnp.ones(3))
    np.testing.assert_allclose(value, plain, rtol=1e-14, atol=1e-16)
    assert int(count) == int(steps) > 1


@pytest.mark.skipif(jax.__version_info__ >= (0, 11), reason="left to XLA from there on")
@pytest.mark.parametrize("short", [True, False])
def test_one_kernel_where_it_is_short(short: bool) -> None:
    program = jit(lambda *given: in_one_kernel(_halved_until_small, *given, short=short))
    text = program.lower(_LARGE, np.ones(3)).compile().as_text()
    assert _calls(text) == short


def test_left_alone_in_programs_of_others() -> None:
    """Compiled with other options XLA may put into a kernel what it cannot hold."""
    program = jax.jit(lambda *given: in_one_kernel(_halved_until_small, *given, short=True))
    assert _calls(program.lower(_LARGE, np.ones(3)).compile().as_text()) == 0


def test_inside_a_loop_with_what_it_does_not_use() -> None:
    """XLA of jaxlib 0.10.1 ends the process there, were it not for what is returned beside."""

    def kernel(value: jax.Array, unused: jax.Array) -> jax.Array:
        return jnp.cos(value @ value)

    def loop(value: jax.Array, beside: jax.Array) -> jax.Array:
        def step(state: tuple[jax.Array, jax.Array]) -> tuple[jax.Array, jax.Array]:
            return in_one_kernel(kernel, *state, short=True), state[1] + 1.0

        going = jax.lax.while_loop(lambda state: state[1][0] < 3.0, step, (value, beside))
        return going[0]

    expected = _MATRIX
    for _ in range(3):
        expected = np.cos(expected @ expected)
    np.testing.assert_allclose(jit(loop)(_MATRIX, np.zeros(2)), expected, rtol=1e-13)


def test_side_by_side_and_slopes() -> None:
    """It can be mapped over rows and differentiated as any other function."""

    def bent(value: jax.Array) -> jax.Array:
        return jnp.sum(in_one_kernel(lambda x: jnp.sin(x) @ x, value, short=True))

    rows = np.stack([_MATRIX, 2.0 * _MATRIX])
    every = jit(jax.vmap(bent))(rows)
    np.testing.assert_allclose(every, [np.sum(np.sin(row) @ row) for row in rows], rtol=1e-13)
    slope, step = jit(jax.grad(bent))(_MATRIX), 1e-6
    ahead, behind = (
        float(bent(jnp.asarray(_MATRIX + side * step * np.eye(4)))) for side in (1.0, -1.0)
    )
    assert np.trace(slope) == pytest.approx((ahead - behind) / (2.0 * step), rel=1e-8)
