"""Load steps: from one solved state to the next, the whole load at once or in substeps."""

from __future__ import annotations

from functools import partial
from typing import NamedTuple

from jaxtyping import Array, Bool, Float, Int

from notchflex._jax import jax, jnp
from notchflex._pytree import choose
from notchflex.loads.command import Command
from notchflex.mechanics.chain import Chain
from notchflex.solver.element import Memory
from notchflex.solver.friction_predictor import predict_log_ratios
from notchflex.solver.linear_step.block_elimination import Iterate
from notchflex.solver.newton import NewtonProblem, NewtonResult, Settings, newton
from notchflex.solver.solver_state import SolverState


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
# A notch that softens as it closes has limit points, where a constant tension snaps it to another
# shape. Substeps that fail below this part of the load step are followed with a viscosity, between
# these parts of the stiffness at rest, until the notches stand still.
_SNAPS_BELOW, _VISCOSITY, _LEAST_VISCOSITY, _MOST_VISCOSITY = 0.3, 0.1, 1e-4, 30.0
# A contact at its bound is put this much beyond it, so that it slides on.
_SLIDES_ON = 1.0 + 1e-12
# How many times more iterations a load with snaps may take.
_MORE_ITERATIONS = 4
# Where Newton's method fails, contacts that stick are first let creep, by these slips per change of
# their log ratio one after the other (heights of the notch), each from the shape before; last none.
# Many contacts on tendons that hardly stretch stick or slide in combinations that are not found
# one contact at a time. Shapes on the way need to be no better than this residual.
_CREEP, _LESS_CREEP, _LEAST_CREEP, _CREEPING_RESIDUAL = 1e-1, 1e-1, 1e-8, 1e-8


class _LoadStepSearch(NamedTuple):
    """State of the loop over substeps.

    Attributes:
        result: The result so far.
        part: Length of the next substep, as a part of the load step.
        tries: Number of substeps tried.
        viscosity: Of the next substep; 0 outside a snap.
        creep: How far contacts creep in it; 0 for contacts that stick.
        eased: Whether it starts from a shape whose contacts crept.
        moving: Where it starts, and what a viscosity drags on: the last solved state, or a shape
            on the way to the next.
        predicts: Whether contacts are predicted in it, where strokes are commanded.
    """

    result: LoadStepResult
    part: Float[Array, ""]
    tries: Int[Array, ""]
    viscosity: Float[Array, ""]
    creep: Float[Array, ""]
    eased: Bool[Array, ""]
    moving: Iterate
    predicts: Bool[Array, ""]


def solve_load_step(
    chain: Chain, command: Command, last: SolverState, settings: Settings
) -> LoadStepResult:
    """Follow a load from a solved state.

    The whole step is tried first. Where Newton's method fails, it is tried with contacts that creep
    less and less; where that fails too, the step is halved until it succeeds, and doubled again
    after. Only substeps that converged with contacts that stick enter the friction history.

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
    can_snap = chain.rods.section.ends is not None
    # Of a single tendon, contacts are found as they are; a step fails for another reason.
    may_creep = chain.tendons > 1
    most = settings.max_all_iterations * (_MORE_ITERATIONS if can_snap else 1)

    def proceed(search: _LoadStepSearch) -> Bool[Array, ""]:
        result, part = search.result, search.part
        more = (part >= settings.smallest_load_step) & (search.tries < settings.max_load_steps)
        return ~result.converged & more & (result.iterations < most)

    def substep(search: _LoadStepSearch) -> _LoadStepSearch:
        reached = search.result.reached
        first = external_first & (reached < _EXTERNAL_COMPLETE)
        stop = jnp.where(first, _EXTERNAL_COMPLETE, 1.0)
        aim = jnp.minimum(reached + search.part, stop)
        towards = interpolate_command(chain, command, last, aim)
        new = _solve_substep(chain, towards, search, settings, aim, can_snap)
        result = _result_after(search, new, towards, aim)
        return _search_after(search, new, result, can_snap, may_creep)

    return jax.lax.while_loop(proceed, substep, _begin(last)).result


def _begin(last: SolverState) -> _LoadStepSearch:
    """Return the state of the loop before the first substep, which is the whole load step."""
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
    none, tries = jnp.zeros(()), jnp.zeros((), int)
    no, yes = jnp.array(False), jnp.array(True)
    return _LoadStepSearch(start, jnp.ones(()), tries, none, none, no, last.point, yes)


def _result_after(
    search: _LoadStepSearch, new: NewtonResult, towards: Command, aim: Float[Array, ""]
) -> LoadStepResult:
    """Return the result after a substep: its state counts if no viscosity or creep held it."""
    result = search.result
    memory = Memory(new.point.unknowns.log_ratio, new.slid, new.bound, new.material)
    at_aim = SolverState(new.point, memory, new.stroke, towards.applied)
    solved = new.converged & (search.viscosity == 0.0) & ~(search.creep > 0.0)
    return LoadStepResult(
        solved=choose(solved, at_aim, result.solved),
        residual=new.residual,
        iterations=result.iterations + new.iterations,
        converged=solved & (aim >= 1.0),
        reached=jnp.where(solved, aim, result.reached),
        parts=result.parts + solved,
        between=choose(solved, result.solved, result.between),
        part_before=jnp.where(solved, result.reached, result.part_before),
    )


def _search_after(
    search: _LoadStepSearch,
    new: NewtonResult,
    result: LoadStepResult,
    can_snap: bool,
    may_creep: bool,
) -> _LoadStepSearch:
    """Return how the next substep is tried: its length, its viscosity, creep of its contacts."""
    part, viscosity, before = search.part, search.viscosity, search.result.solved.point
    still, creeps = viscosity == 0.0, search.creep > 0.0
    eases = creeps | search.eased
    solved = new.converged & still & ~creeps
    eased = creeps & new.converged
    moves = jnp.any(search.moving.unknowns.modes != before.unknowns.modes)
    begins = still & ~creeps & ~moves & ~new.converged & may_creep
    less = jnp.where(search.creep < _LEAST_CREEP, 0.0, _LESS_CREEP * search.creep)
    creep = jnp.where(begins, _CREEP, jnp.where(eased, less, 0.0))
    # A snap on its way goes on under the same load.
    halves = (still & ~begins & ~moves) | (eases & ~new.converged)
    shorter = jnp.where(halves, 0.5 * part, part)
    part = jnp.where(solved, 2.0 * part, shorter)
    given_up = eases & ~new.converged
    predicts = search.predicts
    if can_snap:
        waits = begins | eased
        after = _next_viscosity(viscosity, new.converged, part)
        viscosity = jnp.where(waits, viscosity, after)
        given_up = given_up | (~still & ~new.converged & (viscosity == 0.0))
        # Where one way of finding the contacts fails, the other is tried next.
        other = (search.predicts == new.converged) & (viscosity == 0.0)
        predicts = jnp.where(waits, predicts, other)
    last_point = result.solved.point
    moving = choose(given_up, last_point, choose(new.converged, new.point, search.moving))
    return _LoadStepSearch(
        result, part, search.tries + 1, viscosity, creep, eased, moving, predicts
    )


def _next_viscosity(
    viscosity: Float[Array, ""], converged: Bool[Array, ""], part: Float[Array, ""]
) -> Float[Array, ""]:
    """Return the viscosity of the next substep, as a part of the stiffness at rest.

    It starts where short substeps fail, falls while the notch moves on until it is off, and rises
    where it does not suffice.
    """
    less = jnp.where(viscosity < _LEAST_VISCOSITY, 0.0, 0.4 * viscosity)
    more = jnp.where(viscosity < _MOST_VISCOSITY, 3.0 * viscosity, 0.0)
    moving = jnp.where(converged, less, more)
    starts = ~converged & (part < _SNAPS_BELOW)
    return jnp.where(viscosity > 0.0, moving, jnp.where(starts, _VISCOSITY, 0.0))


def _solve_substep(
    chain: Chain,
    command: Command,
    search: _LoadStepSearch,
    settings: Settings,
    aim: Array,
    can_snap: bool,
) -> NewtonResult:
    """Solve for a command near the last solved state, from the predicted log ratios.

    The history is that of the last solved state: nothing on the way is remembered.
    """
    solved, moving = search.result.solved, search.moving
    memory, last_tension = solved.memory, solved.point.base_tension
    base_tension = command.either(last_tension, command.target)
    log_ratio = predict_log_ratios(chain, last_tension, base_tension, memory)
    start = Iterate(solved.point.unknowns._replace(log_ratio=log_ratio), base_tension)
    enough = jnp.minimum(_SUBSTEP_TOLERANCE * settings.tolerance, _SUBSTEP_RESIDUAL)
    enough = jnp.where(aim < 1.0, enough, 0.0)
    enough = jnp.where(search.creep > 0.0, jnp.maximum(enough, _CREEPING_RESIDUAL), enough)
    predicts: Bool[Array, ""] | bool = True
    if command.by_stroke is not None:
        # Contacts that are not predicted slide on if they slid before.
        predicts = search.predicts & ~((search.creep > 0.0) | search.eased)
        sliding = jax.tree.map(lambda old: _SLIDES_ON * old, memory.log_ratio)
        log_ratio = choose(predicts, log_ratio, sliding)
        start = start._replace(unknowns=start.unknowns._replace(log_ratio=log_ratio))
    moves = jnp.any(moving.unknowns.modes != solved.point.unknowns.modes)
    start = choose(moves, moving, start)
    memory = memory._replace(creep=search.creep)
    if can_snap:
        memory = memory._replace(drag=(search.viscosity, moving.unknowns.modes))
    problem = NewtonProblem(chain, command, memory, last_tension, predicts)
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
