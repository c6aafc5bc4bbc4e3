"""Kinematics without forces: the tip of given notch angles, and the kinematic model of a stroke."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from jaxtyping import Array, Float
from numpy.typing import NDArray

from notchflex._jax import jax, jit, jnp
from notchflex.errors import InputError
from notchflex.mechanics.chain import Chain, assemble
from notchflex.mechanics.contact import closing_angles, free_angle
from notchflex.mechanics.flexure import relative_pose
from notchflex.mechanics.motion import Motion
from notchflex.robot import Robot
from notchflex.solver.body_poses import body_poses
from notchflex.solver.programs.prepare import prepare


def bodies_from_angles(
    robot: Robot, notch_angle: NDArray[np.float64]
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return the poses of all bodies for given notch angles (Pacheco 2021, eq. 1-2).

    Args:
        robot: The robot, n notches.
        notch_angle: Angle of every notch, base to tip, precurvature included, rad, (s, n).

    Returns:
        Origins (mm, (s, n + 1, 3)) and rotations ((s, n + 1, 3, 3)) of the bodies, base first,
        in the frame of the base.

    Raises:
        InputError: Not one finite angle per notch.

    Example:
        >>> from notchflex import load_robot
        >>> position, _ = bodies_from_angles(load_robot("pacheco2021-a"), np.zeros((1, 5)))
        >>> position[0, :, 2].round(9).tolist()
        [0.0, 0.8, 2.8, 4.8, 6.8, 8.8]
    """
    angles = np.atleast_2d(np.asarray(notch_angle, float))
    if angles.ndim != 2 or angles.shape[1] != robot.number_of_notches:
        raise InputError.WRONG_SHAPE(
            f"{robot.name} has {robot.number_of_notches} notches; got angles of shape "
            f"{np.shape(notch_angle)}, give one column per notch"
        )
    if not np.isfinite(angles).all():
        raise InputError.NOT_FINITE("a notch angle is not finite; give angles in rad")
    position, rotation = _bodies(prepare(robot, flat=False).chain, angles)
    return np.asarray(position), np.asarray(rotation)


def tip_from_angles(
    robot: Robot, notch_angle: NDArray[np.float64]
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return the tip pose for given notch angles (Pacheco 2021, eq. 1-2).

    Args:
        robot: The robot, n notches.
        notch_angle: Angle of every notch, base to tip, precurvature included, rad, (s, n).

    Returns:
        Tip position on the tube axis (mm, (s, 3)) and tip rotation ((s, 3, 3)), in the frame
        of the base.

    Raises:
        InputError: Not one finite angle per notch.

    Example:
        >>> from notchflex import load_robot
        >>> position, _ = tip_from_angles(load_robot("pacheco2021-a"), np.zeros((1, 5)))
        >>> position.round(9).tolist()
        [[0.0, 0.0, 10.0]]
    """
    position, rotation = bodies_from_angles(robot, notch_angle)
    along = rotation[:, -1, :, 2] * robot.notches[-1].spacing(None)
    return position[:, -1] + along, rotation[:, -1]


@jit
def _bodies(chain: Chain, angles: Float[Array, "s n"]) -> tuple[Array, Array]:
    rods = chain.rods
    # The first mode of a notch turns its distal body by its amplitude, from the free notch on.
    free = jnp.sum(rods.length * rods.reference_strain[..., 1], axis=-1)

    def shape(angle: Float[Array, " n"]) -> Motion:
        modes = jnp.zeros_like(chain.stiffness).at[:, 0].set(angle - free)
        return body_poses(jax.vmap(relative_pose)(rods, modes))

    poses: Motion = jax.lax.map(shape, angles)
    return poses.translation, poses.rotation


class SharedStroke(NamedTuple):
    """Notch angles and lost stroke of the kinematic model.

    Attributes:
        notch_angle: Angle of every notch, base to tip, rad, (s, n).
        stroke_lost: Part of the stroke that closed notches do not take up, mm, (s,).
    """

    notch_angle: NDArray[np.float64]
    stroke_lost: NDArray[np.float64]


def equal_stroke(robot: Robot, stroke: NDArray[np.float64]) -> SharedStroke:
    """Share a stroke equally between all notches: the kinematic model of Pacheco 2021, eq. 1-3.

    Every notch bends by its share over its moment arm r_i + ybar, from its precurvature on and
    at most until it closes; the rest of its share is lost. No force, material or friction
    enters; it is the paper's model (iii), for comparison.

    Args:
        robot: A robot whose first tendon runs along the wall.
        stroke: Tendon drawn out at the base, mm, (s,).

    Returns:
        Notch angles and lost stroke; there is always an answer.

    Raises:
        InputError: The first tendon does not run along the wall over every notch toward its
            bend, or a stroke is not finite.

    Example:
        >>> from notchflex import load_robot
        >>> shared = equal_stroke(load_robot("pacheco2021-a"), np.array([0.25, 4.0]))
        >>> print(f"{np.degrees(shared.notch_angle[0, 0]):.8f} deg, {shared.stroke_lost[1]:.3f} mm")
        2.06615233 deg, 0.294 mm
    """
    drawn = np.atleast_1d(np.asarray(stroke, float))
    if not np.isfinite(drawn).all():
        raise InputError.NOT_FINITE("a stroke is not finite; give strokes in mm")
    chain = assemble(robot, flat=False)
    first = next(group for group in chain.groups if 0 in group.numbers)
    if first.fibre is None:
        raise InputError.UNSUPPORTED(
            'the kinematic model needs a first tendon with path = "wall-arc"; '
            f"that of {robot.name} has another: leave the model out, or set tendon[1].path"
        )
    column = first.numbers.index(0)
    arm = np.asarray(first.fibre[:, column, 0])
    if not (np.asarray(first.present[:, column]) * arm > 0.0).all():
        raise InputError.UNSUPPORTED(
            "the kinematic model needs a first tendon that crosses every notch on the side to "
            f"which it bends; that of {robot.name} does not"
        )
    share = drawn[:, None] / chain.flexures
    free = free_angle(chain.rods)
    closing = free + closing_angles(chain.rods)
    angle = np.clip(free + share / arm, free, closing)
    lost = np.maximum(share - arm * (angle - free), 0.0)
    # A share that is taken up completely loses nothing, whatever rounding says.
    lost = np.where(angle < closing, 0.0, lost)
    return SharedStroke(angle, lost.sum(axis=1))
