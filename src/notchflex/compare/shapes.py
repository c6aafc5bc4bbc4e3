"""The shape of a robot at measured notch angles, body by body, for its picture."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from notchflex._jax import jax, jnp
from notchflex.chain import Chain, assemble
from notchflex.flexure import relative_pose
from notchflex.robot import Robot
from notchflex.statics.quantities import body_poses


def bodies_from_angles(
    robot: Robot, notch_angle: NDArray[np.float64]
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return where every body is when the notches have given angles (Pacheco 2021, eq. 1-2).

    Args:
        robot: The robot, n notches.
        notch_angle: Angle of every notch, base to tip, with precurvature [rad], (S, n).

    Returns:
        Origins [mm], (S, n + 1, 3), and rotations, (S, n + 1, 3, 3), in the base frame.
    """
    position, rotation = _bodies(assemble(robot), jnp.asarray(notch_angle, float))
    return np.asarray(position), np.asarray(rotation)


@jax.jit
def _bodies(chain: Chain, angles: jax.Array) -> tuple[jax.Array, jax.Array]:
    rods = chain.rods
    # The first mode of a notch turns its distal body by its amplitude, counted from the free notch.
    free = jnp.sum(rods.length * rods.reference_strain[..., 1], axis=-1)

    def shape(angle: jax.Array) -> tuple[jax.Array, jax.Array]:
        modes = jnp.zeros_like(chain.stiffness).at[:, 0].set(angle - free)
        bodies = body_poses(jax.vmap(relative_pose)(rods, modes))
        return bodies.translation, bodies.rotation

    return jax.lax.map(shape, angles)
