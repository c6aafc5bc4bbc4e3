"""State of one flexure from its modes: pose by quadrature, its derivatives, resultants, chord.

Relative to the reference curve a rod rotates and steps. The rotation up to each of Gauss's nodes is
an integral of the strains, exactly linear in the modes q in the plane; in space it is integrated
from node to node by the Magnus series (up to its second term: Blanes, Casas, Oteo and Ros 2009,
eq. 42). The end is the sum of all steps, each rotated by the rotation at its node.

First and second derivatives of the pose by the modes are written out: derived by JAX they cost ten
times as much, to run and to compile.
"""

from __future__ import annotations

import operator
from itertools import accumulate
from typing import Any, NamedTuple

import numpy as np
from jaxtyping import Array, Float

from notchflex._arrays import xp
from notchflex._jax import Pytree, jax, jnp
from notchflex.mechanics.flexure.rod import Modes, Rod
from notchflex.mechanics.material import Law
from notchflex.mechanics.motion import (
    PLANE,
    Motion,
    angular,
    cross,
    left_slope,
    left_slope_change,
    moment_of,
    rotation_about,
    unskew,
    wrench_turn,
)


class RodConfiguration(NamedTuple):
    """A rod relative to its curve; "places" are the nodes of the pose and then the end."""

    rotation: Float[Array, "places d d"]  # Rotation at every place
    # Change of that rotation per unit of mode, along the axes of the start
    turn: Float[Array, "places a modes"]
    step: Float[Array, "gauss d"]  # The rotated steps at the nodes
    stepped: Float[Array, "gauss d modes"]  # The rotated steps per unit of mode
    # Rotation vectors from place to place, their slopes by the modes, and the change of rotation by
    # a change of these, along the axes of the start; None in the plane, where rotations commute
    from_place: tuple[Array, Array, Array] | None

    @property
    def end(self) -> Motion:
        """Pose of the end."""
        return Motion(self.rotation[-1], self.step.sum(axis=0))


def integrate_rod(rod: Rod, modes: Modes) -> RodConfiguration:
    """Integrate the rotations and steps of a rod for given modes."""
    hat = xp.append(1.0, modes)
    from_place = None
    if rod.turn_pair is None:
        rotation, turn = rotation_about(rod.turn @ hat), rod.turn[..., 1:]
    else:
        turns, slope = _turns(rod, hat)
        rotation = xp.stack(list(accumulate(rotation_about(turns), operator.matmul)))
        by_turns = rotations_before(rotation) @ left_slope(turns)
        from_place, turn = (turns, slope, by_turns), xp.cumsum(by_turns @ slope, axis=0)
    stepped = (rotation[:-1, ..., None] * rod.step[:, None]).sum(axis=-2)
    return RodConfiguration(rotation, turn, stepped @ hat, stepped[..., 1:], from_place)


def _turns(
    rod: Rod, hat: Float[Array, " hat"]
) -> tuple[Float[Array, "places 3"], Float[Array, "places 3 modes"]]:
    """Compute the rotation vectors from place to place, and their slopes by the modes."""
    parts = xp.concatenate([rod.turn[:1], rod.turn[1:] - rod.turn[:-1]])
    by_pair = _by_pair(rod, hat)
    return (parts + by_pair) @ hat, parts[..., 1:] + 2.0 * by_pair[..., 1:]


def _by_pair(rod: Rod, hat: Float[Array, " hat"]) -> Float[Array, "places 3 hat"]:
    """Compute the second Magnus term from place to place, per unit of (1, modes)."""
    return xp.einsum("kcab,b->kca", rod.turn_pair, hat)


def rotation_error_estimate(rod: Rod, modes: Modes) -> Float[Array, ""]:
    """Estimate the error of the rotation of a rod's end, rad; 0 in the plane."""
    # The Magnus series is truncated after its second term. For curvatures a + b s + c s^2 over a
    # way h from place to place that term is h^3 [b, a] / 12, and the next are h^5 times
    # [b, [b, a]] / 240, [a, [a, [a, b]]] / 720 and [a, [a, c]] / 360. The first two are at most
    # the second term times a twentieth of the change of the rotation over h, or a sixtieth of its
    # square. Without the third, the sum is 0.9 to 7 times the error of gaps and arcs.
    if rod.turn_pair is None:
        return jnp.zeros(())
    hat = jnp.append(1.0, modes)
    turns, _ = _turns(rod, hat)
    second = jnp.linalg.norm(_by_pair(rod, hat) @ hat, axis=-1)
    step = jnp.linalg.norm(turns[1:] - turns[:-1], axis=-1)
    change = jnp.maximum(jnp.pad(step, (1, 0)), jnp.pad(step, (0, 1)))
    return jnp.sum((3.0 * change + jnp.sum(turns**2, axis=-1)) * second) / 60.0


def rotations_before(values: Float[Array, "places 3 3"]) -> Float[Array, "places 3 3"]:
    """Return the rotation at the place before each; the identity before the first."""
    return xp.concatenate([xp.eye(3)[None], values[:-1]])


def _small_motion(rod: Rod, modes: Modes) -> Motion:
    """Compute the end motion of small deflection: displacements proportional to the strains."""
    hat = xp.append(1.0, modes)
    turn, moved = rod.turn[-1] @ hat, rod.step.sum(axis=0) @ hat
    rotation, end = rotation_about(turn), rod.curve_offset
    return Motion(rotation, end + cross(turn, end) + moved - rotation @ end)


def _end_motion(rod: Rod, modes: Modes, state: RodConfiguration) -> Motion:
    """Compute the motion from the end of the reference curve to that of the rod."""
    if rod.linear_kinematics is None:
        return state.end
    is_small = rod.linear_kinematics > 0.0
    pairs = zip(_small_motion(rod, modes), state.end, strict=True)
    return Motion(*(xp.where(is_small, small, large) for small, large in pairs))


def rod_end(rod: Rod, modes: Modes) -> Motion:
    """Return the pose of the rod's last section in the frame of its first."""
    return _end_motion(rod, modes, integrate_rod(rod, modes)).then(
        Motion(rod.curve_rotation, rod.curve_offset)
    )


def tail_pose(rod: Rod) -> Motion:
    """Return the pose of the distal body in the frame of the motion relative to the curve."""
    return Motion(rod.curve_rotation, rod.curve_offset).then(
        Motion(rod.end_rotation, rod.end_offset)
    )


def relative_pose(rod: Rod, modes: Modes, state: RodConfiguration | None = None) -> Motion:
    """Return the pose of the distal body in the proximal frame."""
    end_motion = _end_motion(rod, modes, integrate_rod(rod, modes) if state is None else state)
    return Motion(rod.start_rotation, rod.start_offset).then(end_motion).then(tail_pose(rod))


def twist_slope(rod: Rod, modes: Modes, state: RodConfiguration) -> Float[Array, "w modes"]:
    """Return the twist (angular, linear) of the distal body, in its own frame, per unit of mode."""
    end = state.rotation[-1]
    turn = state.turn[-1] if len(end) == 2 else end.T @ state.turn[-1]
    twist = jnp.concatenate([turn, end.T @ end_displacement(state)])
    if rod.linear_kinematics is not None:
        twist = jnp.where(rod.linear_kinematics > 0.0, small_twist(rod, modes), twist)
    return tail_pose(rod).twist_inside(twist)


def end_displacement(state: RodConfiguration) -> Float[Array, "d modes"]:
    """Return the displacement of the end per unit of mode, along the axes of the start."""
    return jnp.sum(state.stepped + jax.vmap(cross)(state.turn[:-1], state.step[..., None]), axis=0)


def small_twist(rod: Rod, modes: Modes) -> Float[Array, "w modes"]:
    """Return the twist of the end in its frame, per unit of mode, of a small deflection."""
    motion = _small_motion(rod, modes)
    slope: Motion = jax.jacfwd(lambda varied: _small_motion(rod, varied))(modes)
    turned = jnp.einsum("ji,jkm->ikm", motion.rotation, slope.rotation)
    turn = jax.vmap(unskew, in_axes=-1, out_axes=-1)(turned)
    return jnp.concatenate([turn, motion.rotation.T @ slope.translation])


def node_poses(rod: Rod, modes: Modes, state: RodConfiguration | None = None) -> Motion:
    """Return the poses of the sections at the nodes of the strains, in the proximal frame."""
    # Between the nodes of the rotation the Magnus terms are omitted, and polynomials interpolate
    # the steps: accurate enough for error estimates, not for the solution.
    state = integrate_rod(rod, modes) if state is None else state
    start = Motion(rod.start_rotation, rod.start_offset)
    turns = jnp.concatenate([jnp.zeros_like(rod.turn[:1]), rod.turn])
    hat = jnp.append(1.0, modes)
    vectors = (rod.node_turn - turns[rod.node_index]) @ hat
    unturned = jnp.eye(len(state.rotation[0]))[None]
    before = jnp.concatenate([unturned, state.rotation])[rod.node_index]

    def at_node(turned: Array, turn: Array, moved: Array, free: Motion) -> Motion:
        return start.then(Motion(turned @ rotation_about(turn), moved)).then(free)

    free = Motion(rod.node_rotation, rod.node_offset)
    return jax.vmap(at_node)(before, vectors, rod.node_reach @ state.step, free)


# Geometric stiffness: change of the generalised forces of a wrench with the modes.


def geometric_stiffness(
    rod: Rod, modes: Modes, state: RodConfiguration, wrench: Float[Array, " w"]
) -> Float[Array, "modes modes"]:
    """Compute the change of the generalised forces of a wrench with the modes."""
    # It is the derivative of twist_slope^T wrench for a wrench that moves with the body; rows are
    # the modes that it acts on. With F the force and M the moment about the end, along the axes of
    # the start, the generalised force is M . turn + F . (sum of the moved steps).
    axes = state.turn.shape[1]
    end_wrench = tail_pose(rod).wrench(wrench)
    if axes == 3:
        change = _geometric_in_space(rod, state, end_wrench)
    else:
        change = _geometric_in_plane(rod, state, state.rotation[-1] @ end_wrench[axes:])
    if rod.linear_kinematics is not None:
        small = jax.jacfwd(lambda varied: small_twist(rod, varied).T @ end_wrench)(modes)
        change = jnp.where(rod.linear_kinematics > 0.0, small, change)
    return change


def _geometric_in_plane(
    rod: Rod, state: RodConfiguration, force: Float[Array, " 2"]
) -> Float[Array, "modes modes"]:
    """Compute `geometric_stiffness` in the plane, where the moment has no part in it."""
    # The result is a scalar: rotating the force is cheaper than the steps of all modes.
    across = jnp.stack([-force[1], force[0]])
    across = jnp.einsum("gdc,d->gc", state.rotation[:-1], across)
    arms = jnp.einsum("gc,gci->gi", across, rod.step[..., 1:])
    turn = state.turn[:-1, 0]
    # Second-order effect of two rotations on a step along the force, symmetrised.
    along = 0.5 * (state.step @ force)
    mixed = jnp.einsum("gi,gj->ij", arms - along[:, None] * turn, turn)
    leaving = moment_of(end_displacement(state), force[:, None]).T @ state.turn[-1]
    return mixed + mixed.T - leaving


def _geometric_in_space(
    rod: Rod, state: RodConfiguration, end_wrench: Float[Array, " 6"]
) -> Float[Array, "modes modes"]:
    """Compute `geometric_stiffness` in space, where rotations do not commute."""
    # All is seen from the end, with which the wrench moves: to it a mode turns a place back by
    # `left`, and moves a step s by its own change, less left x s. A place rotates all beyond it:
    # its generalised force is its rotation times `beyond`, the moment of the wrench about it.
    assert rod.turn_pair is not None
    assert state.from_place is not None
    turns, slope, by_turns = state.from_place
    end = state.rotation[-1]
    moment, force = end @ end_wrench[:3], end @ end_wrench[3:]
    crossed = jax.vmap(cross, in_axes=(0, None))
    left = state.turn[-1:] - jnp.concatenate([jnp.zeros_like(state.turn[:1]), state.turn])
    shares = jnp.concatenate([crossed(state.step, force), moment[None]])
    beyond = jnp.cumsum(shares[::-1], axis=0)[::-1]
    arms, turned = crossed(state.stepped, force[:, None]), left[1:-1]
    # (left x s) x F = s (left . F) - left (s . F)
    along = jnp.einsum("c,gci->gi", force, turned)
    moved = arms + (state.step @ force)[:, None, None] * turned
    moved = moved - state.step[..., None] * along[:, None]
    moved_beyond = jnp.cumsum(moved[::-1], axis=0)[::-1]
    change = jax.vmap(cross)(left[:-1], beyond[..., None])
    change = change + jnp.pad(moved_beyond, ((0, 1), (0, 0), (0, 0)))
    # The slopes of the rotations change with the modes too: by the slope of the exponential, and by
    # the pairs of the Magnus series.
    change = jnp.einsum("kdc,kdj->kcj", by_turns, change)
    inside = jnp.einsum("kdc,kd->kc", rotations_before(state.rotation), beyond)
    change = change + jax.vmap(left_slope_change)(turns, inside) @ slope
    answers = jnp.einsum("kdc,kd->kc", by_turns, beyond)
    later, sooner = np.tril_indices(turned.shape[-1])
    lower = jnp.einsum("kcp,kcp->p", slope[..., later], change[..., sooner])
    lower = lower - jnp.einsum("kcp,kcp->p", arms[..., later], turned[..., sooner])
    pairs = rod.turn_pair[..., 1 + later, 1 + sooner]
    lower = lower + 2.0 * jnp.einsum("kcp,kc->p", pairs, answers)
    # Two modes in the other order differ by the bracket of the twists that they give the end.
    twist = jnp.concatenate([state.turn[-1], end_displacement(state)])
    change_of_wrench = wrench_turn(jnp.concatenate([moment, force])) @ twist
    upper = lower + jnp.einsum("cp,cp->p", twist[:, sooner], change_of_wrench[:, later])
    index = np.zeros((turned.shape[-1],) * 2, int)
    index[sooner, later] = len(lower) + np.arange(len(lower))
    index[later, sooner] = np.arange(len(lower))
    return jnp.concatenate([lower, upper])[index]


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
    slope: Float[Array, " nodes"]  # Change of the moment about y with the curvature at every node
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
    law: Law,
    memory: Any,
    modes: Modes,
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
    response = law.respond(in_space(elastic), rod.section, memory)
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


def material_tangent(rod: Rod, law: Law, state: FlexureState) -> Float[Array, "modes modes"]:
    """Differentiate the internal forces of the modes (`internal`) by the modes."""

    def resultant_slope(section: Any, slope: Array, columns: Array) -> Array:
        return of_rod(rod, law.tangent(in_space(columns.T), slope, section)).T

    slopes = jax.vmap(resultant_slope)(rod.section, state.slope, rod.basis)
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
