"""Poses of all bodies against one product after the other."""

from __future__ import annotations

import numpy as np
import pytest

from notchflex._jax import jax, jnp
from notchflex.mechanics.motion import Motion, exponential, identity
from notchflex.solver.residual import body_poses


@pytest.mark.parametrize("size", [3, 6])
@pytest.mark.parametrize("count", [1, 2, 5, 8, 27])
def test_poses_are_products_of_all_before(size: int, count: int) -> None:
    twists = np.random.default_rng(count).normal(size=(count, size))
    steps: Motion = jax.vmap(exponential)(jnp.array(twists))
    poses = body_poses(steps)
    pose = identity(2 if size == 3 else 3)
    for number in range(count + 1):
        assert np.asarray(poses.rotation[number]) == pytest.approx(
            np.asarray(pose.rotation), abs=1e-14
        )
        assert np.asarray(poses.translation[number]) == pytest.approx(
            np.asarray(pose.translation), abs=1e-13
        )
        if number < count:
            pose = pose.then(Motion(steps.rotation[number], steps.translation[number]))
