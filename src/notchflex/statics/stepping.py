"""From one solved state to the next: the load at once, or in parts where that fails."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from jaxtyping import Array, Bool, Float, Int

from notchflex._jax import constant, jax, jnp
from notchflex.chain import Chain
from notchflex.statics.actuation import Command
from notchflex.statics.element import Memory, Unknowns
from notchflex.statics.newton import NewtonResult, Point, Settings, newton


class Solved(NamedTuple):
    """A solved state and all that the next one needs: the state that can be saved.

    Attributes:
        point: Unknowns and base tensions.
        memory: What the contacts remember, as of this state.
        stroke: Tendon drawn out at the base, mm.
    """

    point: Point
    memory: Memory
    stroke: Float[Array, " t"]


class Advance(NamedTuple):
    """What came of one load.

    Attributes:
        solved: The last solved state: that of the load, or as far as it could be followed.
        residual: Largest scaled imbalance of the last attempt.
        iterations: Newton iterations, all parts together.
        converged: Whether the load was reached.
        reached: Part of the way from the state before to the load that was reached.
    """

    solved: Solved
    residual: Float[Array, ""]
    iterations: Int[Array, ""]
    converged: Bool[Array, ""]
    reached: Float[Array, ""]


def at_rest(chain: Chain) -> Solved:
    """The free robot with slack tendons that have not yet slid."""
    none = tuple(constant(np.zeros((*group.present.shape, 2))) for group in chain.groups)
    unknowns = Unknowns(
        modes=constant(np.zeros(chain.stiffness.shape)),
        lip_force=constant(np.zeros(chain.flexures)),
        log_ratio=none,
    )
    slack = constant(np.zeros(chain.tendons))
    return Solved(Point(unknowns, slack), Memory(none, none), slack)


def advance(chain: Chain, command: Command, last: Solved, settings: Settings) -> Advance:
    """Follow a load from a solved state.

    The whole way is tried first. Where Newton's method fails, the way is halved until it
    succeeds, and lengthened again after; memory is kept only of parts that converged.

    Args:
        chain: The chain.
        command: The load.
        last: The solved state before.
        settings: How hard to try.

    Returns:
        What came of it.
    """
    from_here = jnp.where(command.by_stroke, last.stroke, last.point.base_tension)

    def attempt(solved: Solved, part: Array) -> NewtonResult:
        value = jnp.where(
            part >= 1.0, command.value, from_here + part * (command.value - from_here)
        )
        tension = jnp.where(command.by_stroke, solved.point.base_tension, value)
        start = Point(solved.point.unknowns, tension)
        return newton(chain, Command(value, command.by_stroke), solved.memory, start, settings)

    def going(state: tuple[Advance, Array, Array]) -> Bool[Array, ""]:
        advanced, part, tries = state
        return (
            ~advanced.converged
            & (part >= settings.smallest_load_step)
            & (tries < settings.max_load_steps)
        )

    def follow(state: tuple[Advance, Array, Array]) -> tuple[Advance, Array, Array]:
        advanced, part, tries = state
        aim = jnp.minimum(advanced.reached + part, 1.0)
        found = attempt(advanced.solved, aim)
        remembered = Memory(found.point.unknowns.log_ratio, found.slid)
        solved = jax.tree.map(
            lambda old, new: jnp.where(found.converged, new, old),
            advanced.solved,
            Solved(found.point, remembered, found.stroke),
        )
        advanced = Advance(
            solved=solved,
            residual=found.residual,
            iterations=advanced.iterations + found.iterations,
            converged=found.converged & (aim >= 1.0),
            reached=jnp.where(found.converged, aim, advanced.reached),
        )
        return advanced, jnp.where(found.converged, 2.0 * part, 0.5 * part), tries + 1

    start = Advance(
        solved=last,
        residual=jnp.array(jnp.inf),
        iterations=jnp.zeros((), int),
        converged=jnp.array(False),
        reached=jnp.zeros(()),
    )
    advanced, _, _ = jax.lax.while_loop(going, follow, (start, jnp.ones(()), jnp.zeros((), int)))
    return advanced
