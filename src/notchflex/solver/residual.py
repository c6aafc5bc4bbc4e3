"""Residual of the whole chain at given unknowns, all flexures at once.

Wrenches on body j are taken about the origin and along the axes of body j. Only three quantities
are accumulated along the chain: logarithms of tensions from the base, released tendon lengths and
external loads from the tip.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np
from jax.flatten_util import ravel_pytree
from jaxtyping import Array, Bool, Float, Shaped

from notchflex._jax import constant, jax, jnp
from notchflex.loads.command import BodyLoads, Command, body_wrench
from notchflex.mechanics.chain import Chain, flexure_states
from notchflex.mechanics.contact import ContactGroup, closing_angles
from notchflex.mechanics.flexure import FlexureState
from notchflex.mechanics.motion import Motion, identity
from notchflex.mechanics.sheath import (
    SheathMemory,
    from_base,
    log_tension,
    mean_tension,
    within,
)
from notchflex.mechanics.tendon import Crossing, OfTendons, TendonGroup, fibre_lengths

# Poses of bodies: against the base, and against those before.


def body_poses(relative: Motion) -> Motion:
    """Return the poses of bodies 0 to n in the frame of the base, from those between neighbours."""
    # A prefix product: first over pairs, then over fours, until all start at the base.
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


def anchor_poses(chain: Chain, pose: Motion | None) -> Motion | None:
    """Return the pose of every body in the frames of those before it, within the window."""
    if pose is None:
        return None
    poses, before = [pose], pose
    for _ in range(chain.window - 1):
        before = jax.tree.map(shift_from_base, before, identity(pose.translation.shape[-1]))
        poses.append(jax.vmap(Motion.then)(before, poses[-1]))
    return jax.tree.map(lambda *leaves: jnp.stack(leaves, axis=1), *poses)


def select_anchors(anchors: Motion | None, back: Array) -> Motion | None:
    """Select the anchor of every tendon or contact among the bodies before."""
    if anchors is None:
        return None
    return jax.tree.map(
        lambda leaf: select_back([leaf[:, k] for k in range(leaf.shape[1])], back), anchors
    )


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


# Spans of the tendons over all gaps: tensions, released lengths and bounds of friction.


class TendonSpans(NamedTuple):
    """Tensions and lengths of a group of t tendons over all flexures, n by t (mm, N).

    Attributes:
        crossing: Its path over every gap.
        tension_ratio: Tension beyond each edge of the gap over the tension before it.
        gap_tension: Tension in the gap; 0 where the tendon has no span there.
        body_tension: Tension inside the distal body, likewise.
        released_beyond: Tendon length released by the flexures beyond the distal body.
        tension_length_beyond: Sum of tension times length beyond it, N mm.
        released_length: As `released_beyond`, with this gap.
        tension_length: As `tension_length_beyond`, with this gap and the distal body.
        slid: Tendon slid over both edges toward the base, with the stiffness of the friction law.
        bound: Largest log ratio at both edges, in the direction of the present one.
    """

    crossing: Crossing
    tension_ratio: Float[Array, "n t 2"]
    gap_tension: Float[Array, "n t"]
    body_tension: Float[Array, "n t"]
    released_beyond: Float[Array, "n t"]
    tension_length_beyond: Float[Array, "n t"]
    released_length: Float[Array, "n t"]
    tension_length: Float[Array, "n t"]
    slid: Float[Array, "n t 2"]
    bound: Float[Array, "n t 2"]


def of_group(values: Shaped[Array, " all"], group: TendonGroup) -> Shaped[Array, " t"]:
    """Select the tendons of a group by slices, whose adjoint the native compiler supports."""
    return jnp.stack([values[number] for number in group.numbers])


def slip_mask(group: TendonGroup) -> Float[Array, "n t 2"]:
    """Return 1 where a tendon can slide over an edge: where it runs and is not fixed."""
    return jnp.stack([group.visits, group.visits * (1.0 - group.ends)], axis=-1)


def in_tendon_order(chain: Chain, grouped: tuple[Float[Array, "*shape t"], ...]) -> Array:
    """Order values per group of tendons as the robot's tendons, along the last axis."""
    if not grouped:
        return jnp.zeros(0)
    together = jnp.concatenate(grouped, axis=-1)
    return jnp.stack([together[..., column] for column in np.argsort(chain.tendon_order)], axis=-1)


# Unknowns and history of every flexure, and its two complementarity laws: contact and friction.
#
# Each law is written as one equation that Newton's method solves together with the equilibrium.

# Friction law: x = clip(x + r (slip - c (x - x_prev))). The augmentation parameter r only affects
# convergence and drops out at the solution. Slip is in heights of the notch, so that a scaled robot
# is solved in the same way. The compliance c of sticking contacts keeps the law regular.
#
# Two contacts at one place, such as both edges of a disk without thickness, share what they hold in
# any way while they stick: without a compliance their rows depend on each other, and slopes and
# stiffness of such a state are noise (tests/solver/test_held_stiffness.py). With 1e-12 tensions of
# Gao's robot would be off by 5e-6 N. On a tendon that stretches these contacts are found with more
# (tests/solver/test_many_strokes.py): a part of the stretch by the closing force. The ratios of a
# slack tendon change nothing, and it counts as one that stretches by a height: with less its ratios
# were noise, and a reversed stroke took 40 iterations, not 16 (tests/solver/test_antagonists.py).
AUGMENTATION = 8.0
_STICK_COMPLIANCE, _STICK_STRETCH = 1e-14, 1e-9


class Unknowns(NamedTuple):
    """Unknowns of all flexures, flexures as leading axis.

    Attributes:
        modes: Amplitudes of the strain modes.
        contact_force: Contact forces, N, for each kind of contacts.
        log_ratio: ln(tension on the base side / tip side) at both edges of the gap, for each
            group of tendons.
    """

    modes: Float[Array, "*n modes"]
    contact_force: tuple[Float[Array, "*n l"], ...]
    log_ratio: tuple[Float[Array, "*n t 2"], ...]


class Iterate(NamedTuple):
    """A point of Newton's method, or a step between two.

    Attributes:
        unknowns: The unknowns of all flexures.
        base_tension: The base tensions, N.
    """

    unknowns: Unknowns
    base_tension: OfTendons


class Memory(NamedTuple):
    """History of the friction contacts and of the material, as of the last solved state.

    Attributes:
        log_ratio: Their log ratios.
        slid: Tendon slid over them, mm.
        bound: Their largest log ratios, for the predictor of the next state alone.
        material: Memory of the material at every node; () where it has none.
        damping: While a notch snaps: viscosity as a fraction of the stiffness at rest, and the
            modes that it refers to; None otherwise.
        stick_compliance: Additional slip over a sticking contact, in heights of the notch, per
            change of its log ratio; None for none.
        sheath: Memory of the sheaths; None where there are none.
    """

    log_ratio: tuple[Float[Array, "*n t 2"], ...]
    slid: tuple[Float[Array, "*n t 2"], ...]
    bound: tuple[Float[Array, "*n t 2"], ...]
    material: Any = ()
    damping: tuple[Float[Array, ""], Float[Array, "*n modes"]] | None = None
    stick_compliance: Float[Array, ""] | None = None
    sheath: SheathMemory | None = None

    def slip_per_log_ratio(
        self, chain: Chain, group: TendonGroup, span: TendonSpans
    ) -> Float[Array, "n t 1"]:
        """Slip over a sticking contact per change of its log ratio, in heights of the notch."""
        stretch = chain.closing_force / of_group(chain.axial_stiffness, group)[None, :, None]
        stretch += span.gap_tension[..., None] <= 0.0
        least = _STICK_COMPLIANCE + _STICK_STRETCH * stretch
        return least if self.stick_compliance is None else least + self.stick_compliance


def notch_heights(chain: Chain) -> Float[Array, " n"]:
    """Return the length of every flexure, mm: the scale of lengths."""
    return jnp.sum(chain.rods.length, axis=-1)


def trial_log_ratio(
    chain: Chain,
    log_ratio: Float[Array, "n t 2"],
    span: TendonSpans,
    memory: Memory,
    k: int,
) -> Float[Array, "n t 2"]:
    """Compute the trial log ratios of the k-th group from the slip, before they are clipped."""
    slip = (span.slid - memory.slid[k]) / notch_heights(chain)[:, None, None]
    compliance = memory.slip_per_log_ratio(chain, chain.groups[k], span)
    return log_ratio + AUGMENTATION * (slip - compliance * (log_ratio - memory.log_ratio[k]))


def clip_symmetric(value: Float[Array, ...], limit: Float[Array, ...]) -> Float[Array, ...]:
    """Clip to +-limit; an equal value counts as the limit, so that a contact at rest can slide."""
    return jnp.where(value >= limit, limit, jnp.where(value <= -limit, -limit, value))


def bound_side(value: Float[Array, ...], limit: Float[Array, ...]) -> Float[Array, ...]:
    """Return +1 where a log ratio lies on its upper bound, -1 on its lower, 0 inside."""
    near = 1e-9
    return jnp.where(value >= limit - near, 1, jnp.where(value <= -limit + near, -1, 0))


def is_active(
    chain: Chain, group: ContactGroup, force: Float[Array, "n l"], gap: Float[Array, "n l"]
) -> Bool[Array, "n l"]:
    """Return which contacts press, by Signorini's condition: force >= 0, gap >= 0, product 0."""
    return (force - chain.contact_stiffness[:, None] * gap > 0.0) & (group.has_contact > 0.0)


# Solved states with their memory; the first is the free robot.


class SolverState(NamedTuple):
    """A solved state with its memory, which the next state needs; it can be saved.

    Attributes:
        point: Unknowns and base tensions.
        memory: History of contacts and material, as of this state.
        stroke: Way of every drive, mm: the tendon drawn out at the base, with what a sheath adds.
        applied: External loads on the bodies; None for a chain assembled for tendons alone.
    """

    point: Iterate
    memory: Memory
    stroke: OfTendons
    applied: BodyLoads | None

    @property
    def tension(self) -> OfTendons:
        """Tension of every drive, N."""
        sheath = self.memory.sheath
        return self.point.base_tension if sheath is None else sheath.tension

    @property
    def wire_stroke(self) -> OfTendons:
        """Way of the end of every wire, mm: within a backlash it stands, and the drive moves."""
        sheath = self.memory.sheath
        return self.stroke if sheath is None else self.stroke - sheath.play


def at_rest(chain: Chain) -> SolverState:
    """Return the state of the free robot, with slack tendons."""
    none = tuple(constant(np.zeros((*group.present.shape, 2))) for group in chain.groups)
    unknowns = Unknowns(
        modes=constant(np.zeros(chain.stiffness.shape)),
        contact_force=tuple(
            constant(np.zeros(group.has_contact.shape)) for group in chain.contact_pairs
        ),
        log_ratio=none,
    )
    slack = constant(np.zeros(chain.tendons))
    sheath = None if chain.sheath is None else chain.sheath.rest()
    memory = Memory(none, none, none, chain.law.rest(chain.rods.section), sheath=sheath)
    return SolverState(Iterate(unknowns, slack), memory, slack, unloaded(chain))


def unloaded(chain: Chain) -> BodyLoads | None:
    """Return zero loads on all bodies of the chain; None where it takes no loads."""
    if not chain.loaded:
        return None
    bodies = chain.flexures + 1
    d, a = (3, 3) if chain.frame is None else (2, 1)
    shapes = ((d,), (a,), (d, d), (a + d,), *[()] * (chain.temperature is not None))
    return BodyLoads(*(constant(np.zeros((bodies, *shape))) for shape in shapes))


_MAX_ROUNDING_GROWTH = 1e4


class BodyWrenches(NamedTuple):
    """Wrenches (moment, force) on the bodies, about and along the frame of body j.

    Attributes:
        terminating: Of the spans and contacts that end at body j, on the bodies j - m and beyond
            together, for m = 0 ... window - 1.
        transmitted: The same of those that end beyond body j.
        external: External loads on body j and beyond; None where there are none.
        resultant: Sum of all on body j and beyond.
        rotation: Rotation of every body against the base; None without external loads.
        on_base: External loads on all bodies, about and along the base; None if there are none.
    """

    terminating: Float[Array, "n window w"]
    transmitted: Float[Array, "n window w"]
    external: Float[Array, "n w"] | None
    resultant: Float[Array, "n w"]
    rotation: Float[Array, "n d d"] | None
    on_base: Float[Array, " w"] | None


class BaseReaction(NamedTuple):
    """Tensions and sums over the whole chain, at the base.

    Attributes:
        base_tension: Tension of every tendon, N.
        released_length: Length of every tendon released by the shape, mm.
        tension_length: Sum of tension times length of every tendon, N mm.
    """

    base_tension: OfTendons
    released_length: OfTendons
    tension_length: OfTendons


class Evaluation(NamedTuple):
    """The whole chain evaluated, flexures as leading axis.

    Attributes:
        flexure: State of every flexure.
        anchors: Pose of body j in the frames of the bodies j - 1, j - 2 ..., as second axis; None
            where nothing acts on bodies.
        spans: For each group of tendons.
        contacts: For each kind of contacts.
        wrenches: On the bodies; None as the anchors.
        base: Sums over the chain, at the base.
        residual: Imbalance, in the form of the unknowns and scaled to be comparable.
        friction_imbalance: Largest residual of the friction law at a contact.
    """

    flexure: FlexureState
    anchors: Motion | None
    spans: tuple[TendonSpans, ...]
    contacts: tuple[Crossing, ...]
    wrenches: BodyWrenches | None
    base: BaseReaction
    residual: Unknowns
    friction_imbalance: Float[Array, ""]


def warmed(chain: Chain, applied: BodyLoads | None) -> Chain:
    """Return a chain at the temperature of its loads."""
    if applied is None or applied.rise is None:
        return chain
    return replace(chain, law=chain.law.warmed(applied.rise[0]))


def evaluate(
    chain: Chain,
    point: Iterate,
    memory: Memory,
    applied: BodyLoads | None,
) -> Evaluation:
    """Evaluate the residual of the chain, with its terms."""
    # Equilibrium is stated as virtual work with the true work of the tendon, -T times the change of
    # its span lengths: normal and friction forces need not be summed.
    unknowns, chain = point.unknowns, warmed(chain, applied)
    on_bodies = chain.forces_on_bodies
    flexure = flexure_states(chain, unknowns.modes, memory.material, with_pose=on_bodies)
    anchors = anchor_poses(chain, flexure.pose)
    spans = tuple(_spans(chain, k, flexure, anchors, point) for k in range(len(chain.groups)))
    contacts = ()
    for group, force in zip(chain.contact_pairs, unknowns.contact_force, strict=True):
        selected = select_anchors(anchors, group.back)
        response = jax.vmap(type(group).cross)(group, chain.rods, flexure, selected)
        if chain.contact_flexibility is not None:
            closing = chain.contact_flexibility[:, None] * force
            response = response._replace(length=response.gap + closing)
        contacts += (response,)
    wrenches = None
    if on_bodies:
        assert flexure.pose is not None
        wrenches = _wrenches(chain, flexure.pose, unknowns, spans, contacts, applied)
    balance = _balance(chain, unknowns, flexure, spans, contacts, wrenches)
    if memory.damping is not None:
        viscosity, before = memory.damping
        balance = balance + viscosity * chain.stiffness * (unknowns.modes - before)
    height = notch_heights(chain)
    contact_force = tuple(  # as fractions of the notch's height
        jnp.where(
            is_active(chain, group, force, response.gap),
            response.gap / height[:, None],
            force / (chain.contact_stiffness * height)[:, None],
        )
        for group, force, response in zip(
            chain.contact_pairs, unknowns.contact_force, contacts, strict=True
        )
    )
    log_ratio = tuple(
        ratio - clip_symmetric(trial_log_ratio(chain, ratio, span, memory, k), span.bound)
        for k, (ratio, span) in enumerate(zip(unknowns.log_ratio, spans, strict=True))
    )
    residual = Unknowns(balance / chain.stiffness, contact_force, log_ratio)
    base = BaseReaction(
        point.base_tension,
        in_tendon_order(chain, tuple(span.released_length[0] for span in spans)),
        in_tendon_order(chain, tuple(span.tension_length[0] for span in spans)),
    )
    imbalance = jnp.max(jnp.abs(ravel_pytree(log_ratio)[0]), initial=0.0)
    return Evaluation(flexure, anchors, spans, contacts, wrenches, base, residual, imbalance)


def rounding_growth(chain: Chain, point: Iterate) -> Float[Array, ""]:
    """Return the growth of rounding in the residual: with the moments that tensions balance."""
    height = jnp.max(notch_heights(chain))
    softest = jnp.min(jnp.where(chain.rods.padding_mask > 0.0, jnp.inf, chain.stiffness))
    largest_tension = jnp.max(jnp.maximum(point.base_tension, 0.0), initial=0.0)
    return jnp.minimum(1.0 + largest_tension * (height / softest), _MAX_ROUNDING_GROWTH)


def _balance(
    chain: Chain,
    unknowns: Unknowns,
    flexure: FlexureState,
    spans: tuple[TendonSpans, ...],
    contacts: tuple[Crossing, ...],
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
    flexure: FlexureState,
    anchors: Motion | None,
    point: Iterate,
) -> TendonSpans:
    """Compute paths, tensions, released lengths and friction bounds of the k-th group."""
    group, log_ratio = chain.groups[k], point.unknowns.log_ratio[k]
    runs = group.runs
    selected = select_anchors(anchors, group.back) if group.acts_on_bodies else None
    crossing = jax.vmap(type(group).cross)(group, chain.rods, flexure, selected)
    # Not written with ln T, so that a slack tendon stays regular.
    offset = chain.friction.offset()
    at_base = of_group(point.base_tension, group)[None] + offset
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
    before = jnp.stack([transmitted - offset, gap_tension], axis=-1)
    limits = chain.friction.limits(crossing.turning, before, log_ratio)
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
    contacts: tuple[Crossing, ...],
    applied: BodyLoads | None,
) -> BodyWrenches:
    """Compute the wrenches of spans, contacts and loads on the bodies."""
    external, rotation, on_base = None, None, None
    if applied is not None:
        distal: Motion = jax.tree.map(lambda leaf: leaf[1:], body_poses(pose))
        rotation = distal.rotation
        loads = jax.tree.map(lambda leaf: leaf[1:], applied)
        in_base = jax.vmap(Motion.wrench)(distal, jax.vmap(body_wrench)(rotation, loads))
        summed = jnp.cumsum(in_base[::-1], axis=0)[::-1]
        external, on_base = jax.vmap(Motion.wrench_inside)(distal, summed), summed[0]
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
    transmitted = jnp.stack(transmitted, axis=1)
    return BodyWrenches(terminating, transmitted, external, resultant, rotation, on_base)


def span_mask(chain: Chain, back: Array) -> Float[Array, "n t window"]:
    """Return 1 where a span or contact that ends at a body reaches back over more flexures."""
    return 1.0 * (back[..., None] > jnp.arange(chain.window)[None, None])


# Actuation of the tendons at the base: by a tension, or by a stroke.


def stroke(chain: Chain, base: BaseReaction) -> OfTendons:
    """Compute the stroke from the free robot (mm), with the tendon stiffness of the file."""
    tension_length = base.tension_length + base.base_tension * chain.free_length
    return base.released_length + tension_length / chain.axial_stiffness


def closing_stroke(chain: Chain) -> Float[np.ndarray, " t"]:
    """Compute the stroke at which every notch is closed (mm); infinite where no formula exists."""
    # Where every notch closes against its spine, a tendon on the wall shortens by the closing angle
    # times its lever arm. A tendon that lengthens as a notch closes has no such limit.
    closing = np.full(chain.tendons, np.inf)
    rods = jax.tree.map(np.asarray, chain.rods)
    travel = closing_angles(rods)
    if not np.isfinite(travel).all():
        return closing
    for group in chain.groups:
        if group.fibre is not None:
            slope = fibre_lengths(rods, constant(group.fibre), rods.basis[..., 0])
            shortening = np.asarray(group.present) * -slope * travel[:, None]
            closing[list(group.numbers)] = np.where(shortening < 0.0, np.inf, shortening).sum(
                axis=0
            )
    return closing


def command_residual(
    chain: Chain, command: Command, memory: SheathMemory | None, base: BaseReaction
) -> OfTendons:
    """Compute the deviation of the tendons from their command, scaled like angles."""
    tension, drawn = base.base_tension, stroke(chain, base)
    if chain.sheath is None or memory is None:
        return _deviation(chain, command, tension, drawn)
    return sheath_contact(chain, command, memory, tension, drawn)[0]


def _deviation(chain: Chain, command: Command, tension: Array, pulled: Array) -> OfTendons:
    # A tendon driven by stroke is slack where the robot has released more than is drawn: tension >=
    # 0, stroke released >= stroke commanded, product 0.
    scale, missing = chain.stroke_stiffness, pulled - command.target
    # Switching keeps the digits that a difference with a large tension would lose.
    by_stroke = jnp.where(tension >= scale * missing, missing, tension / scale)
    return command.either(by_stroke, (tension - command.target) / scale)


def sheath_contact(
    chain: Chain, command: Command, memory: SheathMemory, tension: Array, drawn: Array
) -> tuple[OfTendons, OfTendons]:
    """Return what wires deviate by, and which slide all along: toward drive (1) or base (-1)."""
    # The sheath is one contact more. While the wire slides all along, drive and base are related by
    # exponentials, and the command decides; while it sticks, its end at the base keeps its place.
    # With the deviations where it would slide to either side, the law is that of friction:
    # clip(slip, toward the base, toward the drive) = 0.
    sheath = chain.sheath
    assert sheath is not None
    limit = sheath.log_ratio(command.bend)
    toward_base, toward_drive = (
        _deviation(
            chain,
            command,
            tension * jnp.exp(side * limit),
            drawn + sheath.end_stretch(side, limit, tension),
        )
        for side in (-1.0, 1.0)
    )
    profile = within(memory, limit)
    moved = from_base(profile, log_tension(tension), limit)
    stretched = sheath.compliance * (mean_tension(moved) - mean_tension(profile))
    # Of a tendon that is inextensible in the robot the tension could be any while all contacts
    # stick: the memory's stiffness keeps it.
    change = tension - jnp.exp(memory.level[:, -1])
    height, stiffness = jnp.max(notch_heights(chain)), chain.memory_stiffness
    kept = jnp.where(jnp.isinf(chain.axial_stiffness), change * height / stiffness, 0.0)
    slip = drawn - memory.stroke + stretched + kept
    side = jnp.where(slip >= toward_drive, 1.0, jnp.where(slip <= toward_base, -1.0, 0.0))
    slid = jnp.where(side > 0.0, toward_drive, toward_base)
    return jnp.where(side == 0.0, slip, slid), side


def without_slack(chain: Chain, command: Command, point: Iterate, reached: OfTendons) -> Iterate:
    """Set the tensions of slack tendons at a solved point to zero, given the strokes reached."""
    if command.by_stroke is None:
        return point
    missing = chain.stroke_stiffness * (reached - command.target)
    slack = command.by_stroke & (point.base_tension < missing)
    return point._replace(base_tension=jnp.where(slack, 0.0, point.base_tension))


def command_slopes(
    chain: Chain, command: Command, memory: SheathMemory | None, base: BaseReaction
) -> tuple[Float[Array, "t t"], Float[Array, "t t"], Float[Array, "t t"]]:
    """Differentiate `command_residual` by base tension, released length, tension times length."""

    def residual(*numbers: Array) -> Array:
        return command_residual(chain, command, memory, BaseReaction(*numbers))

    arguments = (base.base_tension, base.released_length, base.tension_length)
    return jax.jacfwd(residual, argnums=(0, 1, 2))(*jax.tree.map(jax.lax.stop_gradient, arguments))


# Largest tension of an inextensible tendon driven by stroke, in closing forces of a notch.
_MAX_CLOSING_FORCES = 1e5


def tension_is_bounded(chain: Chain, command: Command, point: Iterate) -> Bool[Array, ""] | bool:
    """Return whether the tensions of tendons driven by stroke are bounded."""
    # Once the shape is rigid, an inextensible tendon cannot be drawn further; rounding would then
    # determine its tension. An extensible tendon bounds its tension itself.
    if command.by_stroke is None:
        return True
    limit = _MAX_CLOSING_FORCES * chain.closing_force
    limit = jnp.where(chain.inextensible, limit, jnp.inf)
    return jnp.all(jnp.where(command.by_stroke, point.base_tension, 0.0) <= limit)
