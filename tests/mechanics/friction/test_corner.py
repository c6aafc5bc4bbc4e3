"""Friction at a corner: the force balance of a massless string, its limit, and derivatives."""

from __future__ import annotations

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

import notchflex as nf
from notchflex._jax import jax, jnp
from notchflex.mechanics.friction import friction_law

TURNING = np.array([0.0, 1e-6, 0.1, 0.7, 1.5])


@given(mu=st.floats(0.0, 2.0), turning=st.floats(0.0, 0.9))
def test_forces_on_the_string_balance(mu: float, turning: float) -> None:
    bound = friction_law(nf.Corner(mu)).bounds(np.array([turning, 0.0]))
    low, high = np.exp(-float(bound[0])), 1.0
    # the pressure lies on the bisector, friction across it
    pressure = (low + high) * np.sin(turning / 2)
    friction = (high - low) * np.cos(turning / 2)
    np.testing.assert_allclose(friction, mu * pressure, rtol=1e-12, atol=1e-15)


def test_each_edge_has_its_own_turning() -> None:
    law = friction_law(nf.Corner(0.5))
    turning = np.stack([TURNING, TURNING[::-1]], axis=-1)
    exit_bound, entry_bound = np.moveaxis(law.bounds(turning), -1, 0)
    np.testing.assert_array_equal(exit_bound, entry_bound[::-1])
    half = TURNING / 2
    ratio = (np.cos(half) - 0.5 * np.sin(half)) / (np.cos(half) + 0.5 * np.sin(half))
    np.testing.assert_allclose(np.exp(-np.asarray(exit_bound)), ratio, rtol=1e-14)


def test_the_limit() -> None:
    law = friction_law(nf.Corner(0.8))
    limit = 2 * np.arctan(1 / 0.8)
    turning = np.array([limit - 1e-3, limit + 1e-3, np.pi])
    for edges in (turning, 0 * turning), (0 * turning, turning):
        valid = law.valid(np.stack(edges, axis=-1))
        np.testing.assert_array_equal(valid, [True, False, False])
    bound = jax.jit(lambda law, turning: law.bounds(turning))(law, turning)
    assert np.all(np.isfinite(bound))
    assert np.all(np.diff(bound) >= 0.0)
    assert float(bound[-1]) > 20.0  # the tension falls to nothing
    slope = jax.vmap(jax.grad(law.bounds))(jnp.asarray(turning))
    assert np.all(np.isfinite(slope))
