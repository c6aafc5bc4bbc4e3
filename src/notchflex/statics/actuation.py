"""What the actuators demand of the tendons at the base: a tension, or a stroke."""

from __future__ import annotations

from typing import NamedTuple, cast

import numpy as np
from jaxtyping import Array, Bool, Float

from notchflex._jax import constant, jax, jnp
from notchflex.chain import Chain
from notchflex.contact import closing_travel
from notchflex.flexure import fibre_stretch, of_rod
from notchflex.statics.applied import Applied
from notchflex.statics.walk import Base
from notchflex.tendon.wall_arc import WallArc


class Command(NamedTuple):
    """Demand on every tendon, and the other loads.

    Attributes:
        value: Tension (N) or stroke (mm).
        by_stroke: Whether it is a stroke; None where all are tensions.
        applied: Other loads on the bodies; None for a chain assembled for tendons alone.
    """

    value: Float[Array, " t"]
    by_stroke: Bool[Array, " t"] | None
    applied: Applied | None

    def either(self, by_stroke: Array, by_tension: Array) -> Array:
        """Of two values per tendon the one that belongs to what is demanded of it."""
        return (
            by_tension
            if self.by_stroke is None
            else jnp.where(self.by_stroke, by_stroke, by_tension)
        )


def tensions_alone(value: Float[np.ndarray, "s t"]) -> Command:
    """Tensions of every tendon (N), loads as leading axis, and nothing else."""
    return Command(constant(value), None, None)


def filled(commands: Command, flexures: int, by_stroke: bool) -> Command:
    """Loads, as leading axis, for a chain with more flexures that carry none.

    Args:
        commands: The loads.
        flexures: How many flexures the chain has.
        by_stroke: Whether they are to stand beside loads by stroke.
    """
    drawn, others = commands.by_stroke, commands.applied
    if by_stroke and drawn is None:
        drawn = cast("Array", np.zeros(commands.value.shape, bool))
    if others is not None:
        more = flexures + 1 - others.dead_force.shape[1]
        others = jax.tree.map(
            lambda leaf: np.pad(leaf, [(0, 0), (0, more)] + [(0, 0)] * (leaf.ndim - 2)), others
        )
    return Command(commands.value, drawn, others)


def stroke(chain: Chain, base_tension: Float[Array, " t"], base: Base) -> Float[Array, " t"]:
    """Tendon drawn out at the base since the free robot (mm), with the file's stiffness."""
    stretch = base.stretch + base_tension * chain.free_length
    return base.drawn + stretch / chain.axial_stiffness


def drawn_when_closed(chain: Chain) -> Float[np.ndarray, " t"]:
    """Stroke at which every notch is closed (mm), infinite where that is not known beforehand.

    Where every notch closes against its spine, a tendon on the wall shortens by the notch's
    travel times its lever.
    """
    reach = np.full(chain.tendons, np.inf)
    rods = jax.tree.map(np.asarray, chain.rods)
    travel = closing_travel(rods)
    if not np.isfinite(travel).all():
        return reach
    for group in chain.groups:
        if isinstance(group, WallArc):
            weights = of_rod(chain.rods, fibre_stretch(constant(group.across)))
            slope = np.einsum("ntc,nic,ni->nt", weights, rods.basis[..., 0], rods.length)
            loss = np.asarray(group.present) * np.maximum(-slope * travel[:, None], 0.0)
            reach[list(group.numbers)] = loss.sum(axis=0)
    return reach


def command_residual(
    chain: Chain, command: Command, base_tension: Float[Array, " t"], base: Base
) -> Float[Array, " t"]:
    """How far the tendons are from what is demanded, scaled to be comparable with angles.

    A tendon drawn by stroke is slack where the robot has set free more than is drawn:
    tension >= 0, stroke set free >= stroke demanded, product 0.
    """
    scale = chain.drawn_stiffness
    pressed = base_tension + scale * (command.value - stroke(chain, base_tension, base))
    by_stroke = base_tension - jnp.where(pressed >= 0.0, pressed, 0.0)
    by_tension = base_tension - command.value
    return command.either(by_stroke, by_tension) / scale
