"""From a solved state to what a person wants to know of it."""

from __future__ import annotations

from typing import NamedTuple

from jaxtyping import Array, Float, Int

from notchflex._jax import jax, jnp
from notchflex.chain import Chain
from notchflex.flexure import relative_pose
from notchflex.motion import Motion, identity
from notchflex.statics.element import at_bound
from notchflex.statics.stepping import Solved
from notchflex.statics.walk import evaluate, per_tendon


class Quantities(NamedTuple):
    """One state, or with a leading axis many. Units mm, N, N mm, rad; t tendons, n flexures.

    Spans of a tendon are in the order proximal, gap 1, body 1, gap 2, ..., gap n, contacts in
    the order of the edges between them; NaN beyond the end body of a tendon.
    """

    tension: Float[Array, "*s t"]
    stroke: Float[Array, "*s t"]
    notch_angle: Float[Array, "*s n"]
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
    contact_state: Int[Array, "*s t contacts"]
    stored_energy: Float[Array, "*s"]


def quantities(chain: Chain, solved: Solved) -> Quantities:
    """Everything that is reported of a solved state, in the frame of the base.

    Slid lengths, stroke and energy use the robot file's axial stiffness of the tendon; the
    finite one of the memory only decides what sticks.
    """
    point = solved.point
    at = evaluate(chain, point.unknowns, solved.memory, point.base_tension)
    flexure, crossings = at.flexure, at.result.crossings
    bodies = body_poses(jax.vmap(relative_pose)(chain.rods, point.unknowns.modes))
    last = jax.tree.map(lambda leaf: leaf[-1], bodies)
    gap_tension = per_tendon(chain, tuple(c.gap_tension for c in crossings))
    body_tension = per_tendon(chain, tuple(c.body_tension for c in crossings))
    absent = per_tendon(chain, tuple(group.visits for group in chain.groups)) == 0.0
    body_length = per_tendon(chain, tuple(group.body_length for group in chain.groups))
    natural_gap = per_tendon(chain, tuple(group.natural_gap for group in chain.groups))
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
    density = jax.vmap(jax.vmap(chain.law.energy))(flexure.strain, chain.rods.section, chain.memory)
    in_tendons = gap_tension**2 * natural_gap + body_tension**2 * body_length
    stored = (
        jnp.sum(chain.rods.length * density)
        + 0.5 * jnp.sum(in_tendons * (1.0 - absent) * compliance)
        + 0.5 * jnp.sum(point.base_tension**2 * chain.free_length / chain.axial_stiffness)
    )
    curvature = flexure.strain[..., 1]
    section = chain.rods.section
    farthest = jnp.maximum(section.edge_spine, section.edge_near)
    contact = _along(log_ratio[0], log_ratio[1], absent)[:, :-1]
    limit = _along(bound[0], bound[1], absent)[:, :-1]
    return Quantities(
        tension=point.base_tension,
        stroke=solved.stroke,
        notch_angle=flexure.bend[:, 1],
        body_position=bodies.translation,
        body_rotation=bodies.rotation,
        tip_position=last.point(jnp.array([0.0, 0.0, 1.0]) * chain.body_length[-1]),
        span_tension=jnp.concatenate(
            [
                point.base_tension[:, None],
                _along(gap_tension, body_tension, absent)[:, :-1],
            ],
            axis=1,
        ),
        notch_moment=jnp.max(jnp.abs(flexure.resultants[..., 1]), axis=-1)
        * jnp.sign(flexure.resultants[:, 0, 1]),
        outer_strain=jnp.max(curvature * section.edge_spine, axis=-1),
        peak_strain=jnp.max(jnp.abs(curvature) * farthest, axis=-1),
        gap=flexure.lip_gap,
        contact_force=point.unknowns.lip_force,
        contact_log_ratio=contact,
        contact_slid=_along(at_exit, at_entry, absent)[:, :-1],
        contact_bound=limit,
        contact_state=at_bound(contact, limit),
        stored_energy=stored,
    )


def _along(
    exit_value: Float[Array, "n t"], entry_value: Float[Array, "n t"], absent: Array
) -> Float[Array, "t twice"]:
    """Values at the two edges of every gap, in order along each tendon; NaN beyond its end."""
    pairs = jnp.stack([exit_value, entry_value], axis=1)
    pairs = jnp.where(absent[:, None, :], jnp.nan, pairs)
    along = pairs.reshape(-1, pairs.shape[-1]).T
    # The entry edge of the end body is no contact, the tendon is fixed there.
    ended = jnp.isnan(jnp.roll(along, -1, axis=1)).at[:, -1].set(True)
    return jnp.where(ended & ~jnp.isnan(along), jnp.nan, along)


def body_poses(relative: Motion) -> Motion:
    """Poses of bodies 0 to n in the frame of the base, from the poses between neighbours."""

    def outward(pose: Motion, step: Motion) -> tuple[Motion, Motion]:
        following = pose.then(step)
        return following, following

    start = identity()
    _, poses = jax.lax.scan(outward, start, relative)
    return jax.tree.map(lambda first, rest: jnp.concatenate([first[None], rest]), start, poses)
