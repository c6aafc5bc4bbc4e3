"""Newton's linear step by elimination along the chain: O(n), never a dense matrix.

Linearised, an element couples only to its neighbours:

    residual + A du + B dcarried + C dbeyond = 0
    dcarried_out = Yu du + Yc dcarried,   dbehind = Zu du + Zc dcarried + Zb dbeyond

From the tip on, what comes back is a linear function of what is carried,
dbeyond = P dcarried_out + c (nothing comes back from beyond the tip: P = 0, c = 0). Each element
is then eliminated in turn, which gives P and c for its neighbour; at the base only the tensions
are left. This is the elimination of a block-tridiagonal matrix from its last block.
"""

from __future__ import annotations

from typing import Any, NamedTuple

from jax.flatten_util import ravel_pytree
from jaxtyping import Array, Float

from notchflex._jax import jax, jnp
from notchflex.chain import Chain
from notchflex.flexure import flexure_state
from notchflex.statics.actuation import Command, command_residual
from notchflex.statics.element import (
    Beyond,
    Memory,
    Unknowns,
    element_result,
    elements,
    nothing_beyond,
    shared,
)
from notchflex.statics.walk import Evaluation, leave_base

_HELD = 1e-9


class Blocks(NamedTuple):
    """Derivatives of one element (names as in the head of this file)."""

    unknown: Float[Array, "u u"]
    carried: Float[Array, "u c"]
    beyond: Float[Array, "u b"]
    on_by_unknown: Float[Array, "c u"]
    on_by_carried: Float[Array, "c c"]
    back_by_unknown: Float[Array, "b u"]
    back_by_carried: Float[Array, "b c"]
    back_by_beyond: Float[Array, "b b"]


class Step(NamedTuple):
    """A linear step.

    Attributes:
        unknowns: Change of the unknowns.
        base_tension: Change of the base tensions, N.
    """

    unknowns: Unknowns
    base_tension: Float[Array, " t"]


def element_blocks(chain: Chain, unknowns: Unknowns, memory: Memory, at: Evaluation) -> Blocks:
    """Derivatives of all elements, by differentiating each on its own, all at once."""
    common = shared(chain)

    def blocks(element: Any, own: Unknowns, past: Memory, carried: Any, beyond: Beyond) -> Blocks:
        flat_own, own_of = ravel_pytree(own)
        flat_carried, carried_of = ravel_pytree(carried)
        flat_beyond, beyond_of = ravel_pytree(beyond)
        ends = (len(flat_own), len(flat_own) + len(flat_carried))

        def flat(everything: Array) -> tuple[Array, Array, Array]:
            mine, brought, back = jnp.split(everything, ends)
            unknown = own_of(mine)
            flexure = flexure_state(
                element.rod,
                common.law,
                element.memory,
                unknown.modes,
                with_pose=chain.forces_on_bodies,
            )
            result = element_result(
                element, common, flexure, unknown, past, carried_of(brought), beyond_of(back)
            )
            on = tuple(crossing.carried for crossing in result.crossings)
            parts = (result.residual, on, result.behind)
            return tuple(ravel_pytree(part)[0] for part in parts)  # type: ignore[return-value]

        residual, on, back = jax.jacfwd(flat)(
            jnp.concatenate([flat_own, flat_carried, flat_beyond])
        )
        by_unknown, by_carried, by_beyond = jnp.split(residual, ends, axis=1)
        on_by_unknown, on_by_carried, _ = jnp.split(on, ends, axis=1)
        back_by_unknown, back_by_carried, back_by_beyond = jnp.split(back, ends, axis=1)
        return Blocks(
            by_unknown,
            by_carried,
            by_beyond,
            on_by_unknown,
            on_by_carried,
            back_by_unknown,
            back_by_carried,
            back_by_beyond,
        )

    return jax.vmap(blocks)(elements(chain), unknowns, memory, at.carried, at.beyond)


def linear_step(
    chain: Chain,
    command: Command,
    unknowns: Unknowns,
    memory: Memory,
    base_tension: Float[Array, " t"],
    at: Evaluation,
) -> Step:
    """Solve the linearised balance for the step that would meet it.

    Args:
        chain: The chain.
        command: What is demanded of the tendons.
        unknowns: Where the chain is.
        memory: What its contacts remember.
        base_tension: Its base tensions, N.
        at: Its evaluation there.

    Returns:
        The step.
    """
    blocks = element_blocks(chain, unknowns, memory, at)
    residual = jax.vmap(lambda tree: ravel_pytree(tree)[0])(at.result.residual)
    nothing, beyond_of = ravel_pytree(nothing_beyond(chain))
    start, _ = ravel_pytree(leave_base(chain, base_tension))

    def eliminate(tail: Any, item: Any) -> tuple[Any, Any]:
        matrix, constant = tail
        block, imbalance = item
        seen = block.beyond @ matrix
        right = jnp.concatenate(
            [
                -(imbalance + block.beyond @ constant)[:, None],
                -(block.carried + seen @ block.on_by_carried),
            ],
            axis=1,
        )
        solution = _solve(block.unknown + seen @ block.on_by_unknown, right)
        fixed, gain = solution[:, 0], solution[:, 1:]
        back = block.back_by_beyond @ matrix
        by_unknown = block.back_by_unknown + back @ block.on_by_unknown
        by_carried = block.back_by_carried + back @ block.on_by_carried
        tail = (
            by_carried + by_unknown @ gain,
            block.back_by_beyond @ constant + by_unknown @ fixed,
        )
        return tail, (fixed, gain)

    tip = (jnp.zeros((len(nothing), len(start))), jnp.zeros_like(nothing))
    (matrix, constant), (fixed, gain) = jax.lax.scan(
        eliminate, tip, (blocks, residual), reverse=True
    )

    leave = jax.jacfwd(lambda tension: ravel_pytree(leave_base(chain, tension))[0])(base_tension)
    flat_base, _ = ravel_pytree(at.base)

    def demand(tension: Array, flat: Array) -> Array:
        return command_residual(chain, command, tension, beyond_of(flat))

    by_tension, by_base = jax.jacfwd(demand, argnums=(0, 1))(base_tension, flat_base)
    # Where every contact counts as stuck by a tie, the stroke does not depend on the tension; the
    # small entry keeps such a step finite.
    held = _HELD * jnp.diag(command.by_stroke.astype(float))
    border = by_tension + by_base @ matrix @ leave + held
    imbalance = demand(base_tension, flat_base) + by_base @ constant
    tension_step = _solve(border, -imbalance[:, None])

    def substitute(carried: Array, item: Any) -> tuple[Array, Array]:
        block, own_fixed, own_gain = item
        own = own_fixed + own_gain @ carried
        return block.on_by_unknown @ own + block.on_by_carried @ carried, own

    _, steps = jax.lax.scan(substitute, leave @ tension_step[:, 0], (blocks, fixed, gain))
    _, unknowns_of = ravel_pytree(jax.tree.map(lambda leaf: leaf[0], unknowns))
    return Step(jax.vmap(unknowns_of)(steps), tension_step[:, 0])


def _solve(matrix: Float[Array, "u u"], right: Float[Array, "u r"]) -> Float[Array, "u r"]:
    """Solution of a small system."""
    factors, pivots, _ = jax.lax.linalg.lu(matrix)
    return jax.scipy.linalg.lu_solve((factors, pivots), right)
