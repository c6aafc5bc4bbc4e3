"""Shapes without forces: the tip of given notch angles, and the kinematic model of a stroke."""

from __future__ import annotations

import numpy as np
from jaxtyping import Float

from notchflex._jax import jax, jit, jnp
from notchflex.chain import Chain, assemble
from notchflex.errors import InputError
from notchflex.flexure import relative_pose
from notchflex.robot import Robot
from notchflex.statics.quantities import body_poses
from notchflex.tendon.wall_arc import WallArc


def tip_from_angles(
    robot: Robot, notch_angle: Float[np.ndarray, "s n"]
) -> tuple[Float[np.ndarray, "s 3"], Float[np.ndarray, "s 3 3"]]:
    """Forward kinematics: the tip that given notch angles lead to (Pacheco 2021, eq. 1-2).

    Args:
        robot: The robot.
        notch_angle: Angle of every notch, base to tip, precurvature included, rad.

    Returns:
        Tip position on the tube axis (mm) and tip rotation, in the frame of the base.

    Raises:
        InputError: As many angles as the robot has notches are needed, finite.

    Example:
        >>> from notchflex import load_robot
        >>> position, _ = tip_from_angles(load_robot("pacheco2021-a"), np.zeros((1, 5)))
        >>> position.tolist()
        [[0.0, 0.0, 10.0]]
    """
    angles = np.atleast_2d(np.asarray(notch_angle, float))
    if angles.ndim != 2 or angles.shape[1] != robot.number_of_notches:
        raise InputError(
            f"{robot.name} has {robot.number_of_notches} notches; got angles of shape "
            f"{np.shape(notch_angle)}, give one column per notch"
        )
    if not np.isfinite(angles).all():
        raise InputError("a notch angle is not finite; give angles in rad")
    position, rotation = _tips(assemble(robot), angles)
    return np.asarray(position), np.asarray(rotation)


@jit
def _tips(chain: Chain, angles: Float[np.ndarray, "s n"]) -> tuple[jax.Array, jax.Array]:
    rods = chain.rods
    # The first mode of a notch turns its distal body by its amplitude.
    free = jnp.sum(rods.length * rods.reference_strain[..., 1], axis=-1)

    def tip(angle: jax.Array) -> tuple[jax.Array, jax.Array]:
        modes = jnp.zeros_like(chain.stiffness).at[:, 0].set(angle - free)
        bodies = body_poses(jax.vmap(relative_pose)(rods, modes))
        last = jax.tree.map(lambda leaf: leaf[-1], bodies)
        return last.point(jnp.array([0.0, 0.0, 1.0]) * chain.body_length[-1]), last.rotation

    return jax.lax.map(tip, angles)


def equal_stroke_angles(robot: Robot, stroke: Float[np.ndarray, " s"]) -> Float[np.ndarray, "s n"]:
    """The kinematic model of Pacheco 2021, eq. 1-3: the stroke is shared equally by all notches.

    Every notch bends by its share over its moment arm r_i + ybar, at most until it closes. No
    force, material or friction enters; it is the paper's model (iii), for comparison.

    Args:
        robot: A robot whose first tendon runs along the wall.
        stroke: Tendon drawn out at the base, mm.

    Returns:
        Angle of every notch, base to tip, rad.

    Raises:
        InputError: The first tendon does not run along the wall over every notch toward its bend.

    Example:
        >>> from notchflex import load_robot
        >>> angle = equal_stroke_angles(load_robot("pacheco2021-a"), np.array([0.25]))
        >>> print(f"{np.degrees(angle[0, 0]):.8f}")
        2.06615233
    """
    chain = assemble(robot)
    first = next(
        (g for g in chain.groups if isinstance(g, WallArc) and 0 in g.numbers),
        None,
    )
    if first is None:
        raise InputError(
            'the kinematic model needs a first tendon with path = "wall-arc"; '
            f"the first tendon of {robot.name} has another"
        )
    column = first.numbers.index(0)
    arm = np.asarray(first.across[:, column, 0])
    if not (np.asarray(first.present[:, column]) * arm > 0.0).all():
        raise InputError(
            "the kinematic model needs a first tendon that crosses every notch on the side to "
            f"which it bends; that of {robot.name} does not"
        )
    share = np.atleast_1d(np.asarray(stroke, float))[:, None] / chain.flexures
    closing = np.asarray(chain.rods.length.sum(-1) / chain.rods.lip[:, 0])
    return np.clip(share / arm, 0.0, closing)
