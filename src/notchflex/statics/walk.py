"""The two walks along the chain that evaluate its balance under given unknowns."""

from __future__ import annotations

from typing import Any, NamedTuple

from jaxtyping import Array, Float

from notchflex._jax import jax, jnp
from notchflex.chain import Chain, flexure_states
from notchflex.flexure import FlexureState
from notchflex.statics.applied import Applied
from notchflex.statics.element import (
    Beyond,
    Carried,
    ElementResult,
    Memory,
    Unknowns,
    cross,
    element_result,
    elements,
    leave_base,
    nothing_beyond,
    shared,
)


class Evaluation(NamedTuple):
    """The whole chain evaluated.

    Attributes:
        flexure: State of every flexure, flexures as leading axis.
        result: Every element's result.
        carried: What each element got from the base side.
        beyond: What each element got from the tip side.
        base: What comes back to the base.
    """

    flexure: FlexureState
    result: ElementResult
    carried: Carried
    beyond: Beyond
    base: Beyond


def evaluate(
    chain: Chain,
    unknowns: Unknowns,
    memory: Memory,
    base_tension: Float[Array, " t"],
    applied: Applied | None,
) -> Evaluation:
    """Walk from base to tip with the tensions, then back with the pulls, judging every element.

    Args:
        chain: The chain.
        unknowns: Its unknowns, flexures as leading axis.
        memory: What its contacts remember.
        base_tension: Tension of every tendon at the base, N.
        applied: Other loads on the bodies; None for a chain assembled for tendons alone.

    Returns:
        The evaluation.
    """
    every, common, end = elements(chain, applied), shared(chain), nothing_beyond(chain)
    flexures = flexure_states(chain, unknowns.modes, with_pose=chain.forces_on_bodies)

    def outward(carried: Any, item: Any) -> tuple[Any, Any]:
        # Tension, and where the tendon is, do not depend on what comes back from the tip.
        element, flexure, own = item
        *_, onward = cross(element, flexure, own, carried, end)
        return onward, carried

    start = leave_base(chain, base_tension)
    _, carried = jax.lax.scan(outward, start, (every, flexures, unknowns))

    def inward(beyond: Beyond, item: Any) -> tuple[Beyond, Any]:
        element, flexure, own, past, brought = item
        result = element_result(element, common, flexure, own, past, brought, beyond)
        return result.behind, (result, beyond)

    base, (result, beyond) = jax.lax.scan(
        inward, end, (every, flexures, unknowns, memory, carried), reverse=True
    )
    return Evaluation(flexures, result, carried, beyond, base)


def per_tendon(chain: Chain, grouped: tuple[Float[Array, "*shape t"], ...]) -> Array:
    """Bring values per group of tendons into the order of the robot's tendons, as last axis."""
    if not grouped:
        return jnp.zeros(0)
    order = [number for group in chain.groups for number in group.numbers]
    together = jnp.concatenate(grouped, axis=-1)
    return together[..., jnp.argsort(jnp.array(order))]
