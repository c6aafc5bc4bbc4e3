"""From the strains of a rod to its pose: Magnus's series on the group of rigid motions."""

from __future__ import annotations

from functools import reduce

import numpy as np
from jaxtyping import Array, Float

from notchflex._jax import array_module, constant, jax
from notchflex.flexure.rod import Rod
from notchflex.motion import Motion, bracket, exponential, identity, skew


def magnus(twists: Float[Array, "nodes 6"], lengths: Float[Array, " nodes"]) -> Float[Array, " 6"]:
    """Twist whose exponential is the motion along one interval.

    With one node the twist is constant. With Gauss's three nodes the error falls with the sixth
    power of the interval (Blanes, Casas, Oteo and Ros 2009, eq. 253, with the brackets turned
    round because the motion is followed in the moving frame).

    Args:
        twists: Twist at each node.
        lengths: Length that each node stands for.

    Returns:
        The twist times length of the whole interval.
    """
    if twists.shape[0] == 1:
        return lengths[0] * twists[0]
    whole = lengths.sum()
    first = whole * twists[1]
    second = (np.sqrt(15.0) / 3.0) * whole * (twists[2] - twists[0])
    third = (10.0 / 3.0) * whole * (twists[2] - 2.0 * twists[1] + twists[0])
    turned = bracket(second, first)
    inner = second - bracket(2.0 * third + turned, first) / 60.0
    return first + third / 12.0 + bracket(inner, -20.0 * first - third + turned) / 240.0


def followed_motion(rod: Rod, modes: Float[Array, " modes"]) -> Motion:
    """Motion from where the followed curve would end to where the rod ends."""
    twists = rod.followed_reference + rod.followed_basis @ modes
    large = _product(*_by_interval(rod, twists))
    if rod.small is None:
        return large
    small, is_small = _small_motion(rod, rod.length @ twists), rod.small > 0.0
    xp = array_module(modes)
    return jax.tree.map(lambda one, other: xp.where(is_small, other, one), large, small)


def _along(twists: Float[Array, "nodes 6"], lengths: Float[Array, " nodes"]) -> Motion:
    return exponential(magnus(twists, lengths))


def _product(
    twists: Float[Array, "intervals nodes 6"], lengths: Float[Array, "intervals nodes"]
) -> Motion:
    """Motion along all intervals, one after the other."""
    if len(twists) == 1:
        return _along(twists[0], lengths[0])
    if array_module(twists) is np:
        return reduce(Motion.then, map(_along, twists, lengths))

    def onward(pose: Motion, interval: tuple[Array, Array]) -> tuple[Motion, None]:
        return pose.then(_along(*interval)), None

    # A loop, for a program that is compiled in a quarter of the time.
    whole, _ = jax.lax.scan(onward, identity(), (twists, lengths))
    return whole


def _by_interval(
    rod: Rod, twists: Float[Array, "nodes 6"]
) -> tuple[Float[Array, "intervals nodes 6"], Float[Array, "intervals nodes"]]:
    step = rod.nodes_per_interval
    return twists.reshape(-1, step, 6), rod.length.reshape(-1, step)


def _small_motion(rod: Rod, twist: Float[Array, " 6"]) -> Motion:
    """Rotation by the sum of the curvatures; the rod's end is displaced in proportion to them."""
    turned, moved = twist[:3], twist[3:]
    xp = array_module(twist)
    rotation = exponential(xp.concatenate([turned, xp.zeros(3)])).rotation
    end = rod.curve_offset
    return Motion(rotation, end + skew(turned) @ end + moved - rotation @ end)


def rod_end(rod: Rod, modes: Float[Array, " modes"]) -> Motion:
    """Pose of the rod's last section as seen from its first."""
    return followed_motion(rod, modes).then(Motion(rod.curve_rotation, rod.curve_offset))


def relative_pose(rod: Rod, modes: Float[Array, " modes"]) -> Motion:
    """Pose of the distal body as seen from the proximal one."""
    return (
        Motion(rod.start_rotation, rod.start_offset)
        .then(rod_end(rod, modes))
        .then(Motion(rod.end_rotation, rod.end_offset))
    )


def node_poses(rod: Rod, modes: Float[Array, " modes"]) -> Motion:
    """Poses of the sections at the nodes, in the frame of the proximal body, nodes leading.

    Within an interval by the sums of a collocation rule, which is right to a few parts in a
    thousand of what the interval bends: enough to judge a result by, not to compute it.
    """
    twists = rod.followed_reference + rod.followed_basis @ modes
    inside = _UP_TO_NODE[rod.nodes_per_interval]

    def onward(start: Motion, interval: tuple[Array, Array, Motion]) -> tuple[Motion, Motion]:
        own, lengths, curve = interval

        def at_node(parts: Array, free: Motion) -> Motion:
            return start.then(exponential(lengths.sum() * (parts @ own))).then(free)

        return start.then(_along(own, lengths)), jax.vmap(at_node)(inside, curve)

    step = rod.nodes_per_interval
    curve = Motion(rod.node_rotation.reshape(-1, step, 3, 3), rod.node_offset.reshape(-1, step, 3))
    start = Motion(rod.start_rotation, rod.start_offset)
    _, found = jax.lax.scan(onward, start, (*_by_interval(rod, twists), curve))
    return Motion(found.rotation.reshape(-1, 3, 3), found.translation.reshape(-1, 3))


def _up_to_nodes(count: int) -> Float[np.ndarray, "nodes nodes"]:
    """Integrals from 0 to each of Gauss's nodes on (0, 1) of the polynomials through them."""
    points = 0.5 * (1.0 + np.polynomial.legendre.leggauss(count)[0])
    powers = np.arange(1, count + 1)
    integrals = points[:, None] ** powers / powers
    return integrals @ np.linalg.inv(points[:, None] ** (powers - 1))


_UP_TO_NODE = {count: constant(_up_to_nodes(count)) for count in (1, 3)}
