"""Residual of the whole chain at given unknowns, all flexures at once.

Wrenches on body j are taken about the origin and along the axes of body j. Only three quantities
are accumulated along the chain: logarithms of tensions from the base, released tendon lengths and
external loads from the tip.
"""

from __future__ import annotations

from typing import NamedTuple

from jaxtyping import Array, Float

from notchflex._jax import jax, jnp
from notchflex.loads.command import BodyLoads
from notchflex.mechanics.chain import Chain, flexure_states
from notchflex.mechanics.contact import GapResponse
from notchflex.mechanics.flexure import FlexureState
from notchflex.mechanics.motion import Motion
from notchflex.mechanics.tendon import Crossing
from notchflex.solver.body_poses import (
    anchor_poses,
    external_wrenches,
    select_anchors,
    shift_from_base,
)
from notchflex.solver.element import (
    Iterate,
    Memory,
    Unknowns,
    clip_symmetric,
    signorini,
    trial_log_ratio,
)
from notchflex.solver.tendon_spans import (
    TendonSpans,
    crossings,
    in_tendon_order,
    of_group,
    slip_mask,
)

_MAX_ROUNDING_GROWTH = 1e4


class BodyWrenches(NamedTuple):
    """Wrenches (moment, force) on the bodies, about and along the frame of body j.

    Attributes:
        terminating: Of the spans and contacts that end at body j, on the bodies j - m and beyond
            together, for m = 0 ... window - 1.
        transmitted: The same of those that end beyond body j.
        external: External loads on body j and beyond; None where there are none.
        resultant: Sum of all on body j and beyond.
    """

    terminating: Float[Array, "n window w"]
    transmitted: Float[Array, "n window w"]
    external: Float[Array, "n w"] | None
    resultant: Float[Array, "n w"]


class BaseReaction(NamedTuple):
    """Tensions and sums over the whole chain, at the base.

    Attributes:
        base_tension: Tension of every tendon, N.
        released_length: Length of every tendon released by the shape, mm.
        tension_length: Sum of tension times length of every tendon, N mm.
        external: External loads on all bodies, about and along the base; None if there are none.
    """

    base_tension: Float[Array, " t"]
    released_length: Float[Array, " t"]
    tension_length: Float[Array, " t"]
    external: Float[Array, " w"] | None


class Evaluation(NamedTuple):
    """The whole chain evaluated, flexures as leading axis.

    Attributes:
        flexure: State of every flexure.
        anchors: Pose of body j in the frames of the bodies j - 1, j - 2 ..., as second axis; None
            where nothing acts on bodies.
        rotation: Rotation of every body against the base; None without external loads.
        spans: For each group of tendons.
        contacts: For each kind of contacts.
        wrenches: On the bodies; None as the anchors.
        base: Sums over the chain, at the base.
        residual: Imbalance, in the form of the unknowns and scaled to be comparable.
    """

    flexure: FlexureState
    anchors: Motion | None
    rotation: Float[Array, "n d d"] | None
    spans: tuple[TendonSpans, ...]
    contacts: tuple[GapResponse, ...]
    wrenches: BodyWrenches | None
    base: BaseReaction
    residual: Unknowns


def evaluate(
    chain: Chain,
    point: Iterate,
    memory: Memory,
    applied: BodyLoads | None,
) -> Evaluation:
    """Evaluate the residual of the chain, with its terms.

    Equilibrium is stated as virtual work with the true work of the tendon, -T times the change of
    its span lengths: normal and friction forces need not be summed.

    Args:
        chain: The chain.
        point: Its unknowns, flexures as leading axis, and base tensions.
        memory: History of its contacts and its material.
        applied: External loads on the bodies; None for a chain assembled for tendons alone.

    Returns:
        The evaluation.
    """
    unknowns, base_tension = point
    on_bodies = chain.forces_on_bodies
    flexure = flexure_states(chain, unknowns.modes, memory.material, with_pose=on_bodies)
    anchors = anchor_poses(chain, flexure.pose)
    spans = tuple(
        _spans(chain, k, crossings(group, chain, flexure, anchors), unknowns, base_tension)
        for k, group in enumerate(chain.groups)
    )
    contacts = tuple(
        _with_contact_compliance(
            chain,
            jax.vmap(type(group).gap_response)(
                group, chain.rods, flexure, select_anchors(anchors, group.back)
            ),
            force,
        )
        for group, force in zip(chain.contact_pairs, unknowns.contact_force, strict=True)
    )
    rotation, wrenches, at_base = None, None, None
    if on_bodies:
        assert flexure.pose is not None
        rotation, external, at_base = external_wrenches(flexure.pose, applied)
        wrenches = _wrenches(chain, flexure.pose, unknowns, spans, contacts, external)
    balance = _balance(chain, unknowns, flexure, spans, contacts, wrenches)
    if memory.damping is not None:
        viscosity, before = memory.damping
        balance = balance + viscosity * chain.stiffness * (unknowns.modes - before)
    contact_force = tuple(
        signorini(chain, group, force, response.gap)
        for group, force, response in zip(
            chain.contact_pairs, unknowns.contact_force, contacts, strict=True
        )
    )
    log_ratio = tuple(
        ratio - clip_symmetric(trial_log_ratio(chain, ratio, span.slid, memory, k), span.bound)
        for k, (ratio, span) in enumerate(zip(unknowns.log_ratio, spans, strict=True))
    )
    residual = Unknowns(balance / chain.stiffness, contact_force, log_ratio)
    base = BaseReaction(
        base_tension,
        in_tendon_order(chain, tuple(span.released_length[0] for span in spans)),
        in_tendon_order(chain, tuple(span.tension_length[0] for span in spans)),
        at_base,
    )
    return Evaluation(flexure, anchors, rotation, spans, contacts, wrenches, base, residual)


def rounding_growth(chain: Chain, point: Iterate) -> Float[Array, ""]:
    """Return the growth of rounding in the residual: with the moments that tensions balance."""
    height = jnp.max(jnp.sum(chain.rods.length, axis=-1))
    softest = jnp.min(jnp.where(chain.rods.padding_mask > 0.0, jnp.inf, chain.stiffness))
    largest_tension = jnp.max(jnp.maximum(point.base_tension, 0.0), initial=0.0)
    return jnp.minimum(1.0 + largest_tension * (height / softest), _MAX_ROUNDING_GROWTH)


def _with_contact_compliance(
    chain: Chain, response: GapResponse, force: Float[Array, "n l"]
) -> GapResponse:
    """Add the closing by the contact force to the gaps."""
    if chain.contact_flexibility is None:
        return response
    return response._replace(gap=response.gap + chain.contact_flexibility[:, None] * force)


def _balance(
    chain: Chain,
    unknowns: Unknowns,
    flexure: FlexureState,
    spans: tuple[TendonSpans, ...],
    contacts: tuple[GapResponse, ...],
    wrenches: BodyWrenches | None,
) -> Float[Array, "n modes"]:
    """Compute the virtual work of every strain mode, N mm."""
    balance = flexure.internal
    if chain.elastic is not None:
        balance = jnp.einsum("nmk,nk->nm", chain.elastic, unknowns.modes)
    for span in spans:
        if span.crossing.slope is not None:
            balance = balance + jnp.einsum("nt,ntm->nm", span.gap_tension, span.crossing.slope)
    for group, response, force in zip(
        chain.contact_pairs, contacts, unknowns.contact_force, strict=True
    ):
        if response.slope is not None:
            balance = balance - jnp.einsum("nl,nlm->nm", force * group.has_contact, response.slope)
    if wrenches is not None:
        balance = balance - jnp.einsum("nwm,nw->nm", flexure.twist, wrenches.resultant)
    return balance


def _spans(
    chain: Chain,
    k: int,
    crossing: Crossing,
    unknowns: Unknowns,
    base_tension: Float[Array, " t"],
) -> TendonSpans:
    """Compute tensions, released lengths and friction bounds of the k-th group."""
    group, log_ratio = chain.groups[k], unknowns.log_ratio[k]
    runs = group.runs
    # Not written with ln T, so that a slack tendon stays regular.
    turning = crossing.exit_turning, crossing.entry_turning
    offset = chain.friction.offset()
    at_base = of_group(base_tension, group)[None] + offset
    tension_ratio = jnp.exp(-runs[..., None] * log_ratio)
    beyond_both = at_base * jnp.cumprod(tension_ratio[..., 0] * tension_ratio[..., 1], axis=0)
    transmitted = shift_from_base(beyond_both, at_base[0])
    in_gap = tension_ratio[..., 0] * transmitted
    gap_tension = runs * (in_gap - offset)
    body_tension = runs * (tension_ratio[..., 1] * in_gap - offset)
    shortening = runs * (group.natural_gap - crossing.length)
    in_body = body_tension * group.body_length
    lengths = jnp.stack([shortening, gap_tension * group.natural_gap + in_body])
    summed = jnp.cumsum(lengths[:, ::-1], axis=1)[:, ::-1]
    beyond = summed - lengths
    stiffness = of_group(chain.memory_stiffness, group)[None]
    at_exit = summed[0] + summed[1] / stiffness
    at_entry = beyond[0] + (beyond[1] + in_body) / stiffness
    limits = chain.friction.limits(*turning, (transmitted - offset, gap_tension), log_ratio)
    return TendonSpans(
        crossing=crossing,
        tension_ratio=tension_ratio,
        gap_tension=gap_tension,
        body_tension=body_tension,
        released_beyond=beyond[0],
        tension_length_beyond=beyond[1],
        released_length=summed[0],
        tension_length=summed[1],
        slid=jnp.stack([at_exit, at_entry], axis=-1),
        bound=slip_mask(group) * limits,
    )


def _wrenches(
    chain: Chain,
    pose: Motion,
    unknowns: Unknowns,
    spans: tuple[TendonSpans, ...],
    contacts: tuple[GapResponse, ...],
    external: Float[Array, "n w"] | None,
) -> BodyWrenches:
    """Compute the wrenches of spans, contacts and loads on the bodies."""
    size = chain.rods.basis.shape[-2]
    terminating = jnp.zeros((chain.flexures, chain.window, size))
    for group, span in zip(chain.groups, spans, strict=True):
        if span.crossing.wrench is not None:
            pull = -span.gap_tension[..., None] * span.crossing.wrench
            terminating += jnp.einsum("ntw,ntk->nkw", pull, span_mask(chain, group.back))
    for group, response, force in zip(
        chain.contact_pairs, contacts, unknowns.contact_force, strict=True
    ):
        if response.wrench is not None:
            push = (force * group.has_contact)[..., None] * response.wrench
            terminating += jnp.einsum("nlw,nlk->nkw", push, span_mask(chain, group.back))
    transmitted = [jnp.zeros((chain.flexures, size))]
    for number in reversed(range(chain.window - 1)):
        from_beyond = jax.vmap(Motion.wrench)(pose, terminating[:, number + 1] + transmitted[0])
        from_tip = jnp.concatenate([from_beyond[1:], jnp.zeros_like(from_beyond[:1])])
        transmitted.insert(0, from_tip)
    resultant = terminating[:, 0] + transmitted[0]
    if external is not None:
        resultant = resultant + external
    return BodyWrenches(terminating, jnp.stack(transmitted, axis=1), external, resultant)


def span_mask(chain: Chain, back: Array) -> Float[Array, "n t window"]:
    """Return 1 where a span or contact that ends at a body reaches back over more flexures."""
    return 1.0 * (back[..., None] > jnp.arange(chain.window)[None, None])
