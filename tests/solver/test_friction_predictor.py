"""The guess of the play operator against a march from contact to contact."""

from __future__ import annotations

import numpy as np
import pytest

from notchflex import load_robot
from notchflex._jax import jnp
from notchflex.mechanics.chain import assemble
from notchflex.solver.newton import predict_log_ratios
from notchflex.solver.residual import Memory


def marched(before: float, now: float, remembered: np.ndarray, limits: np.ndarray) -> np.ndarray:
    """Log ratios at edges in order, base to tip."""
    old, new, found = np.log(before), np.log(now), []
    for ratio, limit in zip(remembered.ravel(), limits.ravel(), strict=True):
        old -= ratio
        found.append(np.clip(new - old, -limit, limit))
        new -= found[-1]
    return np.reshape(found, remembered.shape)


@pytest.mark.parametrize("part", [1e-3, 0.2, 0.7, 0.999, 1.0, 1.001, 1.4, 3.0, 50.0])
@pytest.mark.parametrize("seed", range(4))
def test_guess_is_that_of_a_march_along_the_tendon(part: float, seed: int) -> None:
    chain = assemble(load_robot("gao2017"))
    rng = np.random.default_rng(seed)
    shape = (chain.flexures, 1, 2)
    limits = rng.uniform(0.0, 0.1, shape) * (rng.uniform(size=shape) > 0.2)
    remembered = limits * np.clip(rng.normal(size=shape), -1.0, 1.0)
    memory = Memory((jnp.array(remembered),), (jnp.zeros(shape),), (jnp.array(limits),))
    (guess,) = predict_log_ratios(chain, jnp.array([2.0]), jnp.array([2.0 * part]), memory)
    expected = marched(2.0, 2.0 * part, remembered, limits)
    assert np.asarray(guess) == pytest.approx(expected, abs=1e-13)


@pytest.mark.parametrize(("before", "now"), [(0.0, 1.0), (1.0, 0.0)])
def test_slack_tendons_slide_everywhere(before: float, now: float) -> None:
    chain = assemble(load_robot("gao2017"))
    limits = np.full((chain.flexures, 1, 2), 0.05)
    memory = Memory((jnp.zeros(limits.shape),), (jnp.zeros(limits.shape),), (jnp.array(limits),))
    (guess,) = predict_log_ratios(chain, jnp.array([before]), jnp.array([now]), memory)
    assert np.array_equal(guess, np.sign(now - before) * limits)


def test_contacts_that_nothing_drives_stand_just_within_their_bound() -> None:
    chain = assemble(load_robot("gao2017"))
    limits = np.full((chain.flexures, 1, 2), 0.05)
    memory = Memory((jnp.array(limits),), (jnp.zeros(limits.shape),), (jnp.array(limits),))
    (guess,) = predict_log_ratios(chain, jnp.array([2.0]), jnp.array([2.0]), memory)
    assert (np.asarray(guess) < limits).all()
    assert np.asarray(guess) == pytest.approx(limits, rel=1e-12)
