"""What the actuators demand of the tendons at the base: a tension, or a stroke."""

from __future__ import annotations

from typing import NamedTuple, cast

import numpy as np
from jaxtyping import Array, Bool, Float

from notchflex._jax import constant, jax, jnp
from notchflex.loads.applied import Applied
from notchflex.mechanics.chain import Chain
from notchflex.mechanics.contact import closing_travel
from notchflex.mechanics.flexure import fibre_stretch, of_rod
from notchflex.mechanics.tendon.wall_arc import WallArc
from notchflex.solver.residual import Base


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
    travel times its lever. One that a closing notch draws in shortens as that notch opens, without
    end.
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
            loss = np.asarray(group.present) * -slope * travel[:, None]
            reach[list(group.numbers)] = np.where(loss < 0.0, np.inf, loss).sum(axis=0)
    return reach


def command_residual(
    chain: Chain, command: Command, base_tension: Float[Array, " t"], base: Base
) -> Float[Array, " t"]:
    """How far the tendons are from what is demanded, scaled to be comparable with angles.

    A tendon drawn by stroke is slack where the robot has set free more than is drawn:
    tension >= 0, stroke set free >= stroke demanded, product 0.
    """
    scale = chain.drawn_stiffness
    missing = stroke(chain, base_tension, base) - command.value
    # Told apart, not subtracted from one another: beside a large tension the rest would be lost.
    by_stroke = jnp.where(base_tension >= scale * missing, missing, base_tension / scale)
    by_tension = (base_tension - command.value) / scale
    return command.either(by_stroke, by_tension)


# Tension up to which the stroke of an inextensible tendon is followed, in forces that close a
# notch.
_MOST_CLOSING_FORCES = 1e5


def bearable(
    chain: Chain, command: Command, base_tension: Float[Array, " t"]
) -> Bool[Array, ""] | bool:
    """Whether tensions that were found for strokes are far from what any robot can bear.

    An inextensible tendon can be drawn no further once the shape can't give; its tension would
    then be whatever rounding makes of it. One that stretches bounds its tension itself.
    """
    if command.by_stroke is None:
        return True
    most = _MOST_CLOSING_FORCES * chain.closing_force
    most = jnp.where(chain.axial_stiffness < jnp.inf, jnp.inf, most)
    return jnp.all(jnp.where(command.by_stroke, base_tension, 0.0) <= most)
