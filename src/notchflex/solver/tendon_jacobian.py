"""How bodies, tendons and openings answer what changes at every flexure, as rows of the step."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, NamedTuple, cast

from jaxtyping import Array, Float

from notchflex._jax import jax, jnp
from notchflex.mechanics.chain import Chain
from notchflex.mechanics.contact import ContactGroup
from notchflex.mechanics.flexure import flexure_state
from notchflex.mechanics.flexure.rod import Rod
from notchflex.mechanics.motion import Motion, angular, skew, turned
from notchflex.mechanics.tendon import TendonGroup
from notchflex.solver.element import Unknowns
from notchflex.solver.residual import Evaluation, select_anchors
from notchflex.solver.row_layout import UnitRows


class Moves(NamedTuple):
    """How bodies move: rows at every flexure.

    Attributes:
        relative: Motion of the distal body relative to each of those before, in its own frame;
            short rows.
        turn: Turn of the distal body against the base; nothing where no load asks for it.
    """

    relative: list[Float[Array, "n w short"]]
    turn: Float[Array, "n a z"] | None


class TendonJacobian(NamedTuple):
    """A group of tendons: rows at every flexure.

    Attributes:
        turning: Of the turning angles at both edges; short rows.
        wrench: Of the wrench on the distal body per tension, short rows; None where it does not
            act on bodies.
        log_ratio: Of its log ratios.
        gap_tension: Of the tension in the gap.
        carried: Of the tension handed on.
        at_edges: Of the tendon slid over both edges, by the memory's stiffness.
        released_length: Of the tendon set free, this gap included; stretched by its stiffness
            where no stroke is demanded.
        stretch: Of tension times length, this gap included; None where no stroke is demanded.
    """

    turning: Float[Array, "n 2 t short"]
    wrench: Float[Array, "n t w short"] | None
    log_ratio: Float[Array, "t 2 z"]
    gap_tension: Float[Array, "n t z"]
    carried: Float[Array, "n t z"]
    at_edges: Float[Array, "n t 2 z"]
    released_length: Float[Array, "n t z"]
    stretch: Float[Array, "n t z"] | None


class ContactJacobian(NamedTuple):
    """A kind of lips: rows at every flexure.

    Attributes:
        gap: Of what is left open; short rows.
        wrench: Of the wrench on the distal body per force, short rows; None where it does not act
            on bodies.
    """

    gap: Float[Array, "n l short"]
    wrench: Float[Array, "n l w short"] | None


def relative_motion_jacobian(chain: Chain, at: Evaluation, unit: UnitRows) -> Moves:
    """How the bodies move."""
    pose, twist = at.flexure.pose, at.flexure.twist
    if pose is None or twist is None:
        return Moves([], None)
    own = unit.of_modes(twist)
    relative = [own]
    inside = jax.vmap(Motion.twist_inside, (0, None))
    for older in unit.motions:
        relative.append(own - inside(pose, older))
    if not len(unit.turn):
        return Moves(relative, None)
    axes = len(unit.turn)
    before = jax.vmap(_turn_inside, (0, None))(pose.rotation, unit.turn)
    return Moves(relative, unit.spread(own[:, :axes]) + before)


def _turn_inside(rotation: Array, axis: Array) -> Array:
    return turned(rotation.T, axis)


def _of_anchors(moves: Moves, back: Array) -> Float[Array, "n t w short"]:
    """Motion relative to the anchor of each tendon or lip."""
    found = moves.relative[0][:, None]
    for number, rows in enumerate(moves.relative[1:], start=2):
        found = jnp.where((back == number)[..., None, None], rows[:, None], found)
    return jnp.broadcast_to(found, (*back.shape, *moves.relative[0].shape[1:]))


def _by_relative(
    chain: Chain, at: Evaluation, group: TendonGroup | ContactGroup, what: Callable[..., Any]
) -> Any:
    """Slopes of a crossing or response by the motion relative to the anchor, as last axis."""
    size = chain.rods.basis.shape[-2]
    anchors = select_anchors(at.anchors, group.back)
    assert anchors is not None  # acts_on_bodies asks for them

    def one(own: Any, rod: Rod, flexure: Any, seen: Motion) -> Any:
        def moved(twist: Array) -> Any:
            axes = angular(twist)
            step = Motion(jnp.eye(3 if axes == 3 else 2) + skew(twist[:axes]), twist[axes:])
            return what(own, rod, flexure, jax.vmap(Motion.then, (0, None))(seen, step))

        return jax.jacfwd(moved)(jnp.zeros(size))

    return jax.vmap(one)(group, chain.rods, at.flexure, anchors)


def _by_modes(chain: Chain, at: Evaluation, group: TendonGroup, modes: Array) -> Any:
    """Slopes of a crossing by the modes of the flexure where the anchor stays, as last axis."""
    with_pose = at.anchors is not None and group.acts_on_bodies
    anchors = select_anchors(at.anchors, group.back) if with_pose else None

    def one(own: Any, rod: Rod, memory: Any, seen: Motion | None, at_modes: Array) -> Any:
        def moved(varied: Array) -> Any:
            state = flexure_state(rod, chain.law, memory, varied, with_pose=with_pose)
            return own.cross(rod, state, seen)

        return jax.jacfwd(moved)(at_modes)

    return jax.vmap(one)(group, chain.rods, chain.memory, anchors, modes)


def tendon_jacobian(
    chain: Chain, k: int, unknowns: Unknowns, at: Evaluation, unit: UnitRows, moves: Moves
) -> TendonJacobian:
    """What the k-th group of tendons does."""
    group, span = chain.groups[k], at.spans[k]
    crossing = span.crossing
    length, turning, wrench = [], [], None
    if group.acts_on_bodies:
        slopes = _by_relative(chain, at, group, type(group).cross)
        move = _of_anchors(moves, group.back)
        length.append(jnp.einsum("ntw,ntwz->ntz", slopes.length, move))
        both = jnp.stack([slopes.exit_turning, slopes.entry_turning], axis=1)
        turning.append(jnp.einsum("nstw,ntwz->nstz", both, move))
        wrench = jnp.einsum("ntvw,ntwz->ntvz", slopes.wrench, move)
    if group.by_modes:
        slopes = _by_modes(chain, at, group, unknowns.modes)
        if crossing.slope is not None:
            length.append(unit.of_modes(crossing.slope))
        both = jnp.stack([slopes.exit_turning, slopes.entry_turning], axis=1)
        turning.append(unit.of_modes(both))
    log_ratio = unit.log_ratio[k].reshape(-1, 2, unit.modes.shape[-1])
    runs = group.runs[..., None]
    tension_ratio = span.tension_ratio[..., None]
    gap_tension = runs * (
        tension_ratio[:, :, 0] * unit.tension[k][None]
        - span.gap_tension[..., None] * log_ratio[None, :, 0]
    )
    body_tension = (
        tension_ratio[:, :, 1] * gap_tension - span.body_tension[..., None] * log_ratio[None, :, 1]
    )
    in_body = body_tension * group.body_length[..., None]
    stiffness = chain.memory_stiffness[jnp.array(group.numbers)][None, :, None]
    here = gap_tension * group.natural_gap[..., None] + in_body
    beyond = unit.released_length[k][None]
    released_length = beyond - runs * unit.spread(cast("Array", sum(length)))
    if unit.stretch is None:
        stretch = None
        at_exit = released_length = released_length + here / stiffness
        at_entry = beyond + in_body / stiffness
    else:
        stretch = unit.stretch[k][None] + here
        at_exit = released_length + stretch / stiffness
        at_entry = beyond + (unit.stretch[k][None] + in_body) / stiffness
    return TendonJacobian(
        turning=cast("Array", sum(turning)),
        wrench=wrench,
        log_ratio=log_ratio,
        gap_tension=gap_tension,
        carried=jnp.where(runs > 0.0, body_tension, unit.tension[k][None]),
        at_edges=jnp.stack([at_exit, at_entry], axis=2),
        released_length=released_length,
        stretch=stretch,
    )


def contact_jacobian(
    chain: Chain, k: int, at: Evaluation, unit: UnitRows, moves: Moves
) -> ContactJacobian:
    """What the k-th kind of lips does."""
    group, contact = chain.contact_pairs[k], at.contacts[k]
    if contact.slope is not None:
        return ContactJacobian(unit.of_modes(contact.slope), None)
    slopes = _by_relative(chain, at, group, type(group).gap_response)
    move = _of_anchors(moves, group.back)
    return ContactJacobian(
        jnp.einsum("nlw,nlwz->nlz", slopes.gap, move),
        jnp.einsum("nlvw,nlwz->nlvz", slopes.wrench, move),
    )
