"""Rows of the wrenches on the bodies: of spans and contacts, and of external loads."""

from __future__ import annotations

from typing import cast

from jaxtyping import Array, Float

from notchflex._jax import jax, jnp
from notchflex.loads.applied import BodyLoads, body_wrench
from notchflex.mechanics.motion import Motion, skew, wrench_turn
from notchflex.solver.linear_step.tendon_jacobian import (
    StateJacobians,
)
from notchflex.solver.residual import span_mask


def wrench_rows(jacobians: StateJacobians) -> tuple[Float[Array, "n w z"], list[Array]]:
    """Compute the rows of the resultant on the distal body and beyond, and of its reactions."""
    chain, unit, wrenches = jacobians.chain, jacobians.unit, jacobians.at.wrenches
    assert wrenches is not None
    terminating = _terminating_rows(jacobians)
    resultant = terminating[:, 0]
    if unit.transmitted:
        resultant = resultant + unit.transmitted[0][None]
    to_previous = []
    for number in range(1, chain.window):
        rows = terminating[:, number]
        if number < len(unit.transmitted):
            rows = rows + unit.transmitted[number][None]
        beyond = wrenches.terminating[:, number] + wrenches.transmitted[:, number]
        to_previous.append(_hand_back(jacobians, rows, beyond))
    if jacobians.applied is not None and jacobians.motion.turn is not None:
        external = _external_rows(jacobians, jacobians.motion.turn)
        resultant = resultant + external
        back = _hand_back(jacobians, external, cast("Array", wrenches.external))
        to_previous.append(back if chain.follows else back[:, : jacobians.motion.turn.shape[1]])
    return resultant, to_previous


def _terminating_rows(jacobians: StateJacobians) -> Float[Array, "n window w z"]:
    """Compute the rows of wrenches of spans and contacts that end at the distal body."""
    chain, at, unit = jacobians.chain, jacobians.at, jacobians.unit
    assert at.wrenches is not None
    terminating = jnp.zeros((*at.wrenches.terminating.shape, unit.modes.shape[-1]))
    for group, span, tendon in zip(chain.groups, at.spans, jacobians.tendons, strict=True):
        if tendon.wrench is not None and span.crossing.wrench is not None:
            along = tendon.gap_tension[:, :, None] * span.crossing.wrench[..., None]
            pull = along + unit.spread(span.gap_tension[..., None, None] * tendon.wrench)
            reach = span_mask(chain, group.back)
            terminating = terminating - jnp.einsum("ntwz,ntk->nkwz", pull, reach)
    for group, response, force, unit_force, contact in zip(
        chain.contact_pairs,
        at.contacts,
        jacobians.unknowns.contact_force,
        unit.contact_pairs,
        jacobians.contacts,
        strict=True,
    ):
        if contact.wrench is not None and response.wrench is not None:
            along = unit_force[None, :, None] * response.wrench[..., None]
            along = along + unit.spread(force[..., None, None] * contact.wrench)
            push = group.has_contact[..., None, None] * along
            reach = span_mask(chain, group.back)
            terminating = terminating + jnp.einsum("nlwz,nlk->nkwz", push, reach)
    return terminating


def _hand_back(
    jacobians: StateJacobians, rows: Float[Array, "n w z"], wrench: Float[Array, "n w"]
) -> Float[Array, "n w z"]:
    """Transform rows of a wrench that moves with the distal body to the previous frame."""
    turning = jax.vmap(wrench_turn)(wrench)
    turned = jnp.einsum("nvw,nwz->nvz", turning, jacobians.motion.relative[0])
    pose = cast("Motion", jacobians.at.flexure.pose)
    return jax.vmap(Motion.wrench)(pose, rows + jacobians.unit.spread(turned))


def _external_rows(jacobians: StateJacobians, turn: Float[Array, "n a z"]) -> Float[Array, "n w z"]:
    """Compute the rows of the external loads on the distal body and beyond."""
    chain, at, unit = jacobians.chain, jacobians.at, jacobians.unit
    assert at.wrenches is not None
    assert at.wrenches.external is not None
    assert at.rotation is not None
    on_bodies = jax.tree.map(lambda leaf: leaf[1:], jacobians.applied)
    on_body = jnp.einsum("nwa,naz->nwz", jax.vmap(_by_turn)(at.rotation, on_bodies), turn)
    if chain.follows:
        return unit.external[None] + on_body
    # Dead forces keep their direction: they rotate relative to the body.
    axes = turn.shape[1]
    against = -jax.vmap(wrench_turn)(at.wrenches.external)[:, axes:, :axes]
    forces = jnp.einsum("nwa,naz->nwz", against, turn)
    return jnp.concatenate([unit.external[None] + on_body[:, :axes], forces], axis=1)


def _by_turn(rotation: Array, load: BodyLoads) -> Float[Array, "w a"]:
    """Differentiate a body's loads by its rotation about its own axes."""
    axes = 3 if len(rotation) == 3 else 1

    def at_turn(turn: Array) -> Array:
        return body_wrench(rotation @ (jnp.eye(len(rotation)) + skew(turn)), load)

    return jax.jacfwd(at_turn)(jnp.zeros(axes))
