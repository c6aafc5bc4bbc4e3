"""One flexure with its tendons: the balance that its unknowns must meet.

The chain is a row of such elements. Seen from one of them, the rest of the robot enters only by
what the tendons carry from the base side (`carried`) and by what comes back from the tip side
(`Beyond`). That is what makes the linear step a sweep along the chain (`sweep.py`).
"""

from __future__ import annotations

from typing import Any, NamedTuple

import equinox as eqx
from jaxtyping import Array, Float

from notchflex._jax import jnp
from notchflex.chain import Chain
from notchflex.flexure import FlexureState, Rod
from notchflex.friction import FrictionLaw
from notchflex.material import SectionLaw
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
        lip_force: Contact force of its lips, N.
        log_ratio: ln(tension on the base side / tip side) at both edges of its gap, for each
            group of tendons.
    """

    modes: Float[Array, "*n modes"]
    lip_force: Float[Array, "*n"]
    log_ratio: tuple[Float[Array, "*n t 2"], ...]


class Beyond(NamedTuple):
    """What the part of the robot beyond a body hands back to it.

    Attributes:
        wrench: Moment and force on everything beyond, about the body's origin in its frame;
            None where no force acts on any body.
        reaction: For each group of tendons, the pull on the point where it leaves the body.
        drawn: For each group, how much tendon the shape beyond has set free, mm.
        stretch: For each group, sum of tension times length beyond, N mm.
    """

    wrench: Float[Array, " 6"] | None
    reaction: tuple[Any, ...]
    drawn: tuple[Float[Array, " t"], ...]
    stretch: tuple[Float[Array, " t"], ...]


class Memory(NamedTuple):
    """What a flexure's contacts remember: log ratios and the tendon slid over them (mm)."""

    log_ratio: tuple[Float[Array, "*n t 2"], ...]
    slid: tuple[Float[Array, "*n t 2"], ...]


class Element(eqx.Module):
    """Constants of one flexure, cut from the chain along its leading axis."""

    rod: Rod
    memory: Any
    groups: tuple[TendonGroup, ...]
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
        behind: What is handed back to the proximal body.
        crossings: State of its tendons.
        slid: Tendon slid over both edges toward the base, mm, by the memory's stiffness.
        bound: Largest magnitude of the log ratio at both edges.
    """

    residual: Unknowns
    behind: Beyond
    crossings: tuple[Crossing, ...]
    slid: tuple[Float[Array, "t 2"], ...]
    bound: tuple[Float[Array, "t 2"], ...]


def elements(chain: Chain) -> Element:
    """All elements of a chain, with the flexures as leading axis."""
    return Element(
        rod=chain.rods,
        memory=chain.memory,
        groups=chain.groups,
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


def nothing_beyond(chain: Chain) -> Beyond:
    """What comes back from beyond the tip."""
    nothing = tuple(jnp.zeros(len(group.numbers)) for group in chain.groups)
    return Beyond(
        wrench=jnp.zeros(6) if chain.forces_on_bodies else None,
        reaction=tuple(group.no_reaction() for group in chain.groups),
        drawn=nothing,
        stretch=nothing,
    )


def cross(
    element: Element,
    flexure: FlexureState,
    unknowns: Unknowns,
    carried: tuple[Any, ...],
    reaction: tuple[Any, ...],
) -> tuple[Crossing, ...]:
    """Take all groups of tendons over one flexure."""
    return tuple(
        group.cross(element.rod, flexure, log_ratio, brought, back)
        for group, log_ratio, brought, back in zip(
            element.groups, unknowns.log_ratio, carried, reaction, strict=True
        )
    )


def element_result(
    element: Element,
    common: Shared,
    flexure: FlexureState,
    unknowns: Unknowns,
    memory: Memory,
    carried: tuple[Any, ...],
    beyond: Beyond,
) -> ElementResult:
    """Judge one element.

    The balance is that of virtual work with the tendon's true work, -T times the change of its
    span lengths, so that normal and friction forces need not be summed.
    """
    crossings = cross(element, flexure, unknowns, carried, beyond.reaction)
    balance = flexure.internal - unknowns.lip_force * flexure.lip_slope
    for crossing in crossings:
        balance = balance + crossing.pull
    wrench = beyond.wrench
    if wrench is not None and flexure.pose is not None and flexure.twist is not None:
        for crossing in crossings:
            if crossing.wrench is not None:
                wrench = wrench + crossing.wrench
        balance = balance - flexure.twist.T @ wrench
        wrench = flexure.pose.wrench(wrench)
    behind = Beyond(
        wrench=wrench,
        reaction=tuple(crossing.reaction for crossing in crossings),
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
    height = jnp.sum(element.rod.length)
    slid, bound, friction_residual = [], [], []
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
        friction_residual.append(log_ratio - between(log_ratio + RATE * moved, limit))
    # Signorini's condition, lip_force >= 0, gap >= 0, product 0, as one equation.
    pressed = unknowns.lip_force - element.lip_stiffness * flexure.lip_gap
    return ElementResult(
        residual=Unknowns(
            modes=balance / element.stiffness,
            lip_force=(unknowns.lip_force - jnp.where(pressed > 0.0, pressed, 0.0))
            / (element.lip_stiffness * height),
            log_ratio=tuple(friction_residual),
        ),
        behind=behind,
        crossings=crossings,
        slid=tuple(slid),
        bound=tuple(bound),
    )


def between(value: Float[Array, ...], limit: Float[Array, ...]) -> Float[Array, ...]:
    """Clip to +-limit; at a tie the limit is followed, so that a contact at rest can slide."""
    return jnp.where(value >= limit, limit, jnp.where(value <= -limit, -limit, value))


def at_bound(value: Float[Array, ...], limit: Float[Array, ...]) -> Float[Array, ...]:
    """+1 where a log ratio lies on its upper bound, -1 on its lower, 0 inside."""
    near = 1e-9
    return jnp.where(value >= limit - near, 1, jnp.where(value <= -limit + near, -1, 0))
