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
from notchflex.flexure import FlexureState, flexure_state
from notchflex.motion import skew, unskew
from notchflex.statics.actuation import Command, command_residual
from notchflex.statics.applied import Applied
from notchflex.statics.element import (
    Beyond,
    Carried,
    Memory,
    Unknowns,
    element_result,
    elements,
    leave_base,
    nothing_beyond,
    shared,
)
from notchflex.statics.walk import Evaluation

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


def element_blocks(
    chain: Chain,
    unknowns: Unknowns,
    memory: Memory,
    applied: Applied | None,
    at: Evaluation,
) -> Blocks:
    """Derivatives of all elements, by differentiating each on its own, all at once.

    The flexure's own state depends on its modes alone; it is differentiated by them only.
    """
    common = shared(chain)

    def blocks(
        element: Any,
        flexure: FlexureState,
        own: Unknowns,
        past: Memory,
        carried: Carried,
        onward: Carried,
        beyond: Beyond,
    ) -> Blocks:
        flat_own, own_of = ravel_pytree(own)
        flat_beyond, beyond_of = ravel_pytree(beyond)
        no_change = jnp.zeros(changes(carried))
        ends = (len(flat_own), len(flat_own) + len(no_change))

        def flat(state: FlexureState, everything: Array) -> tuple[Array, Array, Array]:
            mine, brought, back = jnp.split(everything, ends)
            result = element_result(
                element,
                common,
                state,
                own_of(mine),
                past,
                varied(carried, brought),
                beyond_of(back),
            )
            return (
                ravel_pytree(result.residual)[0],
                change(onward, result.onward),
                ravel_pytree(result.behind)[0],
            )

        def state_at(modes: Array) -> FlexureState:
            return flexure_state(
                element.rod,
                common.law,
                element.memory,
                modes,
                with_pose=chain.forces_on_bodies,
            )

        # One direction for every number that may change; the modes, which are the first of the
        # unknowns, change the flexure's state as well.
        here = jnp.concatenate([flat_own, no_change, flat_beyond])
        others = len(here) - len(own.modes)
        by_modes = jax.tree.map(
            lambda leaf: jnp.concatenate(
                [jnp.moveaxis(leaf, -1, 0), jnp.zeros((others, *leaf.shape[:-1]))]
            ),
            jax.jacfwd(state_at)(own.modes),
        )

        def along(state_way: FlexureState, way: Array) -> tuple[Array, Array, Array]:
            return jax.jvp(flat, (flexure, here), (state_way, way))[1]

        residual, on, back = jax.vmap(along, out_axes=-1)(by_modes, jnp.eye(len(here)))
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

    return jax.vmap(blocks)(
        elements(chain, applied),
        at.flexure,
        unknowns,
        memory,
        at.carried,
        at.result.onward,
        at.beyond,
    )


def changes(carried: Carried) -> int:
    """How many numbers say how what is carried may change: three for a rotation."""
    flat, _ = ravel_pytree(carried._replace(rotation=None))
    return len(flat) + (0 if carried.rotation is None else 3)


def varied(carried: Carried, by: Float[Array, " c"]) -> Carried:
    """What is carried, changed by a little: a rotation by a rotation vector in the body's frame."""
    flat, carried_of = ravel_pytree(carried._replace(rotation=None))
    moved: Carried = carried_of(flat + by[: len(flat)])
    if carried.rotation is None:
        return moved
    turned = carried.rotation @ (jnp.eye(3) + skew(by[len(flat) :]))
    return moved._replace(rotation=turned)


def change(start: Carried, end: Carried) -> Float[Array, " c"]:
    """The change that `varied` takes, from one state to another close by."""
    first, _ = ravel_pytree(start._replace(rotation=None))
    second, _ = ravel_pytree(end._replace(rotation=None))
    if start.rotation is None or end.rotation is None:
        return second - first
    turned = unskew(start.rotation.T @ end.rotation)
    return jnp.concatenate([second - first, turned])


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
    blocks = element_blocks(chain, unknowns, memory, command.applied, at)
    residual = jax.vmap(lambda tree: ravel_pytree(tree)[0])(at.result.residual)
    nothing, beyond_of = ravel_pytree(nothing_beyond(chain))
    start = leave_base(chain, base_tension)

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

    tip = (jnp.zeros((len(nothing), changes(start))), jnp.zeros_like(nothing))
    (matrix, constant), (fixed, gain) = jax.lax.scan(
        eliminate, tip, (blocks, residual), reverse=True
    )

    leave = jax.jacfwd(lambda tension: change(start, leave_base(chain, tension)))(base_tension)
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
