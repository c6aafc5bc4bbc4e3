"""What the actuators demand of the tendons at the base: a tension, or a stroke."""

from __future__ import annotations

import numpy as np
from jaxtyping import Array, Bool, Float

from notchflex._jax import constant, jax, jnp
from notchflex.loads.command import Command
from notchflex.mechanics.chain import Chain
from notchflex.mechanics.contact import closing_travel
from notchflex.mechanics.flexure import fibre_stretch, of_rod
from notchflex.solver.residual import Base


def stroke(chain: Chain, base_tension: Float[Array, " t"], base: Base) -> Float[Array, " t"]:
    """Tendon drawn out at the base since the free robot (mm), with the file's stiffness."""
    stretch = base.stretch + base_tension * chain.free_length
    return base.released_length + stretch / chain.axial_stiffness


def stroke_when_closed(chain: Chain) -> Float[np.ndarray, " t"]:
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
        if group.fibre is not None:
            weights = of_rod(chain.rods, fibre_stretch(constant(group.fibre)))
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
    scale = chain.stroke_stiffness
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
