"""Geometric stiffness: change of the generalised forces of a wrench with the modes."""

from __future__ import annotations

from jaxtyping import Array, Float

from notchflex._jax import jax, jnp
from notchflex.mechanics.flexure.rod import Rod
from notchflex.mechanics.flexure.rod_kinematics import (
    RodConfiguration,
    end_displacement,
    left_slopes,
    rotations_before,
    small_twist,
    tail_pose,
)
from notchflex.mechanics.motion import (
    left_slope_change,
)


def geometric_stiffness(
    rod: Rod, modes: Float[Array, " modes"], own: RodConfiguration, wrench: Float[Array, " w"]
) -> Float[Array, "modes modes"]:
    """Compute the change of the generalised forces of a wrench with the modes.

    It is the derivative of twist_slope^T wrench for a wrench that moves with the body; rows are the
    modes that it acts on. With F the force and M the moment about the end, along the axes of the
    start, the generalised force is M . turn + F . (sum of the moved steps).
    """
    axes = own.turn.shape[1]
    at_end = tail_pose(rod).wrench(wrench)
    end = own.rotation[-1]
    force = end @ at_end[axes:]
    arms = _arms(rod, own, force)
    turn = own.turn[:-1]
    # Second-order effect of two rotations on a step along the force, symmetrised.
    along = 0.5 * (own.step @ force)
    mixed = jnp.einsum("gci,gcj->ij", arms - along[:, None, None] * turn, turn)
    leaving = _moments(end_displacement(own)[None], force)[0].T @ own.turn[-1]
    change = mixed + mixed.T - leaving
    if axes == 3:
        change = change + _noncommuting_terms(rod, own, at_end)
    if rod.linear_kinematics is not None:
        small = jax.jacfwd(lambda varied: small_twist(rod, varied).T @ at_end)(modes)
        change = jnp.where(rod.linear_kinematics > 0.0, small, change)
    return change


def _arms(rod: Rod, own: RodConfiguration, force: Array) -> Float[Array, "gauss a modes"]:
    """Compute the moments of the force through each step, per unit of mode, about the start."""
    if len(force) == 3:
        return _moments(own.stepped, force)
    # The result is a scalar: rotating the force is cheaper than the steps of all modes.
    across = jnp.stack([-force[1], force[0]])
    across = jnp.einsum("gdc,d->gc", own.rotation[:-1], across)
    return jnp.einsum("gc,gci->gi", across, rod.step[..., 1:])[:, None]


def _moments(points: Array, force: Array) -> Float[Array, "places a modes"]:
    """Compute the moments of one force at points (places, d, modes) about the start."""
    if len(force) == 2:
        return points[:, 1:] * force[0] - points[:, :1] * force[1]
    return jnp.cross(points, jnp.broadcast_to(force[:, None], points.shape), axis=1)


def _noncommuting_terms(
    rod: Rod, own: RodConfiguration, at_end: Float[Array, " 6"]
) -> Float[Array, "modes modes"]:
    """Compute the terms of `geometric_stiffness` in space, where rotations do not commute.

    The slopes of the rotations change with the modes: with the rotations before, with the slope of
    the exponential, and with the pairs of the Magnus series.
    """
    assert rod.turn_pair is not None
    assert own.from_place is not None
    turns, slope, turning = own.from_place
    end = own.rotation[-1]
    moment, force = end @ at_end[:3], end @ at_end[3:]
    nodes = own.turn[:-1]
    # Contribution of each point to the wrench, then of all points from it on.
    shares = jnp.cross(own.step, jnp.broadcast_to(force, own.step.shape))
    shares = jnp.concatenate([shares, moment[None]])
    beyond = jnp.cumsum(shares[::-1], axis=0)[::-1]
    turned_before = jnp.concatenate([jnp.zeros_like(own.turn[:1]), own.turn[:-1]])
    lever = jnp.cross(turning, jnp.broadcast_to(beyond[..., None], turning.shape), axis=1)
    change = jnp.einsum("kci,kcj->ij", lever, turned_before)
    inside = jnp.einsum("kdc,kd->kc", rotations_before(own.rotation), beyond)
    bending = jax.vmap(left_slope_change)(turns, inside)
    change = change + jnp.einsum("kci,kcd,kdj->ij", slope, bending, slope)
    answers = jnp.einsum("kdc,kd->kc", left_slopes(turns), inside)
    change = change + 2.0 * jnp.einsum("kcij,kc->ij", rod.turn_pair[..., 1:, 1:], answers)
    # The end rotates the first node's wrench, and steps leave the plane of their rotations.
    last = own.turn[-1]
    change = change + jnp.einsum("ci,cj->ij", last, jnp.cross(last, moment[:, None], axis=0))
    by_force = jnp.einsum("gcj,c->gj", nodes, force)
    return change + jnp.einsum("gci,gc,gj->ij", nodes, own.step, by_force)
