"""Conditions of the actuators on the tendons at the base: a tension, or a stroke."""

from __future__ import annotations

import numpy as np
from jaxtyping import Array, Bool, Float

from notchflex._jax import constant, jax, jnp
from notchflex.loads.command import Command
from notchflex.mechanics.chain import Chain
from notchflex.mechanics.contact import closing_travel
from notchflex.mechanics.flexure import fibre_stretch, of_rod
from notchflex.solver.residual import BaseReaction


def stroke(chain: Chain, base_tension: Float[Array, " t"], base: BaseReaction) -> Array:
    """Tendon drawn out at the base since the free robot (mm), with the file's stiffness."""
    tension_length = base.tension_length + base_tension * chain.free_length
    return base.released_length + tension_length / chain.axial_stiffness


def closing_stroke(chain: Chain) -> Float[np.ndarray, " t"]:
    """Stroke at which every notch is closed (mm), infinite where no formula gives it.

    Where every notch closes against its spine, a tendon on the wall shortens by the notch's
    travel times its lever. One that a closing notch draws in shortens as that notch opens, without
    end.
    """
    closing = np.full(chain.tendons, np.inf)
    rods = jax.tree.map(np.asarray, chain.rods)
    travel = closing_travel(rods)
    if not np.isfinite(travel).all():
        return closing
    for group in chain.groups:
        if group.fibre is not None:
            weights = of_rod(chain.rods, fibre_stretch(constant(group.fibre)))
            slope = np.einsum("ntc,nic,ni->nt", weights, rods.basis[..., 0], rods.length)
            loss = np.asarray(group.present) * -slope * travel[:, None]
            closing[list(group.numbers)] = np.where(loss < 0.0, np.inf, loss).sum(axis=0)
    return closing


def command_residual(
    chain: Chain, command: Command, base_tension: Float[Array, " t"], base: BaseReaction
) -> Float[Array, " t"]:
    """Deviation of the tendons from their command, scaled to be comparable with angles.

    A tendon driven by stroke is slack where the robot has released more than is drawn:
    tension >= 0, stroke released >= stroke commanded, product 0.
    """
    scale = chain.stroke_stiffness
    missing = stroke(chain, base_tension, base) - command.target
    # A switch, not a difference: beside a large tension the rest would be lost.
    by_stroke = jnp.where(base_tension >= scale * missing, missing, base_tension / scale)
    by_tension = (base_tension - command.target) / scale
    return command.either(by_stroke, by_tension)


def command_slopes(
    chain: Chain, command: Command, base_tension: Float[Array, " t"], base: BaseReaction
) -> tuple[Float[Array, "t t"], Float[Array, "t t"], Float[Array, "t t"]]:
    """Slopes of `command_residual` by base tension, released length and tension times length."""

    def residual(tension: Array, released_length: Array, tension_length: Array) -> Array:
        moved = BaseReaction(released_length, tension_length, base.external)
        return command_residual(chain, command, tension, moved)

    at = (base_tension, base.released_length, base.tension_length)
    return jax.jacfwd(residual, argnums=(0, 1, 2))(*jax.tree.map(jax.lax.stop_gradient, at))


# Largest tension for the stroke of an inextensible tendon, in forces that close a notch.
_MOST_CLOSING_FORCES = 1e5


def tension_is_bounded(
    chain: Chain, command: Command, base_tension: Float[Array, " t"]
) -> Bool[Array, ""] | bool:
    """Return whether the tensions of tendons driven by stroke are below what any robot could bear.

    An inextensible tendon cannot be drawn further once the shape is rigid; its tension would then
    be determined by rounding. One that stretches bounds its tension itself.
    """
    if command.by_stroke is None:
        return True
    most = _MOST_CLOSING_FORCES * chain.closing_force
    most = jnp.where(chain.axial_stiffness < jnp.inf, jnp.inf, most)
    return jnp.all(jnp.where(command.by_stroke, base_tension, 0.0) <= most)
