"""Load steps: from one solved state to the next, the whole load at once or in substeps."""

from __future__ import annotations

from functools import partial
from typing import NamedTuple

import numpy as np
from jaxtyping import Array, Bool, Float, Int

from notchflex._jax import constant, jax, jnp
from notchflex.loads.applied import BodyLoads
from notchflex.loads.command import Command
from notchflex.mechanics.chain import Chain
from notchflex.solver.block_elimination import Iterate
from notchflex.solver.element import Memory, Unknowns
from notchflex.solver.friction_predictor import predict_log_ratios
from notchflex.solver.newton import NewtonProblem, NewtonResult, Settings, newton


class SolverState(NamedTuple):
    """A solved state and all that the next one needs: the state that can be saved.

    Attributes:
        point: Unknowns and base tensions.
        memory: History of contacts and material, as of this state.
        stroke: Tendon drawn out at the base, mm.
        applied: External loads on the bodies; None for a chain assembled for tendons alone.
    """

    point: Iterate
    memory: Memory
    stroke: Float[Array, " t"]
    applied: BodyLoads | None


class LoadStepResult(NamedTuple):
    """Result of one load step.

    Attributes:
        solved: The last solved state: that of the load, or as far as it could be followed.
        residual: Largest scaled residual of the last attempt.
        iterations: Newton iterations, all substeps together.
        converged: Whether the load was reached.
        reached: Fraction of the load step that was reached.
        parts: Number of substeps that converged.
        between: The state before the last substep, whose history the contacts had in it.
        part_before: Fraction of the load step at that state.
    """

    solved: SolverState
    residual: Float[Array, ""]
    iterations: Int[Array, ""]
    converged: Bool[Array, ""]
    reached: Float[Array, ""]
    parts: Int[Array, ""]
    between: SolverState
    part_before: Float[Array, ""]


# Of a state before the last substep only the history is kept: it need not be within the tolerance,
# but within this multiple of it, and this residual.
_SUBSTEP_TOLERANCE, _SUBSTEP_RESIDUAL = 1e3, 1e-10
# Fraction of a load step at which the external loads are complete, where they come first.
_EXTERNAL_COMPLETE = 0.5


def at_rest(chain: Chain) -> SolverState:
    """Return the free robot with slack tendons that have not yet slid."""
    none = tuple(constant(np.zeros((*group.present.shape, 2))) for group in chain.groups)
    unknowns = Unknowns(
        modes=constant(np.zeros(chain.stiffness.shape)),
        contact_force=tuple(
            constant(np.zeros(group.has_contact.shape)) for group in chain.contact_pairs
        ),
        log_ratio=none,
    )
    slack = constant(np.zeros(chain.tendons))
    memory = Memory(none, none, none, chain.law.rest(chain.rods.section))
    return SolverState(Iterate(unknowns, slack), memory, slack, unloaded(chain))


def unloaded(chain: Chain) -> BodyLoads | None:
    """Return the absence of loads on all bodies, in the form of the chain."""
    if not chain.loaded:
        return None
    bodies = chain.flexures + 1
    d, a = (3, 3) if chain.frame is None else (2, 1)
    shapes = ((d,), (a,), (d, d), (a + d,))
    return BodyLoads(*(constant(np.zeros((bodies, *shape))) for shape in shapes))


def solve_load_step(
    chain: Chain, command: Command, last: SolverState, settings: Settings
) -> LoadStepResult:
    """Follow a load from a solved state.

    The whole step is tried first. Where Newton's method fails, the step is halved until it
    succeeds, and doubled again after; only substeps that converged enter the friction history.

    Where all tendons are slack before, external loads come first, then all tensions together: half
    the load step each.

    Args:
        chain: The chain.
        command: The load.
        last: The solved state before.
        settings: Tolerance and limits.

    Returns:
        The result.
    """
    external_first = _external_first(chain, last)

    def proceed(state: tuple[LoadStepResult, Array, Array]) -> Bool[Array, ""]:
        result, part, tries = state
        more = (part >= settings.smallest_load_step) & (tries < settings.max_load_steps)
        return ~result.converged & more & (result.iterations < settings.max_all_iterations)

    def substep(state: tuple[LoadStepResult, Array, Array]) -> tuple[LoadStepResult, Array, Array]:
        result, part, tries = state
        first = external_first & (result.reached < _EXTERNAL_COMPLETE)
        stop = jnp.where(first, _EXTERNAL_COMPLETE, 1.0)
        aim = jnp.minimum(result.reached + part, stop)
        towards = interpolate_command(chain, command, last, aim)
        new = _solve_substep(chain, towards, result.solved, settings, aim)
        memory = Memory(new.point.unknowns.log_ratio, new.slid, new.bound, new.material)
        keep = partial(jax.tree.map, lambda old, new_leaf: jnp.where(new.converged, new_leaf, old))
        result = LoadStepResult(
            solved=keep(result.solved, SolverState(new.point, memory, new.stroke, towards.applied)),
            residual=new.residual,
            iterations=result.iterations + new.iterations,
            converged=new.converged & (aim >= 1.0),
            reached=jnp.where(new.converged, aim, result.reached),
            parts=result.parts + new.converged,
            between=keep(result.between, result.solved),
            part_before=jnp.where(new.converged, result.reached, result.part_before),
        )
        return result, jnp.where(new.converged, 2.0 * part, 0.5 * part), tries + 1

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
    return jax.lax.while_loop(proceed, substep, (start, jnp.ones(()), jnp.zeros((), int)))[0]


def _solve_substep(
    chain: Chain, command: Command, solved: SolverState, settings: Settings, aim: Array
) -> NewtonResult:
    """Solve for a command near a solved state, from the predicted log ratios."""
    last_tension = solved.point.base_tension
    base_tension = command.either(last_tension, command.target)
    log_ratio = predict_log_ratios(chain, last_tension, base_tension, solved.memory)
    start = Iterate(solved.point.unknowns._replace(log_ratio=log_ratio), base_tension)
    enough = jnp.minimum(_SUBSTEP_TOLERANCE * settings.tolerance, _SUBSTEP_RESIDUAL)
    enough = jnp.where(aim < 1.0, enough, 0.0)
    problem = NewtonProblem(chain, command, solved.memory, last_tension)
    return newton(problem, start, settings, enough)


def interpolate_command(
    chain: Chain, command: Command, last: SolverState, part: Float[Array, ""]
) -> Command:
    """Interpolate between a solved state and a command; exactly the command at the end."""
    external_first = _external_first(chain, last)
    from_here = command.either(last.stroke, last.point.base_tension)
    external = jnp.where(external_first, jnp.minimum(2.0 * part, 1.0), part)
    tendons = jnp.where(external_first, jnp.maximum(2.0 * part - 1.0, 0.0), part)
    only_external = external_first & (tendons == 0.0)
    by_stroke = None if command.by_stroke is None else command.by_stroke & ~only_external
    target = jnp.where(only_external, 0.0, _interpolate(from_here, command.target, tendons))
    applied = jax.tree.map(partial(_interpolate, part=external), last.applied, command.applied)
    return Command(target, by_stroke, applied)


def _external_first(chain: Chain, last: SolverState) -> Bool[Array, ""]:
    """Whether external loads come before the tendons."""
    slack = jnp.all(last.point.base_tension == 0.0)
    return slack if chain.loaded else jnp.array(False)


def _interpolate(start: Float[Array, ...], end: Float[Array, ...], part: Array) -> Array:
    """A value at a fraction of the way from one to another; exactly the other at its end."""
    return jnp.where(part >= 1.0, end, start + part * (end - start))
