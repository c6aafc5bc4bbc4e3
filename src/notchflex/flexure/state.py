"""From the modes of one flexure to its pose, its resultants and its lengths."""

from __future__ import annotations

from typing import Any

import equinox as eqx
import numpy as np
from jaxtyping import Array, Float

from notchflex._jax import jax, jnp
from notchflex.flexure.rod import Rod
from notchflex.material import SectionLaw
from notchflex.motion import Motion, exponential, unskew


class FlexureState(eqx.Module):
    """One flexure under given modes (mm, N, rad), in the frame of its proximal body.

    Attributes:
        pose: From the proximal body to the distal one; None where nobody asked.
        twist: Twist (angular, linear) of the distal body, in its own frame, per unit of mode;
            None where nobody asked.
        resultants: Internal moments and forces of each interval, in the rod's frame.
        strain: Strain of each interval beyond that of the free tube.
        internal: Generalised internal force of each mode, N mm per unit of mode.
        lip_gap: What is left of the notch's opening at its lips, mm.
        lip_slope: Change of the gap per unit of mode, mm.
        bend: Bending of the whole rod about x and y of its frame, rad.
    """

    pose: Motion | None
    twist: Float[Array, "6 modes"] | None
    resultants: Float[Array, "intervals 6"]
    strain: Float[Array, "intervals 6"]
    internal: Float[Array, " modes"]
    lip_gap: Float[Array, ""]
    lip_slope: Float[Array, " modes"]
    bend: Float[Array, " 2"]


def strain(rod: Rod, modes: Float[Array, " modes"]) -> Float[Array, "intervals 6"]:
    """Strain of every interval of a rod."""
    return rod.reference_strain + rod.basis @ modes


def relative_pose(rod: Rod, modes: Float[Array, " modes"]) -> Motion:
    """Pose of the distal body as seen from the proximal one."""
    pose = Motion(rod.start_rotation, rod.start_offset)
    for interval, length in zip(strain(rod, modes), rod.length, strict=True):
        pose = pose.then(exponential(length * interval))
    return pose.then(Motion(rod.end_rotation, rod.end_offset))


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
    to_lip = rod.length[:, None] * fibre_stretch(rod.lip)[None]
    return FlexureState(
        pose=pose,
        twist=twist,
        resultants=response.resultants,
        strain=elastic,
        internal=jnp.einsum("i,ic,icm->m", rod.length, response.resultants, rod.basis),
        lip_gap=jnp.sum(to_lip * every_strain),
        lip_slope=jnp.einsum("ic,icm->m", to_lip, rod.basis),
        bend=rod.length @ every_strain[:, :2],
    )
