"""From the modes of one flexure to its pose, its resultants and its chord."""

from __future__ import annotations

from typing import Any

import equinox as eqx
import numpy as np
from jaxtyping import Array, Float

from notchflex._jax import jax, jnp
from notchflex.flexure.rod import Rod
from notchflex.flexure.shape import relative_pose, rod_end
from notchflex.material import SectionLaw
from notchflex.motion import Motion, rotation_about, unskew


class FlexureState(eqx.Module):
    """One flexure under given modes (mm, N, rad), in the frame of its proximal body.

    Attributes:
        pose: From the proximal body to the distal one; None where nobody asked.
        twist: Twist (angular, linear) of the distal body, in its own frame, per unit of mode;
            None where nobody asked.
        resultants: Internal moments and forces of each interval, in the rod's frame.
        strain: Strain of each interval beyond that of the free tube.
        internal: Generalised internal force of each mode, N mm per unit of mode.
        bend: Bending of the whole rod about x and y of its frame, rad.
        chord_turn: Rotation, in the proximal body's frame, by which the chord from the rod's
            start to its end has turned in the plane of bending; None where nobody asked.
        chord_angle: Its angle, rad; None where nobody asked.
    """

    pose: Motion | None
    twist: Float[Array, "6 modes"] | None
    resultants: Float[Array, "intervals 6"]
    strain: Float[Array, "intervals 6"]
    internal: Float[Array, " modes"]
    bend: Float[Array, " 2"]
    chord_turn: Float[Array, "3 3"] | None
    chord_angle: Float[Array, ""] | None


def strain(rod: Rod, modes: Float[Array, " modes"]) -> Float[Array, "intervals 6"]:
    """Strain of every interval of a rod."""
    return rod.reference_strain + rod.basis @ modes


def fibre_stretch(across: Float[Array, "*shape 2"]) -> Float[Array, "*shape 6"]:
    """What the strains are weighted with to give the length of a fibre per length of the rod.

    A fibre at (x, y) from the neutral axis has the length of the rod's stretch plus its
    curvatures times their levers, v_z + u_x y - u_y x. This is the concentric wall arc of
    Pacheco's tendon (its l = h - theta (r_i + ybar)) and the edge of a notch alike.
    """
    weights = across @ _ACROSS
    return weights + np.broadcast_to(_ALONG, weights.shape)


_ALONG = np.array([0.0, 0.0, 0.0, 0.0, 0.0, 1.0])
_ACROSS = np.array([[0.0, -1.0, 0.0, 0.0, 0.0, 0.0], [1.0, 0.0, 0.0, 0.0, 0.0, 0.0]])


def pose_and_twist(
    rod: Rod, modes: Float[Array, " modes"]
) -> tuple[Motion, Float[Array, "6 modes"]]:
    """Relative pose, and the distal body's twist in its own frame per unit of mode."""
    pose = relative_pose(rod, modes)
    moved: Motion = jax.jacfwd(lambda varied: relative_pose(rod, varied))(modes)
    turned = jnp.einsum("ji,jkm->ikm", pose.rotation, moved.rotation)
    angular = jax.vmap(unskew, in_axes=-1, out_axes=-1)(turned)
    return pose, jnp.concatenate([angular, pose.rotation.T @ moved.translation])


def flexure_state(
    rod: Rod,
    law: SectionLaw,
    memory: Any,
    modes: Float[Array, " modes"],
    *,
    with_pose: bool,
) -> FlexureState:
    """Everything a flexure's modes decide.

    Args:
        rod: The flexure.
        law: Its material.
        memory: Memory of the material at every interval.
        modes: Amplitude of each strain mode.
        with_pose: Whether pose and twist are wanted; where no force acts on a body they do not
            enter the balance.

    Returns:
        Its state.
    """
    pose, twist = pose_and_twist(rod, modes) if with_pose else (None, None)
    every_strain = strain(rod, modes)
    elastic = every_strain - rod.reference_strain
    response = jax.vmap(law.respond)(elastic, rod.section, memory)
    # A mode that only fills up the arrays is held by a stiffness of 1.
    internal = jnp.einsum("i,ic,icm->m", rod.length, response.resultants, rod.basis)
    has_chord = with_pose and rod.chord is not None
    chord_turn, chord_angle = chord(rod, modes) if has_chord else (None, None)
    return FlexureState(
        pose=pose,
        twist=twist,
        resultants=response.resultants,
        strain=elastic,
        internal=internal + rod.idle * modes,
        bend=rod.length @ every_strain[:, :2],
        chord_turn=chord_turn,
        chord_angle=chord_angle,
    )


def chord(rod: Rod, modes: Float[Array, " modes"]) -> tuple[Float[Array, "3 3"], Float[Array, ""]]:
    """How far the chord of a rod has turned in its plane of bending (Liu 2022, eq. 19).

    The chord is the straight line from the rod's start to its end; for a strip this is the angle
    that the paper calls bending angle, about two thirds of the slope at the end.
    """
    end, free = rod_end(rod, modes).translation, rod.curve_offset
    angle = jnp.atan2(end[0] * free[2] - end[2] * free[0], end[0] * free[0] + end[2] * free[2])
    turn = rotation_about(angle * jnp.array([0.0, 1.0, 0.0]))
    return rod.start_rotation @ turn @ rod.start_rotation.T, angle
