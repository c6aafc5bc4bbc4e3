"""The balance of the whole chain under given unknowns, all flexures at once.

Everything is seen from the bodies: what ends at body j is a wrench about and along its frame. Only
three things are summed up along the chain: the logarithms of the tensions from the base on, tendon
set free and stretched from the tip on, and the external loads.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from jaxtyping import Array, Float

from notchflex._jax import jax, jnp
from notchflex.loads.applied import Applied, body_wrench
from notchflex.mechanics.chain import Chain, flexure_states
from notchflex.mechanics.contact import Touch
from notchflex.mechanics.flexure import FlexureState
from notchflex.mechanics.motion import Motion, identity
from notchflex.mechanics.tendon import Crossing, TendonGroup
from notchflex.solver.element import Memory, Unknowns, between, driven, signorini


class Spans(NamedTuple):
    """A group of t tendons over all flexures, n by t (mm, N).

    Attributes:
        crossing: Its way over every gap.
        passed_on: Part of its tension that each edge of the gap leaves it.
        gap_tension: Tension in the gap; 0 where the tendon has no span there.
        body_tension: Tension inside the distal body, likewise.
        drawn: How much tendon the shape has set free beyond the distal body.
        stretch: Sum of tension times length beyond, N mm.
        drawn_behind: As `drawn`, this gap included.
        stretch_behind: As `stretch`, this gap and the body included.
        slid: Tendon slid over both edges toward the base, by the memory's stiffness.
        bound: Largest log ratio at both edges.
    """

    crossing: Crossing
    passed_on: Float[Array, "n t 2"]
    gap_tension: Float[Array, "n t"]
    body_tension: Float[Array, "n t"]
    drawn: Float[Array, "n t"]
    stretch: Float[Array, "n t"]
    drawn_behind: Float[Array, "n t"]
    stretch_behind: Float[Array, "n t"]
    slid: Float[Array, "n t 2"]
    bound: Float[Array, "n t 2"]


class Wrenches(NamedTuple):
    """What acts on the bodies (moment, force), about and along the frame of body j.

    Attributes:
        ending: What the spans and lips that end at body j do to the bodies j - m and beyond
            together, for m = 0 ... window - 1.
        handed: The same of those that end beyond body j.
        outside: The external loads on body j and all beyond; None where there are none.
        whole: All that acts on body j and beyond.
    """

    ending: Float[Array, "n window w"]
    handed: Float[Array, "n window w"]
    outside: Float[Array, "n w"] | None
    whole: Float[Array, "n w"]


class Base(NamedTuple):
    """What comes back to the base.

    Attributes:
        drawn: How much of every tendon the shape has set free, mm.
        stretch: Sum of tension times length of every tendon, N mm.
        load: External loads on all bodies, about and along the base; None if there are none.
    """

    drawn: Float[Array, " t"]
    stretch: Float[Array, " t"]
    load: Float[Array, " w"] | None


class Evaluation(NamedTuple):
    """The whole chain evaluated, flexures as leading axis.

    Attributes:
        flexure: State of every flexure.
        anchors: Pose of body j seen from the bodies j - 1, j - 2 ..., as second axis; None where
            nothing acts on bodies.
        rotation: Rotation of every body against the base; None where no load asks for it.
        spans: For each group of tendons.
        touches: For each kind of lips.
        wrenches: What acts on the bodies; None as the anchors.
        base: What comes back to the base.
        residual: Imbalance, in the form of the unknowns and scaled to be comparable.
    """

    flexure: FlexureState
    anchors: Motion | None
    rotation: Float[Array, "n d d"] | None
    spans: tuple[Spans, ...]
    touches: tuple[Touch, ...]
    wrenches: Wrenches | None
    base: Base
    residual: Unknowns


def evaluate(
    chain: Chain,
    unknowns: Unknowns,
    memory: Memory,
    base_tension: Float[Array, " t"],
    applied: Applied | None,
) -> Evaluation:
    """Judge given unknowns.

    The balance is that of virtual work with the tendon's true work, -T times the change of its
    span lengths, so that normal and friction forces need not be summed.

    Args:
        chain: The chain.
        unknowns: Its unknowns, flexures as leading axis.
        memory: What its contacts remember.
        base_tension: Tension of every tendon at the base, N.
        applied: Other loads on the bodies; None for a chain assembled for tendons alone.

    Returns:
        The evaluation.
    """
    on_bodies = chain.forces_on_bodies
    flexure = flexure_states(chain, unknowns.modes, with_pose=on_bodies)
    anchors = _anchors(chain, flexure.pose)
    spans = tuple(
        _spans(chain, k, crossed(group, chain, flexure, anchors), unknowns, memory, base_tension)
        for k, group in enumerate(chain.groups)
    )
    touches = tuple(
        jax.vmap(type(group).touch)(group, chain.rods, flexure, picked(anchors, group.back))
        for group in chain.lips
    )
    wrenches, rotation, load = None, None, None
    if on_bodies:
        assert flexure.pose is not None
        outside = _outside(flexure.pose, applied)
        rotation, load = outside.rotation, outside.load
        wrenches = _wrenches(chain, flexure.pose, unknowns, spans, touches, outside)
    balance = flexure.internal
    if chain.elastic is not None:
        balance = jnp.einsum("nmk,nk->nm", chain.elastic, unknowns.modes)
    for span in spans:
        if span.crossing.slope is not None:
            balance = balance + jnp.einsum("nt,ntm->nm", span.gap_tension, span.crossing.slope)
    for group, touch, force in zip(chain.lips, touches, unknowns.lip_force, strict=True):
        if touch.slope is not None:
            balance = balance - jnp.einsum("nl,nlm->nm", force * group.closes, touch.slope)
    if wrenches is not None:
        balance = balance - jnp.einsum("nwm,nw->nm", flexure.twist, wrenches.whole)
    residual = Unknowns(
        modes=balance / chain.stiffness,
        lip_force=tuple(
            signorini(chain, group.closes, force, touch.gap)
            for group, force, touch in zip(chain.lips, unknowns.lip_force, touches, strict=True)
        ),
        log_ratio=tuple(
            own - between(driven(chain, own, span.slid, memory, k), span.bound)
            for k, (own, span) in enumerate(zip(unknowns.log_ratio, spans, strict=True))
        ),
    )
    base = Base(
        drawn=per_tendon(chain, tuple(span.drawn_behind[0] for span in spans)),
        stretch=per_tendon(chain, tuple(span.stretch_behind[0] for span in spans)),
        load=load,
    )
    return Evaluation(flexure, anchors, rotation, spans, touches, wrenches, base, residual)


def crossed(
    group: TendonGroup, chain: Chain, flexure: FlexureState, anchors: Motion | None
) -> Crossing:
    """A group of tendons over all gaps."""
    own = picked(anchors, group.back) if group.acts_on_bodies else None
    return jax.vmap(type(group).cross)(group, chain.rods, flexure, own)


def picked(anchors: Motion | None, back: Array) -> Motion | None:
    """Of the bodies before (second axis), for every tendon or lip the one it comes from."""
    if anchors is None:
        return None

    def of_leaf(leaf: Array) -> Array:
        back_to = back.reshape(*back.shape, *(1,) * (leaf.ndim - 2))
        found = jnp.broadcast_to(leaf[:, :1], (*back.shape, *leaf.shape[2:]))
        for number in range(1, leaf.shape[1]):
            found = jnp.where(back_to == number + 1, leaf[:, number][:, None], found)
        return found

    return jax.tree.map(of_leaf, anchors)


def _anchors(chain: Chain, pose: Motion | None) -> Motion | None:
    """Pose of every body seen from those before it, as far as the window reaches."""
    if pose is None:
        return None
    seen = [pose]
    before = pose
    for _ in range(chain.window - 1):
        before = _from_base_side(before, identity(pose.translation.shape[-1]))
        seen.append(jax.vmap(Motion.then)(before, seen[-1]))
    return jax.tree.map(lambda *leaves: jnp.stack(leaves, axis=1), *seen)


def _from_base_side(values: Any, first: Any) -> Any:
    """What the flexure before has, and something for the first."""
    return jax.tree.map(
        lambda leaf, own: jnp.concatenate([jnp.asarray(own)[None], leaf[:-1]]), values, first
    )


def _from_tip_side(values: Array) -> Array:
    """What the flexure behind has, and nothing for the last."""
    return jnp.concatenate([values[1:], jnp.zeros_like(values[:1])])


def _spans(
    chain: Chain,
    k: int,
    crossing: Crossing,
    unknowns: Unknowns,
    memory: Memory,
    base_tension: Float[Array, " t"],
) -> Spans:
    """Tensions, lengths set free and bounds of the k-th group."""
    group, log_ratio = chain.groups[k], unknowns.log_ratio[k]
    runs = group.runs
    # Not written with ln T, so that a slack tendon stays regular.
    at_base = _of_group(base_tension, group)[None]
    passed_on = jnp.exp(-runs[..., None] * log_ratio)
    beyond_both = at_base * jnp.cumprod(passed_on[..., 0] * passed_on[..., 1], axis=0)
    gap_tension = runs * passed_on[..., 0] * _from_base_side(beyond_both, at_base[0])
    body_tension = passed_on[..., 1] * gap_tension
    shortening = runs * (group.natural_gap - crossing.length)
    in_body = body_tension * group.body_length
    lengths = jnp.stack([shortening, gap_tension * group.natural_gap + in_body])
    behind = jnp.cumsum(lengths[:, ::-1], axis=1)[:, ::-1]
    beyond = behind - lengths
    stiffness = _of_group(chain.memory_stiffness, group)[None]
    at_exit = behind[0] + behind[1] / stiffness
    at_entry = beyond[0] + (beyond[1] + in_body) / stiffness
    bounds = chain.friction.bounds(crossing.exit_turning, crossing.entry_turning)
    return Spans(
        crossing=crossing,
        passed_on=passed_on,
        gap_tension=gap_tension,
        body_tension=body_tension,
        drawn=beyond[0],
        stretch=beyond[1],
        drawn_behind=behind[0],
        stretch_behind=behind[1],
        slid=jnp.stack([at_exit, at_entry], axis=-1),
        bound=holds(group) * jnp.stack(bounds, axis=-1),
    )


def _of_group(values: Float[Array, " all"], group: TendonGroup) -> Float[Array, " t"]:
    """Values of the tendons of a group; by slices, whose adjoint the native compiler knows."""
    return jnp.stack([values[number] for number in group.numbers])


def holds(group: TendonGroup) -> Float[Array, "n t 2"]:
    """1 where a tendon can slide over an edge: not where it is fixed, nor where it does not go."""
    return jnp.stack([group.visits, group.visits * (1.0 - group.ends)], axis=-1)


class _Outside(NamedTuple):
    """External loads on all bodies; None where there are none."""

    rotation: Float[Array, "n d d"] | None
    beyond: Float[Array, "n w"] | None
    load: Float[Array, " w"] | None


def _outside(pose: Motion, applied: Applied | None) -> _Outside:
    """Sum of the loads on every body and all beyond, in the frame of the body."""
    if applied is None:
        return _Outside(None, None, None)
    bodies = body_poses(pose)
    beyond_base: Motion = jax.tree.map(lambda leaf: leaf[1:], bodies)
    own = jax.vmap(body_wrench)(beyond_base.rotation, jax.tree.map(lambda leaf: leaf[1:], applied))
    in_base = jax.vmap(Motion.wrench)(beyond_base, own)
    summed = jnp.cumsum(in_base[::-1], axis=0)[::-1]
    inside = jax.vmap(Motion.wrench_inside)(beyond_base, summed)
    return _Outside(beyond_base.rotation, inside, summed[0])


def body_poses(relative: Motion) -> Motion:
    """Poses of bodies 0 to n in the frame of the base, from the poses between neighbours.

    First from every second body on, then every fourth, until all are seen from the base.
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


def _wrenches(
    chain: Chain,
    pose: Motion,
    unknowns: Unknowns,
    spans: tuple[Spans, ...],
    touches: tuple[Touch, ...],
    outside: _Outside,
) -> Wrenches:
    """What spans, lips and loads do to the bodies."""
    size = chain.rods.basis.shape[-2]
    ending = jnp.zeros((chain.flexures, chain.window, size))
    for group, span in zip(chain.groups, spans, strict=True):
        if span.crossing.wrench is not None:
            pull = -span.gap_tension[..., None] * span.crossing.wrench
            ending = ending + jnp.einsum("ntw,ntk->nkw", pull, reaches(chain, group.back))
    for group, touch, force in zip(chain.lips, touches, unknowns.lip_force, strict=True):
        if touch.wrench is not None:
            push = (force * group.closes)[..., None] * touch.wrench
            ending = ending + jnp.einsum("nlw,nlk->nkw", push, reaches(chain, group.back))
    handed = [jnp.zeros((chain.flexures, size))]
    for number in reversed(range(chain.window - 1)):
        behind = jax.vmap(Motion.wrench)(pose, ending[:, number + 1] + handed[0])
        handed.insert(0, _from_tip_side(behind))
    whole = ending[:, 0] + handed[0]
    if outside.beyond is not None:
        whole = whole + outside.beyond
    return Wrenches(ending, jnp.stack(handed, axis=1), outside.beyond, whole)


def reaches(chain: Chain, back: Array) -> Float[Array, "n t window"]:
    """1 where a span or opening that ends at a body reaches over so many flexures more."""
    return 1.0 * (back[..., None] > jnp.arange(chain.window)[None, None])


def per_tendon(chain: Chain, grouped: tuple[Float[Array, "*shape t"], ...]) -> Array:
    """Bring values per group of tendons into the order of the robot's tendons, as last axis."""
    if not grouped:
        return jnp.zeros(0)
    together = jnp.concatenate(grouped, axis=-1)
    return jnp.stack([together[..., place] for place in np.argsort(chain.tendon_order)], axis=-1)
