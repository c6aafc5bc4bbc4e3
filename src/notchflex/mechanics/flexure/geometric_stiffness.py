"""Geometric stiffness: how what a wrench does to the modes of a rod changes with the modes."""

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
    """Return how what a wrench on the distal body does to each mode changes with the modes.

    It is the derivative of twist_slope^T wrench, the wrench going along with the body; rows are the
    modes that it acts on. With F the force and M the moment about the end, along the axes of the
    start, the wrench does M . turn + F . (sum of the moved steps) to each mode.
    """
    axes = own.turn.shape[1]
    at_end = tail_pose(rod).wrench(wrench)
    end = own.rotation[-1]
    force = end @ at_end[axes:]
    arms = _arms(rod, own, force)
    turn = own.turn[:-1]
    # Half of what two turns, one after the other, do to a step along the force, both ways round.
    along = 0.5 * (own.step @ force)
    mixed = jnp.einsum("gci,gcj->ij", arms - along[:, None, None] * turn, turn)
    leaving = _moments(end_displacement(own)[None], force)[0].T @ own.turn[-1]
    change = mixed + mixed.T - leaving
    if axes == 3:
        change = change + _order_of_turns(rod, own, at_end)
    if rod.linear_kinematics is not None:
        small = jax.jacfwd(lambda varied: small_twist(rod, varied).T @ at_end)(modes)
        change = jnp.where(rod.linear_kinematics > 0.0, small, change)
    return change


def _arms(rod: Rod, own: RodConfiguration, force: Array) -> Float[Array, "gauss a modes"]:
    """Moments of a force that moves along with each step, per unit of mode, about the start."""
    if len(force) == 3:
        return _moments(own.stepped, force)
    # A number, whichever way the axes are turned: the force is, and not the steps of all modes.
    across = jnp.stack([-force[1], force[0]])
    across = jnp.einsum("gdc,d->gc", own.rotation[:-1], across)
    return jnp.einsum("gc,gci->gi", across, rod.step[..., 1:])[:, None]


def _moments(points: Array, force: Array) -> Float[Array, "places a modes"]:
    """Moments of one force at points (places, d, modes) about the start."""
    if len(force) == 2:
        return points[:, 1:] * force[0] - points[:, :1] * force[1]
    return jnp.cross(points, jnp.broadcast_to(force[:, None], points.shape), axis=1)


def _order_of_turns(
    rod: Rod, own: RodConfiguration, at_end: Float[Array, " 6"]
) -> Float[Array, "modes modes"]:
    """What `geometric_stiffness` has in space alone, where turns do not commute.

    The slopes of the turns change with the modes: from place to place by those before, within each
    step by the slope of the exponential and by the pairs of Magnus's series.
    """
    assert rod.turn_pair is not None
    assert own.from_place is not None
    turns, slope, turning = own.from_place
    end = own.rotation[-1]
    moment, force = end @ at_end[:3], end @ at_end[3:]
    nodes = own.turn[:-1]
    # Each place's share of the wrench, then that of all places from it on.
    shares = jnp.cross(own.step, jnp.broadcast_to(force, own.step.shape))
    shares = jnp.concatenate([shares, moment[None]])
    onward = jnp.cumsum(shares[::-1], axis=0)[::-1]
    turned_before = jnp.concatenate([jnp.zeros_like(own.turn[:1]), own.turn[:-1]])
    lever = jnp.cross(turning, jnp.broadcast_to(onward[..., None], turning.shape), axis=1)
    change = jnp.einsum("kci,kcj->ij", lever, turned_before)
    inside = jnp.einsum("kdc,kd->kc", rotations_before(own.rotation), onward)
    bending = jax.vmap(left_slope_change)(turns, inside)
    change = change + jnp.einsum("kci,kcd,kdj->ij", slope, bending, slope)
    answers = jnp.einsum("kdc,kd->kc", left_slopes(turns), inside)
    change = change + 2.0 * jnp.einsum("kcij,kc->ij", rod.turn_pair[..., 1:, 1:], answers)
    # The first node's wrench is turned by the end, and steps lean out of their turns' plane.
    last = own.turn[-1]
    change = change + jnp.einsum("ci,cj->ij", last, jnp.cross(last, moment[:, None], axis=0))
    by_force = jnp.einsum("gcj,c->gj", nodes, force)
    return change + jnp.einsum("gci,gc,gj->ij", nodes, own.step, by_force)
