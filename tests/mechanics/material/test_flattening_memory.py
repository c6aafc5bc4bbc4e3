"""Flattening and hysteresis together: one stored energy, what it gives and what turns to heat."""

from __future__ import annotations

import dataclasses
import itertools
from functools import cache
from typing import Any

import numpy as np
import pytest

import notchflex as nf
from fibre_sections import ENDS, bending, energy, respond, section
from margins import Margin
from notchflex._jax import jax, jnp
from notchflex.mechanics.material import section_law
from notchflex.mechanics.material.law import Flattening

NITINOL = nf.Nitinol(42000.0, 350.0, 6000.0, compression_ratio=1.3, unloading_stress=150.0)
LAW = section_law(NITINOL)
SECTION = section("on-axis", dataclasses.replace(ENDS, odd=0.4, even=0.25))
CORNERS = [0.0, 0.9, 0.5, 0.8, -0.7, -0.2, 0.0]
STEPS = 900
CURVATURE = np.concatenate(
    [[0.0], *(np.linspace(*pair, STEPS + 1)[1:] for pair in itertools.pairwise(CORNERS))]
)


@cache
def history() -> tuple[np.ndarray, np.ndarray, np.ndarray, Flattening]:
    """Moment, memory, stored energy and flattening after each of many curvatures."""

    def step(memory: Any, strain: jax.Array) -> tuple[Any, Any]:
        found = LAW.respond(strain, SECTION, memory)
        return found.memory, (found.resultants[1], found.memory)

    def every(strains: np.ndarray) -> Any:
        moment, memory = jax.lax.scan(step, LAW.rest(SECTION), strains)[1]
        return (
            moment,
            memory,
            *jax.vmap(lambda *at: LAW.stored_energy_density(at[0], SECTION, at[1]))(
                strains, memory
            ),
        )

    return jax.tree.map(np.asarray, jax.jit(every)(CURVATURE[:, None] * bending(1.0)))


def accounts(stride: int) -> tuple[np.ndarray, ...]:
    """Work, stored energy, and heat of fibres and of flattening, by every so many steps.

    Between corners the states do not depend on how many steps there are.
    """
    moment, memory, stored, flat = jax.tree.map(lambda one: one[::stride], history())
    work = np.cumsum(0.5 * (moment[1:] + moment[:-1]) * np.diff(CURVATURE[::stride]))
    heat = np.cumsum(LAW.dissipated(SECTION, memory[:-1], memory[1:]))
    path, change = 0.5 * (flat.path[1:] + flat.path[:-1]), np.diff(flat.transformed)
    heat_of_flattening = np.cumsum(path * change - np.diff(flat.by_transformation))
    return work, stored[1:] - stored[0], heat, heat_of_flattening


def unbalanced(stride: int) -> float:
    work, stored, heat, flattening = accounts(stride)
    return float(np.abs(work - stored - heat - flattening).max() / work.max())


def test_work_is_stored_or_lost(margin: Margin) -> None:
    coarse, fine = unbalanced(5), unbalanced(1)
    margin.within("balance, part of the work", fine, 1e-6)
    assert coarse > 15.0 * fine  # 25 by the trapezoid rule
    work, *_, flattening = accounts(1)
    assert flattening[-1] > 0.01 * work.max()


def test_nothing_is_won_by_transforming() -> None:
    _, _, heat, flattening = accounts(1)
    assert np.diff(heat + flattening).min() > -1e-9


@pytest.mark.parametrize("corner", [1, 2, 4])
def test_moment_is_the_derivative_of_the_energy_behind_a_corner(
    corner: int, margin: Margin
) -> None:
    """All fibres are elastic there, on both sides of the curvature."""
    memory = history()[1][corner * STEPS]
    back = np.sign(CORNERS[corner - 1] - CORNERS[corner])
    at, step = CORNERS[corner] + 0.01 * back, 2e-4

    def held(change: float) -> float:
        found = respond(LAW, bending(at + change), SECTION, memory)
        np.testing.assert_allclose(found.memory, memory, atol=1e-14)
        return float(energy(LAW, bending(at + change), SECTION, found.memory))

    near, far = ((held(by) - held(-by)) / (2.0 * by) for by in (step, 2.0 * step))
    expected = float(respond(LAW, bending(at), SECTION, memory).resultants[1])
    margin.within("moment, N mm", (4.0 * near - far) / 3.0 - expected, 5e-10)


@pytest.mark.nightly
@pytest.mark.parametrize("name", ["odd", "even", "warped", "weak"])
def test_energy_has_the_derivatives_by_the_ends(name: str, margin: Margin) -> None:
    memory = history()[1][STEPS]

    @jax.jit
    def stored(change: jax.Array) -> jax.Array:
        ends = dataclasses.replace(SECTION.ends, **{name: getattr(SECTION.ends, name) + change})
        own = dataclasses.replace(SECTION, ends=ends)
        return LAW.stored_energy_density(jnp.asarray(bending(0.88)), own, memory)[0]

    # A longer step would take nodes of the quadrature across kinks of the material.
    step = 1e-6
    difference = (stored(step) - stored(-step)) / (2.0 * step)
    margin.within("derivative", float(jax.jit(jax.grad(stored))(0.0) - difference), 1e-8)
