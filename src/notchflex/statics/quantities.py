"""From a solved state to what a person wants to know of it."""

from __future__ import annotations

from typing import NamedTuple

from jaxtyping import Array, Bool, Float, Int

from notchflex._jax import jax, jnp
from notchflex.chain import Chain
from notchflex.flexure import FlexureState, relative_pose
from notchflex.motion import Motion, identity, wrenches_at
from notchflex.statics.applied import Applied, body_wrench
from notchflex.statics.element import Unknowns, at_bound
from notchflex.statics.moments import moment_error
from notchflex.statics.newton import Point
from notchflex.statics.stepping import Solved
from notchflex.statics.walk import Evaluation, evaluate, per_tendon
from notchflex.tendon import Crossing


class Quantities(NamedTuple):
    """One state, or with a leading axis many. Units mm, N, N mm, rad; t tendons, n flexures.

    Spans of a tendon are in the order proximal, gap 1, body 1, gap 2, ... of the gaps and bodies
    that it runs through, contacts in the order of the edges between them; NaN beyond its end.
    """

    tension: Float[Array, "*s t"]
    stroke: Float[Array, "*s t"]
    notch_angle: Float[Array, "*s n"]
    chord_angle: Float[Array, "*s n"]
    body_position: Float[Array, "*s bodies 3"]
    body_rotation: Float[Array, "*s bodies 3 3"]
    tip_position: Float[Array, "*s 3"]
    span_tension: Float[Array, "*s t spans"]
    notch_moment: Float[Array, "*s n"]
    outer_strain: Float[Array, "*s n"]
    peak_strain: Float[Array, "*s n"]
    gap: Float[Array, "*s n"]
    contact_force: Float[Array, "*s n"]
    contact_log_ratio: Float[Array, "*s t contacts"]
    contact_slid: Float[Array, "*s t contacts"]
    contact_bound: Float[Array, "*s t contacts"]
    contact_turning: Float[Array, "*s t contacts"]
    contact_state: Int[Array, "*s t contacts"]
    friction_holds: Bool[Array, "*s"]
    base_force: Float[Array, "*s 3"]
    base_moment: Float[Array, "*s 3"]
    moment_error: Float[Array, "*s"]
    stored_energy: Float[Array, "*s"]


def quantities(chain: Chain, solved: Solved) -> Quantities:
    """Everything that is reported of a solved state, in the frame of the base.

    Slid lengths, stroke and energy use the robot file's axial stiffness of the tendon; the
    finite one of the memory only decides what sticks.
    """
    point = solved.point
    at = evaluate(chain, point.unknowns, solved.memory, point.base_tension, solved.applied)
    flexure, crossings = at.flexure, at.result.crossings
    relative = flexure.pose  # None where the balance did not ask for it
    if relative is None:
        relative = jax.vmap(relative_pose)(chain.rods, point.unknowns.modes)
    bodies = body_poses(relative)
    last = jax.tree.map(lambda leaf: leaf[-1], bodies)
    gap_tension, body_tension = _edges(chain, crossings, "gap_tension", "body_tension")
    visited = per_tendon(chain, tuple(group.visits for group in chain.groups)) > 0.0
    turning = tuple(
        jnp.where(visited, angle, 0.0)
        for angle in _edges(chain, crossings, "exit_turning", "entry_turning")
    )
    body_length = per_tendon(chain, tuple(group.body_length for group in chain.groups))
    compliance = jnp.broadcast_to(1.0 / chain.axial_stiffness, gap_tension.shape)
    drawn = per_tendon(chain, at.beyond.drawn)
    stretch = per_tendon(chain, at.beyond.stretch)
    at_entry = drawn + (stretch + body_tension * body_length) * compliance
    at_exit = (
        per_tendon(chain, at.result.behind.drawn)
        + per_tendon(chain, at.result.behind.stretch) * compliance
    )
    log_ratio, bound = (
        [per_tendon(chain, tuple(leaf[..., edge] for leaf in grouped)) for edge in (0, 1)]
        for grouped in (point.unknowns.log_ratio, at.result.bound)
    )
    contact = along_contacts(chain, log_ratio[0], log_ratio[1])
    limit = along_contacts(chain, bound[0], bound[1])
    spans = _along(chain, gap_tension, body_tension)[:, :-1]
    curvature = flexure.strain[..., 1]
    section = chain.rods.section
    farthest = jnp.maximum(section.edge_spine, section.edge_near)
    contact_force, gap = notch_lips(chain, point.unknowns, at)
    base = base_wrench(chain, point.base_tension, at, solved.applied)
    return Quantities(
        tension=point.base_tension,
        stroke=solved.stroke,
        notch_angle=notch_angles(bodies, chain),
        chord_angle=_chords(chain, flexure),
        body_position=bodies.translation,
        body_rotation=bodies.rotation,
        tip_position=last.point(jnp.array([0.0, 0.0, 1.0]) * chain.body_length[-1]),
        span_tension=jnp.concatenate([point.base_tension[:, None], spans], axis=1),
        notch_moment=largest_moment(flexure),
        outer_strain=jnp.max(curvature * section.edge_spine, axis=-1),
        peak_strain=jnp.max(jnp.abs(curvature) * farthest, axis=-1),
        gap=gap,
        contact_force=contact_force,
        contact_log_ratio=contact,
        contact_slid=along_contacts(chain, at_exit, at_entry),
        contact_bound=limit,
        contact_turning=along_contacts(chain, turning[0], turning[1]),
        contact_state=at_bound(contact, limit),
        friction_holds=jnp.all(chain.friction.valid(turning[0], turning[1])),
        base_force=base[3:],
        base_moment=base[:3],
        moment_error=moment_error(chain, point.unknowns, at),
        stored_energy=_stored_energy(chain, point, at, gap_tension, body_tension),
    )


def notch_lips(
    chain: Chain, unknowns: Unknowns, at: Evaluation
) -> tuple[Float[Array, " n"], Float[Array, " n"]]:
    """Contact force and what is left of the narrowest opening of every notch (N, mm)."""
    force = jnp.zeros(chain.flexures)
    gap = jnp.full(chain.flexures, jnp.inf)
    for group, own, left in zip(chain.lips, unknowns.lip_force, at.result.gap, strict=True):
        force = force + jnp.sum(own * group.closes, axis=-1)
        gap = jnp.minimum(gap, jnp.min(jnp.where(group.closes > 0.0, left, jnp.inf), axis=-1))
    return force, jnp.where(jnp.isinf(gap), jnp.nan, gap)


def largest_moment(flexure: FlexureState) -> Float[Array, " n"]:
    """Bending moment in the plane of each notch, the largest along it, with its sign."""
    moment = flexure.resultants[..., 1]
    where = jnp.argmax(jnp.abs(moment), axis=-1)
    return jnp.take_along_axis(moment, where[:, None], axis=-1)[:, 0]


def base_wrench(
    chain: Chain, base_tension: Float[Array, " t"], at: Evaluation, applied: Applied | None
) -> Float[Array, " 6"]:
    """What the holder does to the tube: moment about the base's origin, and force.

    It balances the loads, and the drives' pull on the tendons where they enter the base.
    """
    acting = jnp.zeros(6) if at.base.wrench is None else at.base.wrench
    for handed_back in (*at.base.reaction, *at.base.pressed):
        if not isinstance(handed_back, tuple):
            acting = acting + jnp.sum(handed_back, axis=0)
    if applied is not None:
        on_base = jax.tree.map(lambda leaf: leaf[0], applied)
        acting = acting + body_wrench(jnp.eye(3), on_base)
    # What the drives pull on the tendons with.
    pulled = base_tension[:, None] * jnp.array([[0.0, 0.0, -1.0]])
    return -acting - jnp.sum(wrenches_at(chain.tendon_place, pulled), axis=0)


def notch_angles(bodies: Motion, chain: Chain) -> Float[Array, " n"]:
    """Rotation of every body against the one before, about the axis of bending of its notch.

    The axis is y of the notch's frame, turned by the notch's direction about the tube; angles of
    up to half a turn are told apart.
    """
    relative = jnp.einsum("nba,nbc->nac", bodies.rotation[:-1], bodies.rotation[1:])
    frame = chain.notch_frame
    turned = jnp.einsum("nba,nbc,ncd->nad", frame, relative, frame)
    return jnp.atan2(turned[:, 0, 2] - turned[:, 2, 0], turned[:, 0, 0] + turned[:, 2, 2])


def _chords(chain: Chain, flexure: FlexureState) -> Float[Array, " n"]:
    """Angle of the chords; NaN where a flexure has none."""
    if flexure.chord_angle is None or chain.rods.chord is None:
        return jnp.full(chain.flexures, jnp.nan)
    return jnp.where(chain.rods.chord > 0.0, flexure.chord_angle, jnp.nan)


def _stored_energy(
    chain: Chain,
    point: Point,
    at: Evaluation,
    gap_tension: Float[Array, "n t"],
    body_tension: Float[Array, "n t"],
) -> Float[Array, ""]:
    """Energy of the flexures and of stretched tendons, N mm."""
    flexure = at.flexure
    density = jax.vmap(jax.vmap(chain.law.energy))(flexure.strain, chain.rods.section, chain.memory)
    natural_gap = per_tendon(chain, tuple(group.natural_gap for group in chain.groups))
    body_length = per_tendon(chain, tuple(group.body_length for group in chain.groups))
    visits = per_tendon(chain, tuple(group.visits for group in chain.groups))
    compliance = jnp.broadcast_to(1.0 / chain.axial_stiffness, gap_tension.shape)
    in_tendons = gap_tension**2 * natural_gap + body_tension**2 * body_length
    return (
        jnp.sum(chain.rods.length * density)
        + 0.5 * jnp.sum(in_tendons * visits * compliance)
        + 0.5 * jnp.sum(point.base_tension**2 * chain.free_length / chain.axial_stiffness)
    )


def _edges(
    chain: Chain, crossings: tuple[Crossing, ...], at_exit: str, at_entry: str
) -> tuple[Float[Array, "n t"], Float[Array, "n t"]]:
    """Values of every tendon at the two edges of every gap."""
    first, second = (
        per_tendon(chain, tuple(getattr(crossing, name) for crossing in crossings))
        for name in (at_exit, at_entry)
    )
    return first, second


def _along(
    chain: Chain, exit_value: Float[Array, "n t"], entry_value: Float[Array, "n t"]
) -> Float[Array, "t edges"]:
    """Values at the edges that each tendon meets, base to tip; NaN beyond its end."""
    pairs = jnp.stack([exit_value, entry_value], axis=1)
    flat = pairs.reshape(-1, pairs.shape[-1]).T
    met = jnp.take_along_axis(flat, jnp.maximum(chain.contacts, 0), axis=1)
    beyond = jnp.roll(chain.contacts, -1, axis=1).at[:, -1].set(-1)
    # The last edge, where the tendon enters its end body, is no contact: it is fixed there.
    return jnp.where(beyond >= 0, met, jnp.nan)


def along_contacts(
    chain: Chain, exit_value: Float[Array, "n t"], entry_value: Float[Array, "n t"]
) -> Float[Array, "t contacts"]:
    """Values at the contacts of each tendon, base to tip; NaN beyond its end."""
    return _along(chain, exit_value, entry_value)[:, :-1]


def body_poses(relative: Motion) -> Motion:
    """Poses of bodies 0 to n in the frame of the base, from the poses between neighbours."""

    def outward(pose: Motion, step: Motion) -> tuple[Motion, Motion]:
        following = pose.then(step)
        return following, following

    start = identity()
    _, poses = jax.lax.scan(outward, start, relative)
    return jax.tree.map(lambda first, rest: jnp.concatenate([first[None], rest]), start, poses)
