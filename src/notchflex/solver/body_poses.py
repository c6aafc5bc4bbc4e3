"""Poses of bodies: against the base, with the external loads on them, and against those before."""

from __future__ import annotations

from collections.abc import Sequence

from jaxtyping import Array, Float

from notchflex._jax import jax, jnp
from notchflex.loads.command import BodyLoads, body_wrench
from notchflex.mechanics.chain import Chain
from notchflex.mechanics.motion import Motion, identity


def body_poses(relative: Motion) -> Motion:
    """Return the poses of bodies 0 to n in the frame of the base, from those between neighbours.

    A prefix product: first over pairs, then over fours, until all start at the base.
    """
    dimensions = relative.translation.shape[-1]
    poses = jax.tree.map(
        lambda first, rest: jnp.concatenate([first[None], rest]), identity(dimensions), relative
    )
    reach = 1
    while reach < len(poses.translation):
        joined = jax.vmap(Motion.then)(
            jax.tree.map(lambda leaf, reach=reach: leaf[:-reach], poses),
            jax.tree.map(lambda leaf, reach=reach: leaf[reach:], poses),
        )
        poses = jax.tree.map(
            lambda near, far, reach=reach: jnp.concatenate([near[:reach], far]), poses, joined
        )
        poses = jax.lax.optimization_barrier(poses)
        reach *= 2
    return poses


def external_wrenches(
    pose: Motion, applied: BodyLoads | None
) -> tuple[Float[Array, "n d d"] | None, Float[Array, "n w"] | None, Float[Array, " w"] | None]:
    """Return rotations of the bodies, and the loads on each with all beyond and on the whole robot.

    All are None where there are no loads.
    """
    if applied is None:
        return None, None, None
    bodies = body_poses(pose)
    distal: Motion = jax.tree.map(lambda leaf: leaf[1:], bodies)
    wrench = jax.vmap(body_wrench)(distal.rotation, jax.tree.map(lambda leaf: leaf[1:], applied))
    in_base = jax.vmap(Motion.wrench)(distal, wrench)
    summed = jnp.cumsum(in_base[::-1], axis=0)[::-1]
    inside = jax.vmap(Motion.wrench_inside)(distal, summed)
    return distal.rotation, inside, summed[0]


def anchor_poses(chain: Chain, pose: Motion | None) -> Motion | None:
    """Return the pose of every body in the frames of those before it, within the window."""
    if pose is None:
        return None
    poses = [pose]
    before = pose
    for _ in range(chain.window - 1):
        first = identity(pose.translation.shape[-1])
        before: Motion = jax.tree.map(shift_from_base, before, first)
        poses.append(jax.vmap(Motion.then)(before, poses[-1]))
    return jax.tree.map(lambda *leaves: jnp.stack(leaves, axis=1), *poses)


def select_anchors(anchors: Motion | None, back: Array) -> Motion | None:
    """Select the anchor of every tendon or contact among the bodies before."""
    if anchors is None:
        return None

    def of_leaf(leaf: Array) -> Array:
        return select_back([leaf[:, number] for number in range(leaf.shape[1])], back)

    return jax.tree.map(of_leaf, anchors)


def select_back(by_body: Sequence[Array], back: Array) -> Float[Array, "n t *k"]:
    """Select for every tendon or contact the values of its anchor, of those by body before."""
    selected = by_body[0][:, None]
    for number, values in enumerate(by_body[1:], start=2):
        selects = (back == number).reshape(*back.shape, *(1,) * (values.ndim - 1))
        selected = jnp.where(selects, values[:, None], selected)
    return jnp.broadcast_to(selected, (*back.shape, *by_body[0].shape[1:]))


def shift_from_base(values: Array, first: Array) -> Array:
    """Shift values by one flexure: each gets that of the one before, the first gets `first`."""
    return jnp.concatenate([jnp.asarray(first)[None], values[:-1]])
