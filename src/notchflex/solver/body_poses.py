"""Poses of all bodies in the frame of the base, and the external loads on them."""

from __future__ import annotations

from jaxtyping import Array, Float

from notchflex._jax import jax, jnp
from notchflex.loads.applied import BodyLoads, body_wrench
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
