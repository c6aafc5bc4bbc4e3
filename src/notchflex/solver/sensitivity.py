"""Derivatives of a solved state by chain, command and previous state, from one linear step.

Newton's iteration itself is not differentiated. At the solution one more step is zero, but its
derivative, with the linear system constant, is the derivative of the solution (implicit function
theorem), in forward and reverse mode, and along a path through the memory.
"""

from __future__ import annotations

from typing import Any

from jaxtyping import Array, Bool, Float, Int

from notchflex._jax import jax, jnp
from notchflex.loads.command import Command
from notchflex.mechanics.chain import Chain
from notchflex.solver.continuation import interpolate_command
from notchflex.solver.linear_step import linear_step
from notchflex.solver.residual import Memory, SolverState, evaluate, stroke
from notchflex.solver.sheaths import aimed, state_after


def attach_derivatives(
    chain: Chain,
    command: Command,
    last: SolverState,
    solved: SolverState,
    between: SolverState,
    fraction_before: Float[Array, ""],
    substeps: Int[Array, ""],
    reached: Bool[Array, ""],
) -> SolverState:
    """Return a solved state with its derivatives by chain, command and the previous state."""
    # From rest, loads on the bodies come before the tendons, and a load step that fails is halved.
    # Contacts and material have memory: where a load took two substeps, the derivatives go through
    # both. Of more substeps only the last states are stored; with memory the derivatives are then
    # NaN.
    if not chain.remembers:
        return attach_to_part(chain, command, last, solved, reached)
    first_command = interpolate_command(chain, command, last, _stop_gradient(fraction_before))
    items = (
        (first_command, between, substeps > 1),
        (command, solved, jnp.array(True)),
    )
    has_history = reached & (substeps <= len(items))

    def follow(
        before: SolverState, item: tuple[Command, SolverState, Array]
    ) -> tuple[SolverState, None]:
        towards, solution, exists = item

        def attach() -> SolverState:
            return attach_to_part(chain, towards, before, solution, has_history)

        return jax.lax.cond(exists, attach, lambda: before), None

    both = jax.tree.map(lambda *leaves: jnp.stack(leaves), *items)
    return jax.lax.scan(follow, last, both)[0]


def attach_to_part(
    chain: Chain, command: Command, last: SolverState, solved: SolverState, reached: Bool[Array, ""]
) -> SolverState:
    """Attach the derivatives to the solution of one substep; NaN where it was not reached."""
    point = _stop_gradient(solved.point)
    evaluation, sheath = evaluate(chain, point, last.memory, command.applied), last.memory.sheath
    step = linear_step(chain, aimed(chain, command, sheath), point, last.memory, evaluation)
    point = jax.tree.map(lambda value, by: value + by, point, step)
    evaluation = evaluate(chain, point, last.memory, command.applied)
    memory = Memory(
        log_ratio=point.unknowns.log_ratio,
        slid=tuple(span.slid for span in evaluation.spans),
        bound=tuple(span.bound for span in evaluation.spans),
        material=evaluation.flexure.memory,
    )
    drawn = stroke(chain, evaluation.base)
    varied_state = state_after(chain, command, point, memory, drawn, sheath)
    return jax.tree.map(
        lambda value, varied: value + _zero_with_tangent(reached, varied),
        _stop_gradient(solved),
        varied_state,
    )


def _stop_gradient(tree: Any) -> Any:
    return jax.tree.map(jax.lax.stop_gradient, tree)


@jax.custom_jvp
def _zero_with_tangent(known: Array, varied: Array) -> Array:
    """Return zeros with the tangent of a value, NaN where that is not known."""
    return jnp.zeros_like(varied)


@_zero_with_tangent.defjvp
def _(primals: tuple[Array, Array], tangents: tuple[Array, Array]) -> tuple[Array, Array]:
    known, varied = primals
    return jnp.zeros_like(varied), tangents[1] * jnp.where(known, 1.0, jnp.nan)
