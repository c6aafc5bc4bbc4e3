"""How a solved state changes with all that it was found from: derivatives by one linear step.

Newton's iteration itself is not differentiated. Where it has arrived, one more of its steps is
nothing; but its derivative, with the linear system held still, is the derivative of the solution
(implicit function theorem), forward and backward, and along a path through the memory.
"""

from __future__ import annotations

from typing import Any

from jaxtyping import Array, Bool

from notchflex._jax import jax, jnp
from notchflex.chain import Chain
from notchflex.statics.actuation import Command, stroke
from notchflex.statics.element import Memory
from notchflex.statics.newton import Point, Settings
from notchflex.statics.stepping import Advance, Solved, advance
from notchflex.statics.sweep import linear_step
from notchflex.statics.walk import evaluate


def advance_smoothly(chain: Chain, command: Command, last: Solved, settings: Settings) -> Advance:
    """Follow a load from a solved state, as `advance`, with derivatives by all it takes.

    They are those of the load taken in one go, and NaN where it was not reached: memory of parts of
    a load cut into several is not followed.
    """
    came = advance(*_still((chain, command, last, settings)))
    return came._replace(solved=answering(chain, command, last, came.solved, came.converged))


def answering(
    chain: Chain, command: Command, last: Solved, solved: Solved, reached: Bool[Array, ""]
) -> Solved:
    """A solved state with its derivatives by chain, command and the state before.

    Args:
        chain: The chain.
        command: The load.
        last: The state before, whose memory the contacts had.
        solved: The state that was found.
        reached: Whether it is the answer to that load.

    Returns:
        The same state.
    """
    point = _still(solved.point)
    at = evaluate(chain, point.unknowns, last.memory, point.base_tension, command.applied)
    step = linear_step(chain, command, point.unknowns, last.memory, point.base_tension, at)
    moved = Point(step.unknowns, step.base_tension)
    point = jax.tree.map(lambda value, by: value + by, point, moved)
    at = evaluate(chain, point.unknowns, last.memory, point.base_tension, command.applied)
    memory = Memory(
        log_ratio=point.unknowns.log_ratio,
        slid=tuple(span.slid for span in at.spans),
        bound=tuple(span.bound for span in at.spans),
    )
    drawn = stroke(chain, point.base_tension, at.base)
    answer = Solved(point, memory, drawn, command.applied)
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


__all__ = ["advance_smoothly", "answering"]
