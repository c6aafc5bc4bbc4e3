"""Derivatives of every property: finite for every depth, and right."""

from __future__ import annotations

from functools import cache

import numpy as np
import pytest

from notchflex._jax import jax, jnp
from notchflex.mechanics.cuts import annular_sector, annular_segment

SECTIONS = {"on-axis": annular_sector, "off-axis": annular_segment}
TUBES = [(0.81, 0.70), (1.0, 0.25), (1.0, 0.995)]


def stacked(cut):
    """All properties as one vector, shape (8,), a function of one depth."""
    return lambda *tube: jnp.stack(SECTIONS[cut](*tube))


@cache
def compiled(cut):
    """Properties (depths, 8) and their slopes by r_o, r_i, g for one tube and many depths."""
    over = (None, None, 0)
    values = jax.vmap(stacked(cut), in_axes=over)
    slopes = jax.vmap(jax.jacfwd(stacked(cut), argnums=(0, 1, 2)), in_axes=over)
    return jax.jit(values), jax.jit(slopes)


@pytest.mark.parametrize("cut", SECTIONS)
@pytest.mark.parametrize(("outer", "inner"), TUBES)
def test_finite_for_every_depth(cut, outer, inner):
    wall = outer - inner
    depth = np.concatenate(
        [
            outer * np.array([1e-7, 1e-5, 1e-3, 1.0, 2 - 1e-3, 2 - 1e-5, 2 - 1e-7]),
            np.linspace(0.01, 1.99, 41) * outer,
            # just at, before and beyond the inner wall on either side
            np.ravel(np.array([wall, 2 * outer - wall])[:, None] + np.array([-1e-9, 0, 1e-9])),
        ]
    )
    values, slopes = compiled(cut)
    assert np.all(np.isfinite(values(outer, inner, depth)))
    for slope in slopes(outer, inner, depth):
        assert np.all(np.isfinite(slope))


@pytest.mark.parametrize("cut", SECTIONS)
@pytest.mark.parametrize(("outer", "inner"), TUBES)
def test_against_differences(cut, outer, inner, margin):
    # Depths in every shape of section, none within a step of a change of shape.
    wall = outer - inner
    depth = np.r_[0.4 * wall, 0.8 * wall, np.linspace(1.3 * wall, 1.93 * outer, 7), 1.99 * outer]
    # Fourth-order central differences; the step stays inside the range of the shape.
    h = 1e-3 * np.minimum(wall, np.minimum(depth, 2 * outer - depth))
    values, slopes = compiled(cut)
    here = np.asarray(values(outer, inner, depth))
    pointwise = jax.jit(jax.vmap(stacked(cut)))
    for i, slope in enumerate(slopes(outer, inner, depth)):

        def moved(steps, i=i):
            tube = [np.full_like(depth, outer), np.full_like(depth, inner), depth.copy()]
            tube[i] += steps * h
            return np.asarray(pointwise(*tube))

        wanted = (moved(-2) - 8 * moved(-1) + 8 * moved(1) - moved(2)) / (12 * h[:, None])
        scale = np.abs(wanted) + 1e-3 * np.abs(here) / outer
        error = (np.asarray(slope) - wanted) / scale
        margin.within(f"{cut} {outer} {inner}: slope {i}, relative", error, 1e-6)
