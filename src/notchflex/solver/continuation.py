"""Load steps: from one solved state to the next, the whole load at once or in substeps."""

from __future__ import annotations

import dataclasses
from functools import partial
from typing import NamedTuple

from jaxtyping import Array, Bool, Float, Int

from notchflex._jax import (
    choose,
    jax,
    jnp,
)
from notchflex.loads.command import Command
from notchflex.mechanics.chain import Chain
from notchflex.solver.newton import (
    NewtonProblem,
    NewtonResult,
    Settings,
    newton,
    predict_log_ratios,
)
from notchflex.solver.residual import (
    Iterate,
    Memory,
    SolverState,
)


class LoadStepResult(NamedTuple):
    """Result of one load step.

    Attributes:
        solved: The last solved state: that of the load, or the last one that converged.
        residual: Largest scaled residual of the last attempt.
        iterations: Newton iterations, all substeps together.
        converged: Whether the load was reached.
        reached: Fraction of the load step that was reached.
        substeps: Number of substeps that converged.
        between: The state before the last substep, the origin of its friction history.
        fraction_before: Fraction of the load step at that state.
    """

    solved: SolverState
    residual: Float[Array, ""]
    iterations: Int[Array, ""]
    converged: Bool[Array, ""]
    reached: Float[Array, ""]
    substeps: Int[Array, ""]
    between: SolverState
    fraction_before: Float[Array, ""]


# States before the last substep only provide the history: they may exceed the tolerance up to this
# multiple of it, and up to this residual.
_SUBSTEP_TOLERANCE, _SUBSTEP_RESIDUAL = 1e3, 1e-10
# Fraction of a load step at which the external loads are complete, where they come first.
_EXTERNAL_COMPLETE = 0.5
# A notch that softens as it closes has limit points, where it snaps to another shape under constant
# tension; fibres on a flat plateau lose nearly all stiffness. Substeps that fail below this
# fraction of the load step are solved with an artificial viscosity, within these fractions of the
# stiffness at rest, until the notches stand still.
_SNAP_MAX_FRACTION, _VISCOSITY, _MIN_VISCOSITY, _MAX_VISCOSITY = 0.3, 0.1, 1e-4, 30.0
# A contact at its bound starts slightly beyond it, so that it goes on sliding.
_BEYOND_BOUND = 1.0 + 1e-12
# Factor on the allowed iterations of a load with snaps.
_SNAP_FACTOR = 4
# Where Newton's method fails, sticking contacts are regularised: they get a compliance (slip in
# heights of the notch per change of the log ratio) that is reduced from substep to substep, each
# from the last shape, to zero. Many contacts on stiff tendons stick or slide in combinations that
# are not found one contact at a time. The reduction adapts: a factor that fails is replaced by its
# root, up to the largest. What is not found in a few iterations would be found by luck of rounding.
_STICK_COMPLIANCE, _STICK_FACTOR, _MAX_STICK_FACTOR, _MIN_STICK = 1e-1, 1e-1, 0.8, 1e-8
# Relaxed shapes only need this residual, within these iterations.
_RELAXED_RESIDUAL, _RELAXED_ITERATIONS = 1e-8, 10


class _LoadStepSearch(NamedTuple):
    """State of the loop over substeps.

    Attributes:
        result: The result so far.
        fraction: Length of the next substep, as a fraction of the load step.
        attempts: Number of substeps tried.
        viscosity: Artificial viscosity of the next substep; 0 outside a snap.
        stick_compliance: Regularisation of its sticking contacts; 0 for none.
        stick_factor: Factor on the regularisation from one relaxed shape to the next.
        from_compliance: Regularisation of the shape that it starts from; 0 for none.
        start_iterate: Its start, to which the viscosity refers: the last solved state, or an
            unconverged shape between it and the next.
        predicts: Whether its contacts are predicted, where strokes are commanded.
    """

    result: LoadStepResult
    fraction: Float[Array, ""]
    attempts: Int[Array, ""]
    viscosity: Float[Array, ""]
    stick_compliance: Float[Array, ""]
    stick_factor: Float[Array, ""]
    from_compliance: Float[Array, ""]
    start_iterate: Iterate
    predicts: Bool[Array, ""]


def solve_load_step(
    chain: Chain, command: Command, last: SolverState, settings: Settings
) -> LoadStepResult:
    """Follow a load from a solved state.

    The whole step is tried first. Where Newton's method fails, it is tried with regularised
    contacts, whose compliance falls to zero; where that fails too, the step is halved until it
    succeeds, and doubled afterwards. Only substeps that converged without regularisation enter the
    friction history.

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
    section = chain.rods.section
    can_snap = section.ends is not None or section.fibres is not None
    # With a single tendon, contacts are never the reason for a failure.
    may_relax = chain.tendons > 1
    max_iterations = settings.max_all_iterations * (_SNAP_FACTOR if can_snap else 1)

    def proceed(search: _LoadStepSearch) -> Bool[Array, ""]:
        result, fraction = search.result, search.fraction
        more = search.attempts < settings.max_load_steps
        more = more & (fraction >= settings.smallest_load_step)
        return ~result.converged & more & (result.iterations < max_iterations)

    def substep(search: _LoadStepSearch) -> _LoadStepSearch:
        reached = search.result.reached
        first = external_first & (reached < _EXTERNAL_COMPLETE)
        stop = jnp.where(first, _EXTERNAL_COMPLETE, 1.0)
        end = jnp.minimum(reached + search.fraction, stop)
        target = interpolate_command(chain, command, last, end)
        new = _solve_substep(chain, target, search, settings, end, can_snap)
        result = _result_after(search, new, target, end)
        return _search_after(search, new, result, can_snap, may_relax)

    return jax.lax.while_loop(proceed, substep, _begin(last)).result


def _begin(last: SolverState) -> _LoadStepSearch:
    """Return the state of the loop before the first substep, which is the whole load step."""
    start = LoadStepResult(
        solved=last,
        residual=jnp.array(jnp.inf),
        iterations=jnp.zeros((), int),
        converged=jnp.array(False),
        reached=jnp.zeros(()),
        substeps=jnp.zeros((), int),
        between=last,
        fraction_before=jnp.zeros(()),
    )
    none = jnp.zeros(())
    return _LoadStepSearch(
        result=start,
        fraction=jnp.ones(()),
        attempts=jnp.zeros((), int),
        viscosity=none,
        stick_compliance=none,
        stick_factor=none,
        from_compliance=none,
        start_iterate=last.point,
        predicts=jnp.array(True),
    )


def _result_after(
    search: _LoadStepSearch,
    new: NewtonResult,
    target: Command,
    end: Float[Array, ""],
) -> LoadStepResult:
    """Return the result after a substep; regularised states do not count."""
    result = search.result
    memory = Memory(new.point.unknowns.log_ratio, new.slid, new.bound, new.material)
    at_aim = SolverState(new.point, memory, new.stroke, target.applied)
    solved = new.converged & (search.viscosity == 0.0) & ~(search.stick_compliance > 0.0)
    return LoadStepResult(
        solved=choose(solved, at_aim, result.solved),
        residual=new.residual,
        iterations=result.iterations + new.iterations,
        converged=solved & (end >= 1.0),
        reached=jnp.where(solved, end, result.reached),
        substeps=result.substeps + solved,
        between=choose(solved, result.solved, result.between),
        fraction_before=jnp.where(solved, result.reached, result.fraction_before),
    )


def _search_after(
    search: _LoadStepSearch,
    new: NewtonResult,
    result: LoadStepResult,
    can_snap: bool,
    may_relax: bool,
) -> _LoadStepSearch:
    """Return the settings of the next substep: its length, viscosity and regularisation."""
    fraction, viscosity, before = search.fraction, search.viscosity, search.result.solved.point
    inviscid, relaxed = viscosity == 0.0, search.stick_compliance > 0.0
    relaxing = relaxed | (search.from_compliance > 0.0)
    solved = new.converged & inviscid & ~relaxed
    relaxes = relaxed & new.converged
    from_unsolved_shape = jnp.any(search.start_iterate.unknowns.modes != before.unknowns.modes)
    plain_fails = inviscid & ~relaxing & ~from_unsolved_shape & ~new.converged
    starts_relaxing = plain_fails & may_relax
    root = jnp.sqrt(search.stick_factor)
    retries = relaxed & ~new.converged & (search.from_compliance > 0.0) & (root < _MAX_STICK_FACTOR)
    factor = jnp.where(retries, root, jnp.maximum(search.stick_factor**2, _STICK_FACTOR))
    from_compliance = jnp.where(relaxes, search.stick_compliance, search.from_compliance)
    from_compliance = jnp.where(relaxes | retries, from_compliance, 0.0)
    compliance = jnp.where(from_compliance < _MIN_STICK, 0.0, factor * from_compliance)
    compliance = jnp.where(starts_relaxing, _STICK_COMPLIANCE, compliance)
    abandons = relaxing & ~new.converged & ~retries
    # A snap continues under the same load.
    shorter = jnp.where((plain_fails & ~starts_relaxing) | abandons, 0.5 * fraction, fraction)
    fraction = jnp.where(solved, 2.0 * fraction, shorter)
    predicts = search.predicts
    if can_snap:
        keeps_viscosity = starts_relaxing | relaxes | retries
        after = _next_viscosity(viscosity, new.converged, fraction)
        viscosity = jnp.where(keeps_viscosity, viscosity, after)
        abandons = abandons | (~inviscid & ~new.converged & (viscosity == 0.0))
        # After a failure the substep is tried the other way, with or without predicted contacts.
        next_predicts = (search.predicts == new.converged) & (viscosity == 0.0)
        predicts = jnp.where(keeps_viscosity, predicts, next_predicts)
    last_point = result.solved.point
    start = choose(abandons, last_point, choose(new.converged, new.point, search.start_iterate))
    attempts = search.attempts + 1
    return _LoadStepSearch(
        result,
        fraction,
        attempts,
        viscosity,
        compliance,
        factor,
        from_compliance,
        start,
        predicts,
    )


def _next_viscosity(
    viscosity: Float[Array, ""], converged: Bool[Array, ""], fraction: Float[Array, ""]
) -> Float[Array, ""]:
    """Return the viscosity of the next substep, as a fraction of the stiffness at rest.

    It starts after a short substep fails, falls to zero while substeps converge, and rises when one
    fails.
    """
    smaller = jnp.where(viscosity < _MIN_VISCOSITY, 0.0, 0.4 * viscosity)
    larger = jnp.where(viscosity < _MAX_VISCOSITY, 3.0 * viscosity, 0.0)
    next_viscosity = jnp.where(converged, smaller, larger)
    starts = ~converged & (fraction < _SNAP_MAX_FRACTION)
    return jnp.where(viscosity > 0.0, next_viscosity, jnp.where(starts, _VISCOSITY, 0.0))


def _solve_substep(
    chain: Chain,
    command: Command,
    search: _LoadStepSearch,
    settings: Settings,
    end: Array,
    can_snap: bool,
) -> NewtonResult:
    """Solve for a command near the last solved state, from the predicted log ratios.

    The history is that of the last solved state, not of unconverged shapes.
    """
    solved, iterate = search.result.solved, search.start_iterate
    memory, before = solved.memory, solved.point.base_tension
    base_tension = command.either(before, command.target)
    log_ratio = predict_log_ratios(chain, before, base_tension, memory)
    start = Iterate(solved.point.unknowns._replace(log_ratio=log_ratio), base_tension)
    residual_target = jnp.minimum(_SUBSTEP_TOLERANCE * settings.tolerance, _SUBSTEP_RESIDUAL)
    residual_target = jnp.where(end < 1.0, residual_target, 0.0)
    relaxed = search.stick_compliance > 0.0
    relaxed_target = jnp.maximum(residual_target, _RELAXED_RESIDUAL)
    residual_target = jnp.where(relaxed, relaxed_target, residual_target)
    predicts: Bool[Array, ""] | bool = True
    if command.by_stroke is not None:
        # Without prediction, contacts that slid before go on sliding.
        predicts = search.predicts & ~(relaxed | (search.from_compliance > 0.0))
        sliding = jax.tree.map(lambda old: _BEYOND_BOUND * old, memory.log_ratio)
        log_ratio = choose(predicts, log_ratio, sliding)
        start = start._replace(unknowns=start.unknowns._replace(log_ratio=log_ratio))
    from_unsolved_shape = jnp.any(iterate.unknowns.modes != solved.point.unknowns.modes)
    start = choose(from_unsolved_shape, iterate, start)
    memory = memory._replace(stick_compliance=search.stick_compliance)
    if can_snap:
        memory = memory._replace(damping=(search.viscosity, iterate.unknowns.modes))
    most = jnp.where(relaxed, _RELAXED_ITERATIONS, settings.max_iterations)
    settings = dataclasses.replace(settings, max_iterations=most)
    problem = NewtonProblem(chain, command, memory, solved.point, predicts)
    return newton(problem, start, settings, residual_target)


def interpolate_command(
    chain: Chain, command: Command, last: SolverState, fraction: Float[Array, ""]
) -> Command:
    """Interpolate between a solved state and a command; exact at the end."""
    external_first = _external_first(chain, last)
    from_here = command.either(last.stroke, last.point.base_tension)
    external = jnp.where(external_first, jnp.minimum(2.0 * fraction, 1.0), fraction)
    tendons = jnp.where(external_first, jnp.maximum(2.0 * fraction - 1.0, 0.0), fraction)
    only_external = external_first & (tendons == 0.0)
    by_stroke = None if command.by_stroke is None else command.by_stroke & ~only_external
    target = jnp.where(only_external, 0.0, _interpolate(from_here, command.target, tendons))
    applied = jax.tree.map(partial(_interpolate, fraction=external), last.applied, command.applied)
    return Command(target, by_stroke, applied)


def _external_first(chain: Chain, last: SolverState) -> Bool[Array, ""]:
    """Return whether external loads come before the tendons."""
    slack = jnp.all(last.point.base_tension == 0.0)
    return slack if chain.loaded else jnp.array(False)


def _interpolate(start: Float[Array, ...], end: Float[Array, ...], fraction: Array) -> Array:
    """Interpolate linearly; exact at the end."""
    return jnp.where(fraction >= 1.0, end, start + fraction * (end - start))
