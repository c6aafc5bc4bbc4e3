"""Capstan friction with a constant loss: balance at every contact, memory, and finite slopes."""

from __future__ import annotations

import numpy as np
import pytest

import notchflex as nf
from notchflex._jax import constant, jax, jnp
from notchflex.mechanics.friction import friction_law

LOSS, MU = 0.05, 0.13
PULLS = (0.03, 0.1, 0.3, 1.0, 0.9, 0.2, 0.01, 0.0, 0.6)


@pytest.fixture(scope="module")
def path() -> nf.EquilibriumPath:
    robot = nf.load_robot("pacheco2021-a").replace(friction=nf.Capstan(MU, constant_loss=LOSS))
    return nf.simulate(robot, [nf.Load(tension=pull) for pull in PULLS])


def sides(path: nf.EquilibriumPath, step: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Tension before and behind every contact, N, and e^b there."""
    tension = path.span_tension[step, 0]
    turning = np.repeat(0.5 * np.abs(path.notch_angle[step]), 2)[: len(tension) - 1]
    return tension[:-1], tension[1:], np.exp(MU * turning)


def test_every_contact_stays_between_the_two_limits_of_sliding(path: nf.EquilibriumPath) -> None:
    assert path.converged.all(), path.reason
    slid = set()
    for step in range(len(PULLS)):
        before, behind, ratio = sides(path, step)
        # Pulling: T = e^b T' + F; letting go: T' = e^b T + F.
        over = np.stack([before - ratio * behind - LOSS, behind - ratio * before - LOSS])
        assert over.max() < 1e-8
        at_limit = np.abs(over) < 1e-8
        state = path.contact_state[step, 0][: len(before)]
        assert at_limit[0][state > 0].all()
        assert at_limit[1][state < 0].all()
        slid |= set(state.tolist())
    assert slid == {-1, 0, 1}


def test_pull_below_the_loss_moves_nothing(path: nf.EquilibriumPath) -> None:
    free = np.radians([notch.precurvature_deg for notch in path.robot.notches])
    assert np.abs(path.notch_angle[0] - free).max() < 1e-8
    assert path.span_tension[0, 0, 1:].max() < 1e-8


def test_tension_stays_locked_in_when_the_base_is_let_go(path: nf.EquilibriumPath) -> None:
    before, behind, ratio = sides(path, PULLS.index(0.0))
    assert before[0] < 1e-8
    np.testing.assert_allclose(behind[0], LOSS, atol=1e-8)
    np.testing.assert_allclose(behind[1], ratio[1] * LOSS + LOSS, atol=1e-8)


@pytest.mark.parametrize("tension", [0.0, LOSS, 2.0 * LOSS])
@pytest.mark.parametrize("sign", [-1.0, 1.0])
def test_slopes_are_finite_at_every_tension(tension: float, sign: float) -> None:
    law = friction_law(nf.Capstan(MU, constant_loss=LOSS))
    turning, way = jnp.full(2, 0.2), jnp.full(2, sign)

    def total(law: object, tension: jax.Array, turning: jax.Array) -> jax.Array:
        return law.limits(turning, tension + jnp.zeros(2), way).sum()  # pyright: ignore

    slopes = jax.grad(total, argnums=(0, 1, 2))(law, constant([tension]), turning)
    assert all(np.isfinite(leaf).all() for leaf in jax.tree.leaves(slopes))
    if tension == 2.0 * LOSS:
        step = 1e-7
        high, low = (total(law, jnp.array([tension + by]), turning) for by in (step, -step))
        np.testing.assert_allclose(slopes[1][0], (high - low) / (2 * step), rtol=1e-6)


LONG = pytest.param("two-axis-wrist", marks=pytest.mark.nightly)


@pytest.mark.parametrize("name", ["pacheco2021-a", LONG])
@pytest.mark.parametrize("first", ["force", "stroke"])
def test_loads_of_every_kind_are_solved_from_rest(name: str, first: str) -> None:
    robot = nf.load_robot(name).replace(friction=nf.Capstan(MU, constant_loss=0.02))
    none = (None,) * (robot.number_of_tendons - 1)
    force = (0.005, 0.0, 0.0)
    begins = {
        "force": nf.Load(tip_force=force),
        "stroke": nf.Load(stroke=(0.1, *none)),
    }
    loads = [begins[first], nf.Load(tension=(0.5, *none), tip_force=force), nf.Load(), nf.Load()]
    path = nf.simulate(robot, loads)
    assert path.converged.all(), path.reason
    for step in range(len(loads)):
        for tendon in range(robot.number_of_tendons):
            tension = path.span_tension[step, tendon]
            before, behind = tension[:-1], tension[1:]
            turning = path.contact_turning[step, tendon][: len(before)]
            ratio = np.exp(MU * turning)
            over = np.stack([before - ratio * behind - 0.02, behind - ratio * before - 0.02])
            assert np.nanmax(over) < 1e-8
            assert np.nanmin(tension) > -1e-12
