"""How a solved state changes with all that it was found from: derivatives by one linear step.

Newton's iteration itself is not differentiated. Where it has arrived, one more of its steps is
nothing; but its derivative, with the linear system held still, is the derivative of the solution
(implicit function theorem), forward and backward, and along a path through the memory.
"""

from __future__ import annotations

from typing import Any, NamedTuple

from jaxtyping import Array, Bool, Float, Int

from notchflex._jax import jax, jnp
from notchflex.loads.command import Command
from notchflex.mechanics.chain import Chain
from notchflex.solver.actuation import stroke
from notchflex.solver.continuation import interpolate_command
from notchflex.solver.element import Memory
from notchflex.solver.linear_step.block_elimination import Iterate, linear_step
from notchflex.solver.residual import evaluate
from notchflex.solver.solver_state import SolverState


class SubstepHistory(NamedTuple):
    """How the solver reached a state from the one before, from `LoadStepResult`.

    Attributes:
        between: The state before the last part of the load.
        part_before: Part of the way at which it is.
        parts: How many parts the load was cut into.
        reached: Whether the load was reached.
    """

    between: SolverState
    part_before: Float[Array, ""]
    parts: Int[Array, ""]
    reached: Bool[Array, ""]


# From rest, loads on the bodies come on before the tendons; and a load that fails is halved.
_PARTS_FOLLOWED = 2


def attach_derivatives(
    chain: Chain, command: Command, last: SolverState, solved: SolverState, way: SubstepHistory
) -> SolverState:
    """Return a solved state with its derivatives by chain, command and the state before.

    Contacts and material remember: where a load was taken in two parts, the derivatives go through
    both. Of more parts only the last states are known; with memory the derivatives are then NaN.

    Args:
        chain: The chain.
        command: The load.
        last: The state before, whose memory the contacts had.
        solved: The state that was found.
        way: How it was found.

    Returns:
        The same state.
    """
    if not chain.remembers:
        return _answering_part(chain, command, last, solved, way.reached)
    known = way.reached & (way.parts <= _PARTS_FOLLOWED)
    halfway = interpolate_command(chain, command, last, _still(way.part_before))
    items = (halfway, way.between, way.parts > 1), (command, solved, jnp.array(True))

    def follow(
        before: SolverState, item: tuple[Command, SolverState, Array]
    ) -> tuple[SolverState, None]:
        towards, found, taken = item

        def answer() -> SolverState:
            return _answering_part(chain, towards, before, found, known)

        return jax.lax.cond(taken, answer, lambda: before), None

    both = jax.tree.map(lambda *leaves: jnp.stack(leaves), *items)
    return jax.lax.scan(follow, last, both)[0]


def _answering_part(
    chain: Chain, command: Command, last: SolverState, solved: SolverState, reached: Bool[Array, ""]
) -> SolverState:
    """The same of a load, or a part of one, that was solved in one go."""
    point = _still(solved.point)
    at = evaluate(chain, point.unknowns, last.memory, point.base_tension, command.applied)
    step = linear_step(chain, command, point.unknowns, last.memory, point.base_tension, at)
    moved = Iterate(step.unknowns, step.base_tension)
    point = jax.tree.map(lambda value, by: value + by, point, moved)
    at = evaluate(chain, point.unknowns, last.memory, point.base_tension, command.applied)
    memory = Memory(
        log_ratio=point.unknowns.log_ratio,
        slid=tuple(span.slid for span in at.spans),
        bound=tuple(span.bound for span in at.spans),
        material=at.flexure.memory,
    )
    drawn = stroke(chain, point.base_tension, at.base)
    answer = SolverState(point, memory, drawn, command.applied)
    return jax.tree.map(
        lambda value, varied: _varying(value, varied, reached), _still(solved), answer
    )


def _still(tree: Any) -> Any:
    return jax.tree.map(jax.lax.stop_gradient, tree)


def _varying(value: Array, varied: Array, known: Bool[Array, ""]) -> Array:
    """A value that changes as another does; its derivative is NaN where it is not known."""
    return value + _change_alone(known, varied)


@jax.custom_jvp
def _change_alone(known: Array, varied: Array) -> Array:
    """Nothing, with the derivative of a value."""
    del known
    return jnp.zeros_like(varied)


@_change_alone.defjvp
def _(primals: tuple[Array, Array], tangents: tuple[Array, Array]) -> tuple[Array, Array]:
    known, varied = primals
    return jnp.zeros_like(varied), tangents[1] * jnp.where(known, 1.0, jnp.nan)


__all__ = ["SubstepHistory", "attach_derivatives"]
