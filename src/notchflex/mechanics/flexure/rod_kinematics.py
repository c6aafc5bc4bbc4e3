"""From the strains of a rod to its pose, and how the pose answers the strains.

Beside the followed curve a rod turns and steps. The turn up to each of Gauss's nodes is an integral
of the strains, so it is linear in the modes q, exactly in the plane; in space, where the order of
turns matters, it goes from node to node by Magnus's series (second term included: Blanes, Casas,
Oteo and Ros 2009, eq. 42). The end is the sum of all steps, each turned by where its node is.

Whatever is asked of the pose is asked of these turns and steps: its slope by the modes, and the
slope of that, are written out. (Differentiated by JAX they cost ten times as much, to run and to
compile.)
"""

from __future__ import annotations

from itertools import accumulate
from typing import NamedTuple

import numpy as np
from jaxtyping import Array, Float

from notchflex._jax import array_module, constant, jax, jnp
from notchflex.mechanics.flexure.rod import Rod
from notchflex.mechanics.motion import (
    Motion,
    cross,
    left_slope,
    rotation_about,
    sine_cosine,
    unskew,
)


class RodConfiguration(NamedTuple):
    """A rod beside its curve; places are the nodes of the pose and then the end.

    Attributes:
        rotation: Rotation at every place.
        turn: Turn at every place per unit of mode, along the axes of the start.
        step: The turned steps at the nodes.
        stepped: The turned steps per unit of mode.
        from_place: Rotation vectors from place to place, their slopes by the modes, and what these
            make of the turn, along the axes of the start; None in the plane, where turns add up.
    """

    rotation: Float[Array, "places d d"]
    turn: Float[Array, "places a modes"]
    step: Float[Array, "gauss d"]
    stepped: Float[Array, "gauss d modes"]
    from_place: tuple[Array, Array, Array] | None

    @property
    def end(self) -> Motion:
        """Pose of the end."""
        return Motion(self.rotation[-1], self.step.sum(axis=0))


def integrate_rod(rod: Rod, modes: Float[Array, " modes"]) -> RodConfiguration:
    """Return the turns and steps of a rod under given modes."""
    xp = array_module(modes)
    hat = xp.concatenate([np.ones(1), modes])
    from_place = None
    if rod.turn_pair is None:
        rotation, turn = _in_plane(rod.turn[:, 0] @ hat), rod.turn[..., 1:]
    else:
        turns, slope = _turns(rod, hat)
        rotation = _products(_about(turns))
        turning = rotations_before(rotation) @ left_slopes(turns) @ slope
        from_place, turn = (turns, slope, turning), xp.cumsum(turning, axis=0)
    stepped = _stepped(rod, rotation)
    return RodConfiguration(rotation, turn, stepped @ hat, stepped[..., 1:], from_place)


def free_pose(rod: Rod) -> Motion:
    """Return the pose of the distal body from the proximal one, of a free rod in space.

    The same as `relative_pose` without modes, and without what only its slopes need.
    """
    assert rod.turn_pair is not None
    turns = np.diff(rod.turn[..., 0], axis=0, prepend=0.0) + rod.turn_pair[..., 0, 0]
    rotation = _products(_about(constant(turns)))
    end = Motion(rotation[-1], _stepped(rod, rotation)[..., 0].sum(axis=0))
    return Motion(rod.start_rotation, rod.start_offset).then(end).then(tail_pose(rod))


def _stepped(rod: Rod, rotation: Float[Array, "places d d"]) -> Float[Array, "gauss d hat"]:
    """Steps at the nodes, turned, for (1, q)."""
    return (rotation[:-1, ..., None] * rod.step[:, None]).sum(axis=-2)


def _in_plane(angle: Float[Array, " places"]) -> Float[Array, "places 2 2"]:
    xp = array_module(angle)
    sine, cosine = sine_cosine(angle)
    return xp.stack([xp.stack([cosine, sine], -1), xp.stack([-sine, cosine], -1)], -2)


def _turns(
    rod: Rod, hat: Float[Array, " hat"]
) -> tuple[Float[Array, "places 3"], Float[Array, "places 3 modes"]]:
    """Rotation vectors from place to place, and their slopes by the modes."""
    xp = array_module(hat)
    parts = xp.concatenate([rod.turn[:1], rod.turn[1:] - rod.turn[:-1]])
    by_pair = _by_pair(rod, hat)
    return (parts + by_pair) @ hat, parts[..., 1:] + 2.0 * by_pair[..., 1:]


def _by_pair(rod: Rod, hat: Float[Array, " hat"]) -> Float[Array, "places 3 hat"]:
    """What the order of turns adds from place to place, per unit of (1, modes)."""
    return array_module(hat).einsum("kcab,b->kca", rod.turn_pair, hat)


def turn_doubt(rod: Rod, modes: Float[Array, " modes"]) -> Float[Array, ""]:
    """About how far the end of a rod may be turned otherwise than computed, rad; 0 in the plane.

    Magnus's series is cut off behind its second term. What comes next is of the size of the turns
    from place to place times their second terms, of whose sum a twentieth was missing where a notch
    was bent by 105 degrees, twisted and sideways (against more places).
    """
    if rod.turn_pair is None:
        return jnp.zeros(())
    hat = jnp.concatenate([jnp.ones(1), modes])
    turns, _ = _turns(rod, hat)
    second = _by_pair(rod, hat) @ hat
    return 0.05 * jnp.sum(jnp.linalg.norm(turns, axis=-1) * jnp.linalg.norm(second, axis=-1))


def _about(turns: Float[Array, "places 3"]) -> Float[Array, "places 3 3"]:
    if array_module(turns) is np:
        return rotation_about(turns)
    return jax.vmap(rotation_about)(turns)


def left_slopes(turns: Float[Array, "places 3"]) -> Float[Array, "places 3 3"]:
    """Return the slopes of the exponential by turns, seen from before each."""
    if array_module(turns) is np:
        return left_slope(turns)
    return jax.vmap(left_slope)(turns)


def _products(parts: Float[Array, "places 3 3"]) -> Float[Array, "places 3 3"]:
    """Products of all rotations up to each."""
    xp = array_module(parts)
    return xp.stack(list(accumulate(parts, xp.matmul)))


def rotations_before(values: Float[Array, "places 3 3"]) -> Float[Array, "places 3 3"]:
    """Return the rotation at the place before each; none before the first."""
    return array_module(values).concatenate([np.eye(3)[None], values[:-1]])


def _small_motion(rod: Rod, modes: Float[Array, " modes"]) -> Motion:
    """Rotation by the sum of the curvatures; the rod's end is displaced in proportion to them."""
    xp = array_module(modes)
    hat = xp.concatenate([np.ones(1), modes])
    turn, moved = rod.turn[-1] @ hat, rod.step.sum(axis=0) @ hat
    rotation, end = rotation_about(turn), rod.curve_offset
    return Motion(rotation, end + cross(turn, end) + moved - rotation @ end)


def _beside(rod: Rod, modes: Float[Array, " modes"], own: RodConfiguration) -> Motion:
    """Motion from where the followed curve would end to where the rod ends."""
    if rod.linear_kinematics is None:
        return own.end
    xp, is_small = array_module(modes), rod.linear_kinematics > 0.0
    pairs = zip(_small_motion(rod, modes), own.end, strict=True)
    return Motion(*(xp.where(is_small, small, large) for small, large in pairs))


def rod_end(rod: Rod, modes: Float[Array, " modes"]) -> Motion:
    """Return the pose of the rod's last section as seen from its first."""
    return _beside(rod, modes, integrate_rod(rod, modes)).then(
        Motion(rod.curve_rotation, rod.curve_offset)
    )


def tail_pose(rod: Rod) -> Motion:
    """Return the distal body as seen from where the motion beside the curve ends."""
    return Motion(rod.curve_rotation, rod.curve_offset).then(
        Motion(rod.end_rotation, rod.end_offset)
    )


def relative_pose(
    rod: Rod, modes: Float[Array, " modes"], own: RodConfiguration | None = None
) -> Motion:
    """Return the pose of the distal body as seen from the proximal one."""
    beside = _beside(rod, modes, integrate_rod(rod, modes) if own is None else own)
    return Motion(rod.start_rotation, rod.start_offset).then(beside).then(tail_pose(rod))


def twist_slope(
    rod: Rod, modes: Float[Array, " modes"], own: RodConfiguration
) -> Float[Array, "w modes"]:
    """Return the twist (angular, linear) of the distal body, in its own frame, per unit of mode."""
    end = own.rotation[-1]
    turn = own.turn[-1] if len(end) == 2 else end.T @ own.turn[-1]
    twist = jnp.concatenate([turn, end.T @ end_displacement(own)])
    if rod.linear_kinematics is not None:
        twist = jnp.where(rod.linear_kinematics > 0.0, small_twist(rod, modes), twist)
    return tail_pose(rod).twist_inside(twist)


def end_displacement(own: RodConfiguration) -> Float[Array, "d modes"]:
    """Return the displacement of the end per unit of mode, along the axes of the start."""
    return jnp.sum(own.stepped + _crossed(own.turn[:-1], own.step[..., None]), axis=0)


def _crossed(turn: Array, vector: Array) -> Array:
    """Cross products of turns (places, a, modes) and vectors (places, d, 1 or modes)."""
    if turn.shape[1] == 1:
        return jnp.concatenate([turn * vector[:, 1:], -turn * vector[:, :1]], axis=1)
    return jnp.cross(turn, jnp.broadcast_to(vector, turn.shape), axis=1)


def small_twist(rod: Rod, modes: Float[Array, " modes"]) -> Float[Array, "w modes"]:
    """Return the twist of the end in its frame, per unit of mode, of a small deflection."""
    motion = _small_motion(rod, modes)
    slope: Motion = jax.jacfwd(lambda varied: _small_motion(rod, varied))(modes)
    turned = jnp.einsum("ji,jkm->ikm", motion.rotation, slope.rotation)
    turn = jax.vmap(unskew, in_axes=-1, out_axes=-1)(turned)
    return jnp.concatenate([turn, motion.rotation.T @ slope.translation])


def node_poses(
    rod: Rod, modes: Float[Array, " modes"], own: RodConfiguration | None = None
) -> Motion:
    """Return poses of the sections at the nodes of the strains, in the frame of the proximal body.

    Between the places of the turn its order is left out, and steps are summed up by the polynomials
    through their nodes: enough to judge a result by, not to compute it.
    """
    own = integrate_rod(rod, modes) if own is None else own
    start = Motion(rod.start_rotation, rod.start_offset)
    turns = jnp.concatenate([jnp.zeros_like(rod.turn[:1]), rod.turn])
    onward = (rod.node_turn - turns[rod.node_place]) @ jnp.concatenate([jnp.ones(1), modes])
    unturned = jnp.eye(len(own.rotation[0]))[None]
    before = jnp.concatenate([unturned, own.rotation])[rod.node_place]

    def at_node(turned: Array, turn: Array, moved: Array, free: Motion) -> Motion:
        return start.then(Motion(turned @ rotation_about(turn), moved)).then(free)

    free = Motion(rod.node_rotation, rod.node_offset)
    return jax.vmap(at_node)(before, onward, rod.node_reach @ own.step, free)
