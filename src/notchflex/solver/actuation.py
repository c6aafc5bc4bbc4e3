"""Actuation of the tendons at the base: by a tension, or by a stroke."""

from __future__ import annotations

import numpy as np
from jaxtyping import Array, Bool, Float

from notchflex._jax import constant, jax, jnp
from notchflex.loads.command import Command
from notchflex.mechanics.chain import Chain
from notchflex.mechanics.contact import closing_angles
from notchflex.mechanics.flexure import fibre_stretch, of_rod
from notchflex.solver.element import Iterate
from notchflex.solver.residual import BaseReaction


def stroke(chain: Chain, base: BaseReaction) -> Float[Array, " t"]:
    """Compute the stroke from the free robot (mm), with the tendon stiffness of the file."""
    tension_length = base.tension_length + base.base_tension * chain.free_length
    return base.released_length + tension_length / chain.axial_stiffness


def closing_stroke(chain: Chain) -> Float[np.ndarray, " t"]:
    """Compute the stroke at which every notch is closed (mm); infinite where no formula exists.

    Where every notch closes against its spine, a tendon on the wall shortens by the closing angle
    times its lever arm. A tendon that lengthens as a notch closes has no such limit.
    """
    closing = np.full(chain.tendons, np.inf)
    rods = jax.tree.map(np.asarray, chain.rods)
    travel = closing_angles(rods)
    if not np.isfinite(travel).all():
        return closing
    for group in chain.groups:
        if group.fibre is not None:
            weights = of_rod(chain.rods, fibre_stretch(constant(group.fibre)))
            slope = np.einsum("ntc,nic,ni->nt", weights, rods.basis[..., 0], rods.length)
            shortening = np.asarray(group.present) * -slope * travel[:, None]
            closing[list(group.numbers)] = np.where(shortening < 0.0, np.inf, shortening).sum(
                axis=0
            )
    return closing


def command_residual(chain: Chain, command: Command, base: BaseReaction) -> Float[Array, " t"]:
    """Compute the deviation of the tendons from their command, scaled like angles.

    A tendon driven by stroke is slack where the robot has released more than is drawn:
    tension >= 0, stroke released >= stroke commanded, product 0.
    """
    scale, base_tension = chain.stroke_stiffness, base.base_tension
    missing = stroke(chain, base) - command.target
    # Switching keeps the digits that a difference with a large tension would lose.
    by_stroke = jnp.where(base_tension >= scale * missing, missing, base_tension / scale)
    by_tension = (base_tension - command.target) / scale
    return command.either(by_stroke, by_tension)


def without_slack(
    chain: Chain, command: Command, point: Iterate, reached: Float[Array, " t"]
) -> Iterate:
    """Set the tensions of slack tendons at a solved point to zero, given the strokes reached."""
    if command.by_stroke is None:
        return point
    missing = chain.stroke_stiffness * (reached - command.target)
    slack = command.by_stroke & (point.base_tension < missing)
    return point._replace(base_tension=jnp.where(slack, 0.0, point.base_tension))


def command_slopes(
    chain: Chain, command: Command, base: BaseReaction
) -> tuple[Float[Array, "t t"], Float[Array, "t t"], Float[Array, "t t"]]:
    """Differentiate `command_residual` by base tension, released length, tension times length."""

    def residual(tension: Array, released: Array, tension_length: Array) -> Array:
        moved = BaseReaction(tension, released, tension_length, base.external)
        return command_residual(chain, command, moved)

    at = (base.base_tension, base.released_length, base.tension_length)
    return jax.jacfwd(residual, argnums=(0, 1, 2))(*jax.tree.map(jax.lax.stop_gradient, at))


# Largest tension of an inextensible tendon driven by stroke, in closing forces of a notch.
_MAX_CLOSING_FORCES = 1e5


def tension_is_bounded(chain: Chain, command: Command, point: Iterate) -> Bool[Array, ""] | bool:
    """Return whether the tensions of tendons driven by stroke are bounded.

    Once the shape is rigid, an inextensible tendon cannot be drawn further; rounding would then
    determine its tension. An extensible tendon bounds its tension itself.
    """
    if command.by_stroke is None:
        return True
    limit = _MAX_CLOSING_FORCES * chain.closing_force
    limit = jnp.where(chain.axial_stiffness < jnp.inf, jnp.inf, limit)
    return jnp.all(jnp.where(command.by_stroke, point.base_tension, 0.0) <= limit)
