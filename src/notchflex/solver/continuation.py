"""Load steps: from one solved state to the next, the whole load at once or in substeps."""

from __future__ import annotations

import dataclasses
from enum import IntEnum
from functools import partial
from typing import NamedTuple

from jaxtyping import Array, Bool, Float, Int

from notchflex._jax import choose, jax, jnp
from notchflex.loads.command import Command
from notchflex.mechanics.chain import Chain
from notchflex.solver.newton import (
    NewtonResult,
    Settings,
    newton,
    predict_log_ratios,
)
from notchflex.solver.residual import Iterate, Memory, SolverState
from notchflex.solver.sheaths import aimed, state_after


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
        overdrawn: Inextensible tendons whose strokes no shape allows: in an attempt since the last
            substep their tensions grew and the shape did not change.
    """

    solved: SolverState
    residual: Float[Array, ""]
    iterations: Int[Array, ""]
    converged: Bool[Array, ""]
    reached: Float[Array, ""]
    substeps: Int[Array, ""]
    between: SolverState
    fraction_before: Float[Array, ""]
    overdrawn: Bool[Array, " t"]


class _Mode(IntEnum):
    """How a substep is tried: by the equations as they are, or along regularised ones to them."""

    # RELAXED: sticking contacts have a compliance. Many contacts on stiff tendons stick or slide in
    # combinations that are not found one contact at a time (benchmarks/hard_loads.py). SNAPPING:
    # the notches have a viscosity. A notch that softens as it closes has limit points, where it
    # snaps to another shape under constant tension; fibres on a flat plateau lose nearly all
    # stiffness (tests/solver/test_snapping.py).

    PLAIN = 0
    RELAXED = 1
    SNAPPING = 2


class _Attempt(NamedTuple):
    """What is tried next.

    Attributes:
        fraction: Length of the substep, as a fraction of the load step.
        mode: Its mode.
        regularisation: Compliance of sticking contacts, slip in heights of the notch per change of
            the log ratio, or viscosity, a fraction of the stiffness at rest; 0 for neither.
        factor: Compliance over that of the relaxed shape before; 0 for the first.
    """

    fraction: Float[Array, ""]
    mode: Int[Array, ""] | int = _Mode.PLAIN
    regularisation: Float[Array, ""] | float = 0.0
    factor: Float[Array, ""] | float = 0.0

    def after_contacts(self, converged: Array, can_snap: bool) -> _Attempt:
        """Return what is tried after the equations as they are, or after a relaxed shape."""
        begun = self._replace(mode=_Mode.RELAXED, regularisation=_COMPLIANCE, factor=0.0)
        plain = choose(converged, _Attempt(2.0 * self.fraction), begun)
        # A compliance that fails is approached by the root of the factor, for tendons that are all
        # but slack (tests/solver/test_slight_tensions.py).
        compliance, root = self.regularisation, jnp.sqrt(self.factor)
        factor = jnp.maximum(self.factor**2, _FACTOR)
        smaller = jnp.where(compliance < _MIN_COMPLIANCE, 0.0, factor * compliance)
        larger = self._replace(regularisation=compliance / root, factor=root)
        retries = (compliance > 0.0) & (root > 0.0) & (root < _MAX_FACTOR)
        relaxed = self._replace(regularisation=smaller, factor=factor)
        # Where contacts were not found directly, those of the next substep would not be either.
        further = begun._replace(fraction=2.0 * self.fraction)
        half = _Attempt(0.5 * self.fraction)
        viscous = half._replace(mode=_Mode.SNAPPING, regularisation=_VISCOSITY)
        half = choose(can_snap & (half.fraction < _SNAP_MAX_FRACTION), viscous, half)
        relaxed = choose(
            converged,
            choose(compliance > 0.0, relaxed, further),
            choose(retries, larger, half),
        )
        return choose(self.mode == _Mode.RELAXED, relaxed, plain)

    def after_snapping(self, converged: Array) -> _Attempt:
        """Return what is tried after a viscous shape, or after the equations from the last one."""
        # Under the same load the viscosity falls to zero while shapes are found, and rises when one
        # is not, up to the largest (tests/test_errors.py: the edges of a tendon's channel meet).
        viscosity = self.regularisation
        smaller = jnp.where(viscosity < _MIN_VISCOSITY, 0.0, 0.4 * viscosity)
        larger = jnp.where(viscosity > 0.0, 3.0 * viscosity, _VISCOSITY)
        viscous = self._replace(regularisation=jnp.where(converged, smaller, larger))
        gives_up = ~converged & (viscosity >= _MAX_VISCOSITY)
        attempt = choose(gives_up, _Attempt(self.fraction), viscous)
        return choose(converged & (viscosity == 0.0), _Attempt(2.0 * self.fraction), attempt)


class _Substeps(NamedTuple):
    """State of the loop over substeps.

    Attributes:
        result: The result so far.
        attempts: Number of substeps tried.
        attempt: The next.
        start: Where it starts, to which a viscosity refers: the last solved state, or a
            regularised shape between it and the next.
    """

    result: LoadStepResult
    attempts: Int[Array, ""]
    attempt: _Attempt
    start: Iterate


# Scaled residuals that states before the end of a load step need, as they only provide the history,
# and relaxed shapes, from which the next one starts; these also need this part of their compliance,
# below which a contact that sticks cannot be told from one that slides.
_SUBSTEP_RESIDUAL, _RELAXED_RESIDUAL, _RELAXED_PART = 1e-10, 1e-8, 1e-3
# Iterations of a relaxed shape: what is not found in a few would be found by luck of rounding.
_RELAXED_ITERATIONS = 20
# First and smallest compliance, and the factors from one relaxed shape to the next.
_COMPLIANCE, _MIN_COMPLIANCE, _FACTOR, _MAX_FACTOR = 1e-1, 1e-11, 1e-1, 0.8
# Shorter substeps may be solved with a viscosity: the first, the smallest and the largest.
_SNAP_MAX_FRACTION, _VISCOSITY, _MIN_VISCOSITY, _MAX_VISCOSITY = 0.3, 0.1, 1e-4, 30.0
# Factor on the allowed iterations of a load with snaps, of which one took 625 in 71 paths of wrists
# as in tests/solver/test_snapping.py.
_SNAP_FACTOR = 4
# A contact at its bound starts slightly beyond it, so that it goes on sliding.
_BEYOND_BOUND = 1.0 + 1e-12
# Least tension, in closing forces of a notch, and largest imbalance, in rad over it, where a tendon
# is drawn further than the robot bends. Strokes beyond closing, and those that contradict each
# other, end above 9e4 and below 1e-6; Gao's robot at 7.5 mm, without equilibrium, at 4e4 and 1e-4.
_OVERDRAWN, _BALANCED = 1e3, 1e-5


def solve_load_step(
    chain: Chain, command: Command, last: SolverState, settings: Settings
) -> LoadStepResult:
    """Follow a load from a solved state."""
    # The whole step is tried first. Where Newton's method fails, it is tried with regularised
    # contacts, whose compliance falls to zero; where that fails too, the step is halved until it
    # succeeds, and doubled afterwards. Only substeps that converged without regularisation enter
    # the friction history. Where all tendons are slack before, external loads come first, then all
    # tensions together: half the load step each.
    section = chain.rods.section
    can_snap = section.ends is not None or section.fibres is not None
    max_iterations = settings.max_all_iterations * (_SNAP_FACTOR if can_snap else 1)

    def goes_on(state: _Substeps) -> Bool[Array, ""]:
        result = state.result
        more = state.attempts < settings.max_load_steps
        more = more & (state.attempt.fraction >= settings.smallest_load_step)
        return ~result.converged & more & (result.iterations < max_iterations)

    def proceed(state: _Substeps) -> _Substeps:
        attempt, reached = state.attempt, state.result.reached
        complete = _external_complete(chain, last)
        stop = jnp.where(reached < complete, complete, 1.0)
        end = jnp.minimum(reached + attempt.fraction, stop)
        target = interpolate_command(chain, command, last, end)
        new = _solve_substep(chain, target, state, settings, end, can_snap)
        result = _result_after(chain, state, new, target, end)
        after = attempt.after_contacts(new.converged, can_snap)
        if can_snap:
            snapping = attempt.after_snapping(new.converged)
            after = choose(attempt.mode == _Mode.SNAPPING, snapping, after)
        start = choose(new.converged, new.point, state.start)
        start = choose(after.mode == attempt.mode, start, result.solved.point)
        return _Substeps(result, state.attempts + 1, after, start)

    zero, none = jnp.zeros(()), jnp.zeros((), int)
    no, infinite, slack = jnp.array(False), jnp.array(jnp.inf), jnp.zeros(chain.tendons, bool)
    begun = LoadStepResult(last, infinite, none, no, zero, none, last, zero, slack)
    first = _Attempt(jnp.ones(()), none, zero, zero)
    return jax.lax.while_loop(goes_on, proceed, _Substeps(begun, none, first, last.point)).result


def _result_after(
    chain: Chain, state: _Substeps, new: NewtonResult, target: Command, end: Float[Array, ""]
) -> LoadStepResult:
    """Return the result after a substep; regularised states do not count."""
    result = state.result
    memory = Memory(new.point.unknowns.log_ratio, new.slid, new.bound, new.material)
    overdrawn = result.overdrawn
    if target.by_stroke is not None:
        least = chain.closing_force * jnp.maximum(_OVERDRAWN, new.residual / _BALANCED)
        pulled = (new.point.base_tension > least) & chain.inextensible
        overdrawn = result.overdrawn | (target.by_stroke & pulled)
    success = result._replace(
        solved=state_after(
            chain, target, new.point, memory, new.stroke, result.solved.memory.sheath
        ),
        converged=end >= 1.0,
        reached=end,
        substeps=result.substeps + 1,
        between=result.solved,
        fraction_before=result.reached,
        overdrawn=jnp.zeros(chain.tendons, bool),
    )
    solved = new.converged & (state.attempt.regularisation == 0.0)
    return choose(solved, success, result._replace(overdrawn=overdrawn))._replace(
        residual=new.residual, iterations=result.iterations + new.iterations
    )


def _solve_substep(
    chain: Chain,
    command: Command,
    state: _Substeps,
    settings: Settings,
    end: Float[Array, ""],
    can_snap: bool,
) -> NewtonResult:
    """Solve for a command near the last solved state, from the predicted log ratios."""
    # The history is that of the last solved state, not of regularised shapes.
    attempt, solved = state.attempt, state.result.solved
    memory, before = solved.memory, solved.point.base_tension
    towards = command.target
    if memory.sheath is not None:
        assert chain.sheath is not None
        largest = jnp.exp(chain.sheath.log_ratio(command.bend))
        towards = jnp.clip(before, towards / largest, towards * largest)
    base_tension = command.either(before, towards)
    if command.by_stroke is None:
        log_ratio = predict_log_ratios(chain, before, base_tension, memory)
    else:  # contacts that slid before go on sliding
        log_ratio = jax.tree.map(lambda old: _BEYOND_BOUND * old, memory.log_ratio)
    start = Iterate(solved.point.unknowns._replace(log_ratio=log_ratio), base_tension)
    regularised = jnp.any(state.start.unknowns.modes != solved.point.unknowns.modes)
    start = choose(regularised, state.start, start)
    compliance = jnp.where(attempt.mode == _Mode.RELAXED, attempt.regularisation, 0.0)
    memory = memory._replace(stick_compliance=compliance)
    if can_snap:
        viscosity = attempt.regularisation - compliance
        memory = memory._replace(damping=(viscosity, state.start.unknowns.modes))
    relaxed = compliance > 0.0
    residual_target = jnp.where(end < 1.0, _SUBSTEP_RESIDUAL, 0.0)
    enough = jnp.minimum(_RELAXED_RESIDUAL, _RELAXED_PART * compliance)
    residual_target = jnp.where(relaxed, enough, residual_target)
    most = jnp.where(relaxed, _RELAXED_ITERATIONS, settings.max_iterations)
    settings = dataclasses.replace(settings, max_iterations=most)
    aim = aimed(chain, command, memory.sheath)
    return newton(chain, aim, memory, start, settings, residual_target)


def interpolate_command(
    chain: Chain, command: Command, last: SolverState, fraction: Float[Array, ""]
) -> Command:
    """Interpolate between a solved state and a command; exact at the end."""
    complete = _external_complete(chain, last)
    from_here = command.either(last.stroke, last.tension)
    external = jnp.minimum(fraction / complete, 1.0)
    tendons = jnp.maximum((fraction - (1.0 - complete)) / complete, 0.0)
    only_external = (complete < 1.0) & (tendons == 0.0)
    by_stroke = None if command.by_stroke is None else command.by_stroke & ~only_external
    target = jnp.where(only_external, 0.0, _interpolate(from_here, command.target, tendons))
    applied = jax.tree.map(partial(_interpolate, fraction=external), last.applied, command.applied)
    return Command(target, by_stroke, applied, command.bend)


def before_tendons(chain: Chain, last: SolverState, fraction: Array) -> Bool[Array, ""]:
    """Return whether the tendons have not moved yet at a fraction of a load step."""
    complete = _external_complete(chain, last)
    return fraction <= jnp.where(complete < 1.0, complete, 0.0)


def _external_complete(chain: Chain, last: SolverState) -> Float[Array, ""]:
    """Return the fraction of a load step at which external loads are complete: half if first."""
    slack = jnp.all(last.point.base_tension == 0.0)
    return jnp.where(slack, 0.5, 1.0) if chain.loaded else jnp.ones(())


def _interpolate(start: Float[Array, ...], end: Float[Array, ...], fraction: Array) -> Array:
    """Interpolate linearly; exact at the end."""
    return jnp.where(fraction >= 1.0, end, start + fraction * (end - start))
