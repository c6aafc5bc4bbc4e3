"""Poses of all bodies against one product after the other."""

from __future__ import annotations

import numpy as np
import pytest

from notchflex._jax import jax
from notchflex.mechanics.motion import Motion
from notchflex.solver.residual import body_poses
from twists import exponential


@pytest.mark.parametrize("size", [3, 6])
@pytest.mark.parametrize("count", [1, 2, 5, 8, 27])
def test_poses_are_products_of_all_before(size: int, count: int) -> None:
    twists = np.random.default_rng(count).normal(size=(count, size))
    steps = Motion(*map(np.stack, zip(*map(exponential, twists), strict=True)))
    poses = jax.jit(body_poses)(steps)
    rotation, translation = np.eye(size // 3 + 1), np.zeros(size // 3 + 1)
    for number in range(count + 1):
        np.testing.assert_allclose(poses.rotation[number], rotation, rtol=0, atol=1e-14)
        np.testing.assert_allclose(poses.translation[number], translation, rtol=0, atol=1e-13)
        if number < count:
            translation = translation + rotation @ np.asarray(steps.translation[number])
            rotation = rotation @ np.asarray(steps.rotation[number])
