"""Rotations by vectors, and their slopes, up to a whole turn."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from scipy.linalg import expm
from scipy.spatial.transform import Rotation

from notchflex.mechanics.motion import left_slope, left_slope_change, rotation_about, skew

AXIS = np.array([0.48, -0.6, 0.64])
CONSTANT = np.array([0.3, -1.1, 0.7])


@pytest.mark.parametrize("angle", [0.0, 1e-9, 1e-3, 0.7, 1.0, 2.5, 3.14159, 4.5, 6.28])
def test_slopes_of_a_rotation_are_those_of_the_exponential(angle, margin):
    vector = angle * AXIS
    # The integral of exp(s v) over s from 0 to 1 is a block of the exponential of a larger matrix.
    blocks = np.zeros((6, 6))
    blocks[:3, :3], blocks[:3, 3:] = np.asarray(skew(vector)), np.eye(3)
    rotation, slope, change, wanted = jax.jit(
        lambda v: (
            rotation_about(v),
            left_slope(v),
            left_slope_change(v, jnp.array(CONSTANT)),
            jax.jacfwd(lambda varied: left_slope(varied).T @ CONSTANT)(v),
        )
    )(jnp.array(vector))
    margin.within("rotation", rotation - Rotation.from_rotvec(vector).as_matrix(), 5e-15)
    margin.within("slope", slope - expm(blocks)[:3, 3:], 5e-14)
    margin.within("change of the slope", change - wanted, 5e-15)
