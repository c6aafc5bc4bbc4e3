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


def wrench_rows(here: StateJacobians) -> tuple[Float[Array, "n w z"], list[Array]]:
    """Return rows of the resultant on the distal body and beyond, and of wrenches handed back."""
    chain, unit, wrenches = here.chain, here.unit, here.at.wrenches
    assert wrenches is not None
    terminating = _terminating_rows(here)
    resultant = terminating[:, 0]
    if unit.transmitted:
        resultant = resultant + unit.transmitted[0][None]
    behind = []
    for number in range(1, chain.window):
        rows = terminating[:, number]
        if number < len(unit.transmitted):
            rows = rows + unit.transmitted[number][None]
        beyond = wrenches.terminating[:, number] + wrenches.transmitted[:, number]
        behind.append(_hand_back(here, rows, beyond))
    if here.applied is not None and here.motion.turn is not None:
        external = _external_rows(here, here.motion.turn)
        resultant = resultant + external
        back = _hand_back(here, external, cast("Array", wrenches.external))
        behind.append(back if chain.follows else back[:, : here.motion.turn.shape[1]])
    return resultant, behind


def _terminating_rows(here: StateJacobians) -> Float[Array, "n window w z"]:
    """Rows of the wrenches of spans and contacts that end at the distal body."""
    chain, at, unit = here.chain, here.at, here.unit
    assert at.wrenches is not None
    terminating = jnp.zeros((*at.wrenches.terminating.shape, unit.modes.shape[-1]))
    for group, span, tendon in zip(chain.groups, at.spans, here.tendons, strict=True):
        if tendon.wrench is not None and span.crossing.wrench is not None:
            along = tendon.gap_tension[:, :, None] * span.crossing.wrench[..., None]
            pull = along + unit.spread(span.gap_tension[..., None, None] * tendon.wrench)
            reach = span_mask(chain, group.back)
            terminating = terminating - jnp.einsum("ntwz,ntk->nkwz", pull, reach)
    for group, response, force, unit_force, contact in zip(
        chain.contact_pairs,
        at.contacts,
        here.unknowns.contact_force,
        unit.contact_pairs,
        here.contacts,
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
    here: StateJacobians, rows: Float[Array, "n w z"], wrench: Float[Array, "n w"]
) -> Float[Array, "n w z"]:
    """Rows of a wrench that moves with the distal body, in the frame of the body before."""
    turning = jax.vmap(wrench_turn)(wrench)
    turned = jnp.einsum("nvw,nwz->nvz", turning, here.motion.relative[0])
    pose = cast("Motion", here.at.flexure.pose)
    return jax.vmap(Motion.wrench)(pose, rows + here.unit.spread(turned))


def _external_rows(here: StateJacobians, turn: Float[Array, "n a z"]) -> Float[Array, "n w z"]:
    """Rows of the external loads on the distal body and beyond."""
    chain, at, unit = here.chain, here.at, here.unit
    assert at.wrenches is not None
    assert at.wrenches.external is not None
    assert at.rotation is not None
    on_bodies = jax.tree.map(lambda leaf: leaf[1:], here.applied)
    on_body = jnp.einsum("nwa,naz->nwz", jax.vmap(_by_turn)(at.rotation, on_bodies), turn)
    if chain.follows:
        return unit.external[None] + on_body
    # All forces together keep their direction: they turn against the body.
    axes = turn.shape[1]
    against = -jax.vmap(wrench_turn)(at.wrenches.external)[:, axes:, :axes]
    forces = jnp.einsum("nwa,naz->nwz", against, turn)
    return jnp.concatenate([unit.external[None] + on_body[:, :axes], forces], axis=1)


def _by_turn(rotation: Array, load: BodyLoads) -> Float[Array, "w a"]:
    """Slope of a body's loads by the turn of the body about its own axes."""
    axes = 3 if len(rotation) == 3 else 1

    def at_turn(turn: Array) -> Array:
        return body_wrench(rotation @ (jnp.eye(len(rotation)) + skew(turn)), load)

    return jax.jacfwd(at_turn)(jnp.zeros(axes))
