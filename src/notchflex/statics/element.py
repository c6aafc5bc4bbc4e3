"""One flexure with its tendons: the balance that its unknowns must meet.

The chain is a row of such elements. Seen from one of them, the rest of the robot enters only by
what is carried on from the base side (`Carried`) and by what comes back from the tip side
(`Beyond`). That is what makes the linear step a sweep along the chain (`sweep.py`).
"""

from __future__ import annotations

from typing import Any, NamedTuple

import equinox as eqx
from jaxtyping import Array, Float

from notchflex._jax import jax, jnp
from notchflex.chain import Chain
from notchflex.contact import LipGroup, Touch
from notchflex.flexure import FlexureState, Rod
from notchflex.friction import FrictionLaw
from notchflex.material import SectionLaw
from notchflex.statics.applied import Applied, body_wrench
from notchflex.tendon import Crossing, TendonGroup

# The memory law x = clip(x + rate (slip - (x - x_prev) / stiction)). The rate is how strongly slip
# drives the logarithm while Newton searches, and drops out at the solution; the stiction only
# keeps the equation regular where a slack tendon makes the tension ratio meaningless. Both are
# per slip in heights of the notch, so that a robot of another size is solved alike.
RATE = 8.0
STICTION = 1e15


class Unknowns(NamedTuple):
    """Unknowns of a flexure, or with a leading axis of all.

    Attributes:
        modes: Amplitudes of its strain modes.
        lip_force: Contact forces of its lips, N, for each kind of lips.
        log_ratio: ln(tension on the base side / tip side) at both edges of its gap, for each
            group of tendons.
    """

    modes: Float[Array, "*n modes"]
    lip_force: tuple[Float[Array, "*n l"], ...]
    log_ratio: tuple[Float[Array, "*n t 2"], ...]


class Carried(NamedTuple):
    """What an element gets from the base side, in the frame of its proximal body.

    Attributes:
        tendons: For each group of tendons, tension and where it comes from.
        lips: For each kind of lips, the faces that may be closed against.
        rotation: Rotation of the proximal body against the base; None where no load asks for it.
    """

    tendons: tuple[Any, ...]
    lips: tuple[Any, ...]
    rotation: Float[Array, "3 3"] | None


class Beyond(NamedTuple):
    """What the part of the robot beyond a body hands back to it.

    Attributes:
        wrench: Moment and force on everything beyond, about the body's origin in its frame;
            None where no force acts on any body.
        reaction: For each group of tendons, what its pull does to the body that it leaves.
        pressed: For each kind of lips, what they do to the body that they close against.
        drawn: For each group, how much tendon the shape beyond has set free, mm.
        stretch: For each group, sum of tension times length beyond, N mm.
    """

    wrench: Float[Array, " 6"] | None
    reaction: tuple[Any, ...]
    pressed: tuple[Any, ...]
    drawn: tuple[Float[Array, " t"], ...]
    stretch: tuple[Float[Array, " t"], ...]


class Memory(NamedTuple):
    """What a flexure's contacts remember of the last solved state.

    Attributes:
        log_ratio: Their log ratios.
        slid: Tendon slid over them, mm.
        bound: Their largest log ratios, which only help to guess the next state.
    """

    log_ratio: tuple[Float[Array, "*n t 2"], ...]
    slid: tuple[Float[Array, "*n t 2"], ...]
    bound: tuple[Float[Array, "*n t 2"], ...]


class Element(eqx.Module):
    """Constants of one flexure and the load on its distal body, cut along their leading axis."""

    rod: Rod
    memory: Any
    groups: tuple[TendonGroup, ...]
    lips: tuple[LipGroup, ...]
    applied: Applied | None
    stiffness: Float[Array, " modes"]
    lip_stiffness: Float[Array, ""]


class Shared(eqx.Module):
    """Constants that all flexures have in common."""

    law: SectionLaw
    friction: FrictionLaw
    memory_stiffness: tuple[Float[Array, " t"], ...]


class ElementResult(NamedTuple):
    """What the rest of the robot makes of one element.

    Attributes:
        residual: Imbalance, in the form of the unknowns and scaled to be comparable.
        onward: What is carried on to the next element.
        behind: What is handed back to the proximal body.
        crossings: State of its tendons.
        gap: What is left of its openings, for each kind of lips, mm.
        slid: Tendon slid over both edges toward the base, mm, by the memory's stiffness.
        bound: Largest magnitude of the log ratio at both edges.
        wrench: Moment and force on everything from the distal body on; None as in `Beyond`.
    """

    residual: Unknowns
    onward: Carried
    behind: Beyond
    crossings: tuple[Crossing, ...]
    gap: tuple[Float[Array, " l"], ...]
    slid: tuple[Float[Array, "t 2"], ...]
    bound: tuple[Float[Array, "t 2"], ...]
    wrench: Float[Array, " 6"] | None


def elements(chain: Chain, applied: Applied | None) -> Element:
    """All elements of a chain under given loads, with the flexures as leading axis."""
    on_distal = None if applied is None else jax.tree.map(lambda leaf: leaf[1:], applied)
    return Element(
        rod=chain.rods,
        memory=chain.memory,
        groups=chain.groups,
        lips=chain.lips,
        applied=on_distal,
        stiffness=chain.stiffness,
        lip_stiffness=chain.lip_stiffness,
    )


def shared(chain: Chain) -> Shared:
    """What the elements of a chain have in common."""
    return Shared(
        law=chain.law,
        friction=chain.friction,
        memory_stiffness=tuple(
            chain.memory_stiffness[jnp.array(group.numbers)] for group in chain.groups
        ),
    )


def leave_base(chain: Chain, base_tension: Float[Array, " t"]) -> Carried:
    """What is carried on from the base."""
    return Carried(
        tendons=tuple(
            group.leave_base(base_tension[jnp.array(group.numbers)]) for group in chain.groups
        ),
        lips=tuple(group.leave_base() for group in chain.lips),
        rotation=jnp.eye(3) if chain.loaded else None,
    )


def nothing_beyond(chain: Chain) -> Beyond:
    """What comes back from beyond the tip."""
    nothing = tuple(jnp.zeros(len(group.numbers)) for group in chain.groups)
    return Beyond(
        wrench=jnp.zeros(6) if chain.forces_on_bodies else None,
        reaction=tuple(group.no_reaction() for group in chain.groups),
        pressed=tuple(group.no_reaction() for group in chain.lips),
        drawn=nothing,
        stretch=nothing,
    )


def cross(
    element: Element,
    flexure: FlexureState,
    unknowns: Unknowns,
    carried: Carried,
    beyond: Beyond,
) -> tuple[tuple[Crossing, ...], tuple[Touch, ...], Carried]:
    """Take all groups of tendons and lips over one flexure; also what is carried on."""
    crossings = tuple(
        group.cross(element.rod, flexure, log_ratio, brought, back)
        for group, log_ratio, brought, back in zip(
            element.groups, unknowns.log_ratio, carried.tendons, beyond.reaction, strict=True
        )
    )
    touches = tuple(
        group.touch(element.rod, flexure, force, brought, back)
        for group, force, brought, back in zip(
            element.lips, unknowns.lip_force, carried.lips, beyond.pressed, strict=True
        )
    )
    rotation = carried.rotation
    if rotation is not None and flexure.pose is not None:
        rotation = rotation @ flexure.pose.rotation
    onward = Carried(
        tuple(crossing.carried for crossing in crossings),
        tuple(touch.carried for touch in touches),
        rotation,
    )
    return crossings, touches, onward


def element_result(
    element: Element,
    common: Shared,
    flexure: FlexureState,
    unknowns: Unknowns,
    memory: Memory,
    carried: Carried,
    beyond: Beyond,
) -> ElementResult:
    """Judge one element.

    The balance is that of virtual work with the tendon's true work, -T times the change of its
    span lengths, so that normal and friction forces need not be summed.
    """
    crossings, touches, onward = cross(element, flexure, unknowns, carried, beyond)
    balance = flexure.internal
    for part in (*crossings, *touches):
        balance = balance + part.pull
    wrench = behind_wrench = beyond.wrench
    if wrench is not None and flexure.pose is not None and flexure.twist is not None:
        for part in (*crossings, *touches):
            if part.wrench is not None:
                wrench = wrench + part.wrench
        if element.applied is not None and onward.rotation is not None:
            wrench = wrench + body_wrench(onward.rotation, element.applied)
        balance = balance - flexure.twist.T @ wrench
        behind_wrench = flexure.pose.wrench(wrench)
    behind = Beyond(
        wrench=behind_wrench,
        reaction=tuple(crossing.reaction for crossing in crossings),
        pressed=tuple(touch.reaction for touch in touches),
        drawn=tuple(
            drawn + crossing.shortening
            for drawn, crossing in zip(beyond.drawn, crossings, strict=True)
        ),
        stretch=tuple(
            stretch
            + crossing.gap_tension * group.natural_gap
            + crossing.body_tension * group.body_length
            for stretch, crossing, group in zip(
                beyond.stretch, crossings, element.groups, strict=True
            )
        ),
    )
    log_ratio, slid, bound = _friction(
        element, common, unknowns, memory, crossings, beyond=beyond, behind=behind
    )
    return ElementResult(
        residual=Unknowns(
            modes=balance / element.stiffness,
            lip_force=tuple(
                _signorini(element, group, force, touch.gap)
                for group, force, touch in zip(
                    element.lips, unknowns.lip_force, touches, strict=True
                )
            ),
            log_ratio=log_ratio,
        ),
        onward=onward,
        behind=behind,
        crossings=crossings,
        gap=tuple(touch.gap for touch in touches),
        slid=slid,
        bound=bound,
        wrench=wrench,
    )


def _signorini(
    element: Element, group: LipGroup, force: Float[Array, " l"], gap: Float[Array, " l"]
) -> Float[Array, " l"]:
    """Signorini's condition, force >= 0, gap >= 0, product 0, as one equation."""
    height = jnp.sum(element.rod.length)
    pressed = force - element.lip_stiffness * gap
    pressed = jnp.where((pressed > 0.0) & (group.closes > 0.0), pressed, 0.0)
    return (force - pressed) / (element.lip_stiffness * height)


def _friction(
    element: Element,
    common: Shared,
    unknowns: Unknowns,
    memory: Memory,
    crossings: tuple[Crossing, ...],
    *,
    beyond: Beyond,
    behind: Beyond,
) -> tuple[tuple[Array, ...], tuple[Array, ...], tuple[Array, ...]]:
    """Memory law of both edges: imbalance, slid lengths and bounds of every group."""
    height = jnp.sum(element.rod.length)
    imbalance, slid, bound = [], [], []
    for number, (group, crossing) in enumerate(zip(element.groups, crossings, strict=True)):
        stiffness = common.memory_stiffness[number]
        body_stretch = crossing.body_tension * group.body_length
        at_exit = behind.drawn[number] + behind.stretch[number] / stiffness
        at_entry = beyond.drawn[number] + (beyond.stretch[number] + body_stretch) / stiffness
        over_both = jnp.stack([at_exit, at_entry], axis=-1)
        exit_bound, entry_bound = common.friction.bounds(
            crossing.exit_turning, crossing.entry_turning
        )
        # A tendon does not slide where it is fixed, nor where it does not go.
        holds = jnp.stack([group.visits, group.visits * (1.0 - group.ends)], axis=-1)
        limit = holds * jnp.stack([exit_bound, entry_bound], axis=-1)
        log_ratio, before = unknowns.log_ratio[number], memory.log_ratio[number]
        moved = (over_both - memory.slid[number]) / height - (log_ratio - before) / STICTION
        slid.append(over_both)
        bound.append(limit)
        imbalance.append(log_ratio - between(log_ratio + RATE * moved, limit))
    return tuple(imbalance), tuple(slid), tuple(bound)


def between(value: Float[Array, ...], limit: Float[Array, ...]) -> Float[Array, ...]:
    """Clip to +-limit; at a tie the limit is followed, so that a contact at rest can slide."""
    return jnp.where(value >= limit, limit, jnp.where(value <= -limit, -limit, value))


def at_bound(value: Float[Array, ...], limit: Float[Array, ...]) -> Float[Array, ...]:
    """+1 where a log ratio lies on its upper bound, -1 on its lower, 0 inside."""
    near = 1e-9
    return jnp.where(value >= limit - near, 1, jnp.where(value <= -limit + near, -1, 0))
