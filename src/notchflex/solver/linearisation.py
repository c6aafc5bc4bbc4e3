"""Every flexure's balance made linear: how its imbalance answers what changes around it.

All changes are written as rows over the numbers that may change at one flexure: its own unknowns,
what is carried on to it from the base side, and what comes back from the tip side. Motions of
bodies are counted relative to the body before, forces along with the body they act on, so that a
robot that only turns as a whole changes nothing. What is carried on are

    the motion of bodies further back, as far as spans reach; the turn of the body against the base,
    where external loads keep their direction; the tensions

and what comes back are

    the wrenches of spans and lips that end beyond; those of the loads, or their moments alone;
    tendon set free and stretched.

Only the geometry of a span, an opening or a rod is differentiated by JAX, on its own.
"""

from __future__ import annotations

from functools import partial
from typing import NamedTuple, cast

from jaxtyping import Array, Float

from notchflex._jax import jax, jnp
from notchflex.loads.applied import Applied, body_wrench
from notchflex.mechanics.chain import Chain
from notchflex.mechanics.flexure import geometric_stiffness, material_tangent
from notchflex.mechanics.motion import Motion, skew, wrench_turn
from notchflex.solver.element import RATE, STICTION, Memory, Unknowns, driven, heights, is_active
from notchflex.solver.layout import Layout, Units
from notchflex.solver.residual import Evaluation, holds, reaches
from notchflex.solver.tendon_jacobian import Moves, Opening, Strand, moves_of, opening_of, strand_of


class Blocks(NamedTuple):
    """Rows of all flexures, each over (own unknowns, carried, from beyond)."""

    residual: Float[Array, "n u z"]
    onward: Float[Array, "n c z"]
    behind: Float[Array, "n b z"]


def blocks(
    chain: Chain,
    unknowns: Unknowns,
    memory: Memory,
    applied: Applied | None,
    at: Evaluation,
    form: Layout,
) -> Blocks:
    """Rows of all flexures.

    Args:
        chain: The chain.
        unknowns: Where it is.
        memory: What its contacts remember.
        applied: Other loads on the bodies.
        at: Its evaluation there.
        form: What the rows are over.
    """
    unit = form.units()
    moves = moves_of(chain, at, unit)
    strands = [strand_of(chain, k, unknowns, at, unit, moves) for k in range(len(chain.groups))]
    openings = [opening_of(chain, k, at, unit, moves) for k in range(len(chain.contact_pairs))]
    elastic = chain.elastic
    if elastic is None:
        elastic = jax.vmap(material_tangent, in_axes=(0, None, 0, 0))(
            chain.rods, chain.law, chain.memory, unknowns.modes
        )
        elastic = _never_singular(chain, elastic)
    behind: list[Array] = []

    def by_modes(rows: Array) -> Array:
        return unit.spread(unit.of_modes(rows))

    if at.wrenches is not None:
        assert at.flexure.configuration is not None
        elastic = elastic - jax.vmap(geometric_stiffness)(
            chain.rods, unknowns.modes, at.flexure.configuration, at.wrenches.whole
        )
        whole, behind = _forces(chain, unknowns, applied, at, unit, moves, strands, openings)
        balance = by_modes(elastic) - jnp.einsum("nwm,nwz->nmz", at.flexure.twist, whole)
    else:
        balance = by_modes(elastic)
    for strand, span in zip(strands, at.spans, strict=True):
        if span.crossing.slope is not None:
            balance = balance + jnp.einsum("ntm,ntz->nmz", span.crossing.slope, strand.gap_tension)
    for group, contact, force in zip(
        chain.contact_pairs, at.contacts, unit.contact_pairs, strict=True
    ):
        if contact.slope is not None:
            closing = group.has_contact[..., None] * contact.slope
            balance = balance - jnp.einsum("nlm,lz->nmz", closing, force)
    height = heights(chain)[:, None, None]
    stiff = chain.contact_stiffness[:, None, None]
    residual = [balance / chain.stiffness[..., None]]
    for group, contact, force, own, opening in zip(
        chain.contact_pairs,
        at.contacts,
        unknowns.contact_force,
        unit.contact_pairs,
        openings,
        strict=True,
    ):
        presses = is_active(chain.contact_stiffness, group.has_contact, force, contact.gap)[
            ..., None
        ]
        closing = unit.spread(opening.gap)
        residual.append(jnp.where(presses, closing / height, own[None] / (stiff * height)))
    residual += [
        _friction(chain, k, unknowns, memory, at, unit, strand) for k, strand in enumerate(strands)
    ]
    onward = [-unit.spread(moves.relative[number]) for number in range(form.older)]
    onward += [] if moves.turn is None else [moves.turn]
    onward += [strand.carried for strand in strands]
    behind += [strand.released_length for strand in strands]
    behind += [strand.stretch for strand in strands if strand.stretch is not None]
    return Blocks(*(_stacked(chain, rows, form) for rows in (residual, onward, behind)))


# A mode that resists by less than this part of its stiffness at rest is taken to resist so much:
# the root of the rounding error, so that neither the change nor what it cancels with is felt.
_LEAST_SLOPE = 1e-8


def _never_singular(chain: Chain, elastic: Float[Array, "n m m"]) -> Float[Array, "n m m"]:
    """Keep a plateau of the material's law from leaving a mode without a pivot.

    Just beyond the strain where plastic hardening begins (exp(b / x) at x = 0) the law is flat to
    the last digit. The modes are eliminated first, so their pivots must not vanish there, though
    friction makes the whole system regular; without friction the step becomes long but finite, and
    the limits of a step apply to it.
    """
    own = jnp.diagonal(elastic, axis1=1, axis2=2)
    least = _LEAST_SLOPE * chain.stiffness
    missing = jnp.where(jnp.abs(own) < least, least, 0.0)
    return elastic + jax.vmap(jnp.diag)(missing)


def _stacked(chain: Chain, rows: list[Array], form: Layout) -> Float[Array, "n k z"]:
    """Rows below each other; the flexures as leading axis, also where all have the same."""
    if not rows:
        return jnp.zeros((chain.flexures, 0, form.unknowns + form.carried + form.beyond))
    return jnp.concatenate(rows, axis=1)


def _forces(
    chain: Chain,
    unknowns: Unknowns,
    applied: Applied | None,
    at: Evaluation,
    unit: Units,
    moves: Moves,
    strands: list[Strand],
    openings: list[Opening],
) -> tuple[Float[Array, "n w z"], list[Array]]:
    """Rows of all that acts on the distal body and beyond, and of what is handed back."""
    wrenches, pose = at.wrenches, at.flexure.pose
    assert wrenches is not None
    assert pose is not None
    ending = jnp.zeros((*wrenches.ending.shape, unit.modes.shape[-1]))
    for group, span, strand in zip(chain.groups, at.spans, strands, strict=True):
        if strand.wrench is not None and span.crossing.wrench is not None:
            along = strand.gap_tension[:, :, None] * span.crossing.wrench[..., None]
            pull = along + unit.spread(span.gap_tension[..., None, None] * strand.wrench)
            ending = ending - jnp.einsum("ntwz,ntk->nkwz", pull, reaches(chain, group.back))
    for group, contact, force, own, opening in zip(
        chain.contact_pairs,
        at.contacts,
        unknowns.contact_force,
        unit.contact_pairs,
        openings,
        strict=True,
    ):
        if opening.wrench is not None and contact.wrench is not None:
            along = own[None, :, None] * contact.wrench[..., None]
            along = along + unit.spread(force[..., None, None] * opening.wrench)
            push = group.has_contact[..., None, None] * along
            ending = ending + jnp.einsum("nlwz,nlk->nkwz", push, reaches(chain, group.back))
    whole = ending[:, 0]
    if unit.handed:
        whole = whole + unit.handed[0][None]
    back = jax.vmap(Motion.wrench)

    def handed_back(rows: Array, wrench: Array) -> Array:
        """Rows of a wrench that goes along with the distal body, seen from the body before."""
        turning = jax.vmap(wrench_turn)(wrench)
        turned = jnp.einsum("nvw,nwz->nvz", turning, moves.relative[0])
        return back(pose, rows + unit.spread(turned))

    behind = []
    for number in range(1, chain.window):
        rows = ending[:, number]
        if number < len(unit.handed):
            rows = rows + unit.handed[number][None]
        beyond = wrenches.ending[:, number] + wrenches.handed[:, number]
        behind.append(handed_back(rows, beyond))
    if applied is not None and moves.turn is not None and at.rotation is not None:
        on_bodies = jax.tree.map(lambda leaf: leaf[1:], applied)
        turns = jax.vmap(_by_turn)(at.rotation, on_bodies)
        total = cast("Array", wrenches.outside)
        own = jnp.einsum("nwa,naz->nwz", turns, moves.turn)
        axes = moves.turn.shape[1]
        if chain.follows:
            outside = unit.outside[None] + own
        else:
            # All forces together keep their direction: they turn against the body.
            against = -jax.vmap(wrench_turn)(total)[:, axes:, :axes]
            forces = jnp.einsum("nwa,naz->nwz", against, moves.turn)
            outside = jnp.concatenate([unit.outside[None] + own[:, :axes], forces], axis=1)
        whole = whole + outside
        back_here = handed_back(outside, total)
        behind.append(back_here if chain.follows else back_here[:, :axes])
    return whole, behind


def _by_turn(rotation: Array, load: Applied) -> Float[Array, "w a"]:
    """Slope of a body's loads by the turn of the body about its own axes."""
    axes = 3 if len(rotation) == 3 else 1

    def at_turn(turn: Array) -> Array:
        return body_wrench(rotation @ (jnp.eye(len(rotation)) + skew(turn)), load)

    return jax.jacfwd(at_turn)(jnp.zeros(axes))


def _friction(
    chain: Chain,
    k: int,
    unknowns: Unknowns,
    memory: Memory,
    at: Evaluation,
    unit: Units,
    strand: Strand,
) -> Float[Array, "n 2t z"]:
    """Rows of the memory law of both edges."""
    group, span, own = chain.groups[k], at.spans[k], unknowns.log_ratio[k]
    crossing, ahead = span.crossing, span.gap_tension / span.tension_ratio[..., 0]
    turning, tension = (crossing.exit_turning, crossing.entry_turning), (ahead, span.gap_tension)
    none, one = jnp.zeros_like(ahead), jnp.ones_like(ahead)

    def slope(turns: tuple[Array, Array], pulls: tuple[Array, Array]) -> Array:
        """Change of the limits with turning angles and tensions, where contacts can slide."""
        limits = partial(chain.friction.limits, log_ratio=own)
        return holds(group) * jax.jvp(limits, (*turning, tension), (*turns, pulls))[1]

    # Edges, then the turning angles that they depend on.
    by_turning = jnp.stack([slope(way, (none, none)) for way in ((one, none), (none, one))], -1)
    limit = unit.spread(jnp.einsum("ntes,nstz->ntez", by_turning, strand.turning))
    if chain.friction.constant_loss(*turning) is not None:
        before = jnp.broadcast_to(unit.tension[k][None], strand.gap_tension.shape)
        rows = jnp.stack([before, strand.gap_tension], axis=2)
        limit = limit + slope((none, none), (one, one))[..., None] * rows
    height = heights(chain)[:, None, None, None]
    stuck = -RATE * (strand.at_edges / height - strand.log_ratio[None] / STICTION)
    value, bound = driven(chain, own, span.slid, memory, k), span.bound
    upper, lower = (value >= bound)[..., None], (value <= -bound)[..., None]
    slides = strand.log_ratio[None] - jnp.where(upper, limit, -limit)
    rows = jnp.where(upper | lower, slides, stuck)
    return rows.reshape(chain.flexures, -1, rows.shape[-1])
