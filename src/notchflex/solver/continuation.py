"""From one solved state to the next: the load at once, or in parts where that fails."""

from __future__ import annotations

from functools import partial
from typing import NamedTuple

import numpy as np
from jaxtyping import Array, Bool, Float, Int

from notchflex._jax import constant, jax, jnp
from notchflex.loads.applied import BodyLoads
from notchflex.loads.command import Command
from notchflex.mechanics.chain import Chain
from notchflex.solver.element import Memory, Unknowns
from notchflex.solver.friction_predictor import predict_log_ratios
from notchflex.solver.newton import Iterate, NewtonResult, Settings, newton


class SolverState(NamedTuple):
    """A solved state and all that the next one needs: the state that can be saved.

    Attributes:
        point: Unknowns and base tensions.
        memory: What the contacts remember, as of this state.
        stroke: Tendon drawn out at the base, mm.
        applied: Other loads on the bodies; None for a chain assembled for tendons alone.
    """

    point: Iterate
    memory: Memory
    stroke: Float[Array, " t"]
    applied: BodyLoads | None


class LoadStepResult(NamedTuple):
    """What came of one load.

    Attributes:
        solved: The last solved state: that of the load, or as far as it could be followed.
        residual: Largest scaled imbalance of the last attempt.
        iterations: Newton iterations, all parts together.
        converged: Whether the load was reached.
        reached: Part of the way from the state before to the load that was reached.
        parts: How many parts of the way were solved one after the other.
        between: The state before the last of them, whose memory the contacts had in it.
        part_before: Part of the way at which that state is.
    """

    solved: SolverState
    residual: Float[Array, ""]
    iterations: Int[Array, ""]
    converged: Bool[Array, ""]
    reached: Float[Array, ""]
    parts: Int[Array, ""]
    between: SolverState
    part_before: Float[Array, ""]


# A state on the way, of which memory alone is left, need not be within the tolerance, but within
# this multiple of it, and this imbalance.
_ON_THE_WAY, _AT_MOST = 1e3, 1e-10
# Part of the way at which the other loads are on, where they come before the tendons.
_LOADS_ON = 0.5


def at_rest(chain: Chain) -> SolverState:
    """The free robot with slack tendons that have not yet slid."""
    none = tuple(constant(np.zeros((*group.present.shape, 2))) for group in chain.groups)
    unknowns = Unknowns(
        modes=constant(np.zeros(chain.stiffness.shape)),
        contact_force=tuple(
            constant(np.zeros(group.has_contact.shape)) for group in chain.contact_pairs
        ),
        log_ratio=none,
    )
    slack = constant(np.zeros(chain.tendons))
    return SolverState(Iterate(unknowns, slack), Memory(none, none, none), slack, unloaded(chain))


def unloaded(chain: Chain) -> BodyLoads | None:
    """No loads on any body, as a chain takes them."""
    if not chain.loaded:
        return None
    bodies = chain.flexures + 1
    d, a = (3, 3) if chain.frame is None else (2, 1)
    shapes = ((d,), (a,), (d, d), (a + d,))
    return BodyLoads(*(constant(np.zeros((bodies, *shape))) for shape in shapes))


def solve_load_step(
    chain: Chain,
    command: Command,
    last: SolverState,
    settings: Settings,
) -> LoadStepResult:
    """Follow a load from a solved state.

    The whole way is tried first. Where Newton's method fails, the way is halved until it
    succeeds, and lengthened again after; memory is kept only of parts that converged.

    Where all tendons are slack before, other loads come on first, with slack tendons, and then all
    tensions together: half the way each.

    Args:
        chain: The chain.
        command: The load.
        last: The solved state before.
        settings: How hard to try.

    Returns:
        What came of it.
    """
    loads_first = _loads_first(chain, last)

    def attempt(solved: SolverState, part: Array) -> tuple[NewtonResult, Command]:
        wanted = interpolate_command(chain, command, last, part)
        tension = wanted.either(solved.point.base_tension, wanted.value)
        guess = predict_log_ratios(chain, solved.point.base_tension, tension, solved.memory)
        start = Iterate(solved.point.unknowns._replace(log_ratio=guess), tension)
        before = solved.point.base_tension
        enough = jnp.minimum(_ON_THE_WAY * settings.tolerance, _AT_MOST)
        enough = jnp.where(part < 1.0, enough, 0.0)
        found = newton(chain, wanted, solved.memory, before, start, settings, enough)
        return found, wanted

    def going(state: tuple[LoadStepResult, Array, Array]) -> Bool[Array, ""]:
        advanced, part, tries = state
        return (
            ~advanced.converged
            & (part >= settings.smallest_load_step)
            & (tries < settings.max_load_steps)
            & (advanced.iterations < settings.max_all_iterations)
        )

    def follow(state: tuple[LoadStepResult, Array, Array]) -> tuple[LoadStepResult, Array, Array]:
        advanced, part, tries = state
        stop = jnp.where(loads_first & (advanced.reached < _LOADS_ON), _LOADS_ON, 1.0)
        aim = jnp.minimum(advanced.reached + part, stop)
        found, wanted = attempt(advanced.solved, aim)
        remembered = Memory(found.point.unknowns.log_ratio, found.slid, found.bound)
        solved = jax.tree.map(
            lambda old, new: jnp.where(found.converged, new, old),
            advanced.solved,
            SolverState(found.point, remembered, found.stroke, wanted.applied),
        )
        advanced = LoadStepResult(
            solved=solved,
            residual=found.residual,
            iterations=advanced.iterations + found.iterations,
            converged=found.converged & (aim >= 1.0),
            reached=jnp.where(found.converged, aim, advanced.reached),
            parts=advanced.parts + found.converged,
            between=jax.tree.map(
                lambda old, new: jnp.where(found.converged, new, old),
                advanced.between,
                advanced.solved,
            ),
            part_before=jnp.where(found.converged, advanced.reached, advanced.part_before),
        )
        return advanced, jnp.where(found.converged, 2.0 * part, 0.5 * part), tries + 1

    start = LoadStepResult(
        solved=last,
        residual=jnp.array(jnp.inf),
        iterations=jnp.zeros((), int),
        converged=jnp.array(False),
        reached=jnp.zeros(()),
        parts=jnp.zeros((), int),
        between=last,
        part_before=jnp.zeros(()),
    )
    advanced, _, _ = jax.lax.while_loop(going, follow, (start, jnp.ones(()), jnp.zeros((), int)))
    return advanced


def interpolate_command(
    chain: Chain, command: Command, last: SolverState, part: Float[Array, ""]
) -> Command:
    """The command at a part of the way from a solved state; exactly the wanted one at its end."""
    loads_first = _loads_first(chain, last)
    from_here = command.either(last.stroke, last.point.base_tension)
    for_loads = jnp.where(loads_first, jnp.minimum(2.0 * part, 1.0), part)
    for_tendons = jnp.where(loads_first, jnp.maximum(2.0 * part - 1.0, 0.0), part)
    only_loads = loads_first & (for_tendons == 0.0)
    return Command(
        value=jnp.where(only_loads, 0.0, between(from_here, command.value, for_tendons)),
        by_stroke=None if command.by_stroke is None else command.by_stroke & ~only_loads,
        applied=jax.tree.map(partial(between, part=for_loads), last.applied, command.applied),
    )


def _loads_first(chain: Chain, last: SolverState) -> Bool[Array, ""]:
    """Whether other loads come on before the tendons."""
    slack = jnp.all(last.point.base_tension == 0.0)
    return slack if chain.loaded else jnp.array(False)


def between(start: Float[Array, ...], end: Float[Array, ...], part: Array) -> Array:
    """A value at a part of the way from one to another; exactly the other at its end."""
    return jnp.where(part >= 1.0, end, start + part * (end - start))
