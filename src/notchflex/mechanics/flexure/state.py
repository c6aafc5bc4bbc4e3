"""State of one flexure from its modes: pose, resultants and chord."""

from __future__ import annotations

from typing import Any

from jaxtyping import Array, Float

from notchflex._arrays import xp
from notchflex._jax import (
    Pytree,
    jax,
    jnp,
)
from notchflex.mechanics.flexure.rod import Modes, Rod
from notchflex.mechanics.flexure.rod_kinematics import (
    RodConfiguration,
    integrate_rod,
    relative_pose,
    rod_end,
    twist_slope,
)
from notchflex.mechanics.material import SectionLaw, SectionResponse
from notchflex.mechanics.motion import PLANE, Motion, angular, rotation_about


class FlexureState(Pytree):
    """One flexure under given modes (mm, N, rad), in the frame of its proximal body."""

    configuration: RodConfiguration | None  # Rotations and steps of the rod; None without pose
    pose: Motion | None  # From the proximal body to the distal one; None where it is not computed
    # Twist (angular, linear) of the distal body, in its own frame, per unit of mode; None without
    # pose
    twist: Float[Array, "w modes"] | None
    # Internal moments and forces of each interval, in the rod's frame
    resultants: Float[Array, "intervals w"]
    strain: Float[Array, "intervals w"]  # Strain of each interval beyond that of the free tube
    memory: Any  # Memory of the material at every node, after these strains
    # Change of the moment about y with the curvature at every node, where the law provides it
    # (`SectionResponse.slope`)
    slope: Float[Array, " nodes"] | None
    # Generalised internal force of each mode, N mm per unit of mode
    internal: Modes
    # Bending of the whole rod about x and y of its frame, of a plane about y, rad
    bend: Float[Array, " axes"]
    # Rotation, in the proximal body's frame, by which the chord from the rod's start to its end has
    # turned in the plane of bending; None where it is not computed
    chord_turn: Float[Array, "d d"] | None
    chord_angle: Float[Array, ""] | None  # Its angle, rad; None likewise


def fibre_stretch(across: Float[Array, "*shape 2"]) -> Float[Array, "*shape 6"]:
    """Return the weights of the strains that give the length of a fibre per length of the rod."""
    # The length of a fibre at (x, y) from the neutral axis is the rod's stretch plus its curvatures
    # times their lever arms, v_z + u_x y - u_y x. This holds for the concentric wall arc of
    # Pacheco's tendon (its l = h - theta (r_i + ybar)) and for the edge of a notch.
    x, y = across[..., 0], across[..., 1]
    none = xp.zeros_like(x)
    return xp.stack([y, -x, none, none, none, none + 1.0], axis=-1)


def of_rod(rod: Rod, values: Float[Array, "*shape 6"]) -> Float[Array, "*shape w"]:
    """Select the components (last axis) that a rod of space or of a plane has."""
    return values if rod.basis.shape[-2] == 6 else values[..., PLANE]


def in_space(values: Float[Array, "*shape w"]) -> Float[Array, "*shape 6"]:
    """Expand components (last axis) of a plane to all six of space."""
    return values if values.shape[-1] == 6 else values @ xp.eye(6)[PLANE]


def fibre_slope(rod: Rod, weights: Float[Array, "t w"]) -> Float[Array, "t modes"]:
    """Compute the change of the length of fibres, from their weights, per unit of mode."""
    return weights @ jnp.einsum("icm,i->cm", rod.basis, rod.length)


def flexure_state(
    rod: Rod,
    law: SectionLaw,
    memory: Any,
    modes: Modes,
    response: SectionResponse | None = None,
    *,
    with_pose: bool,
) -> FlexureState:
    """Compute the state of a flexure from its modes."""
    configuration, pose, twist = None, None, None
    if with_pose:
        configuration = integrate_rod(rod, modes)
        pose = relative_pose(rod, modes, configuration)
        twist = twist_slope(rod, modes, configuration)
    elastic = rod.basis @ modes
    if response is None:
        response = law.respond_all(in_space(elastic), rod.section, memory)
    resultants = of_rod(rod, response.resultants)
    # Padding modes have a stiffness of 1.
    internal = jnp.einsum("i,ic,icm->m", rod.length, resultants, rod.basis)
    has_chord = with_pose and rod.chord is not None
    chord_turn, chord_angle = chord(rod, modes) if has_chord else (None, None)
    axes = min(angular(elastic[0]), 2)
    bending = jnp.einsum("i,icm->cm", rod.length, rod.basis[:, :axes])
    return FlexureState(
        configuration=configuration,
        pose=pose,
        twist=twist,
        resultants=resultants,
        strain=elastic,
        memory=response.memory,
        slope=response.slope,
        internal=internal + rod.padding_mask * modes,
        # About x and y of the section's frame; the third axis of space is that of torsion.
        bend=rod.length @ rod.reference_strain[:, :axes] + bending @ modes,
        chord_turn=chord_turn,
        chord_angle=chord_angle,
    )


def material_tangent(
    rod: Rod, law: SectionLaw, memory: Any, state: FlexureState
) -> Float[Array, "modes modes"]:
    """Differentiate the internal forces of the modes (`internal`) by the modes."""

    def resultant_slope(
        strain: Array, section: Any, past: Any, slope: Array | None, columns: Array
    ) -> Array:
        if slope is not None:
            strains = in_space(columns.T)
            elastic = law.elastic(strains.T, jax.tree.map(lambda leaf: leaf[..., None], section))
            return of_rod(rod, jnp.where(xp.arange(6) == 1, slope * strains, elastic)).T

        def resultants(varied: Array) -> Array:
            return of_rod(rod, law.respond(in_space(varied), section, past).resultants)

        return jax.vmap(
            lambda column: jax.jvp(resultants, (strain,), (column,))[1], in_axes=1, out_axes=1
        )(columns)

    slopes = jax.vmap(resultant_slope)(state.strain, rod.section, memory, state.slope, rod.basis)
    weighted = rod.length[:, None, None] * rod.basis
    return jnp.einsum("icm,ick->mk", weighted, slopes) + jnp.diag(rod.padding_mask)


def chord(rod: Rod, modes: Modes) -> tuple[Float[Array, "d d"], Float[Array, ""]]:
    """Compute the rotation of the chord of a rod in its plane of bending (Liu 2022, eq. 19)."""
    # The chord is the straight line from the rod's start to its end; for a strip this is the angle
    # that the paper calls bending angle, about two thirds of the slope at the end.
    end, free = rod_end(rod, modes).translation, rod.curve_offset
    about_y = xp.eye(3)[1] if len(end) == 3 else xp.ones(1)
    angle = jnp.atan2(end[0] * free[-1] - end[-1] * free[0], end[0] * free[0] + end[-1] * free[-1])
    turn = rotation_about(angle * about_y)
    return rod.start_rotation @ turn @ rod.start_rotation.T, angle
