"""Newton's method with a line search on the whole chain, from a state near the solution."""

from __future__ import annotations

import dataclasses
from functools import partial
from typing import Any, NamedTuple, cast

from jax.flatten_util import ravel_pytree
from jaxtyping import Array, Bool, Float, Int

from notchflex._jax import jax, jnp
from notchflex._pytree import Pytree, choose
from notchflex.loads.command import Command
from notchflex.mechanics.chain import Chain, flexure_states
from notchflex.mechanics.flexure import in_space
from notchflex.solver.actuation import command_residual, stroke, tension_is_bounded
from notchflex.solver.element import Memory
from notchflex.solver.friction_predictor import LARGEST_LOG_RATIO, limit_slack, predict_contacts
from notchflex.solver.linear_step.block_elimination import Iterate, linear_step
from notchflex.solver.residual import Evaluation, evaluate
from notchflex.solver.step_limits import limit_closing


class Settings(Pytree, eq=True):
    """Tolerance and limits of the solver.

    Attributes:
        tolerance: Largest scaled residual (about an angle, rad) of a solved state.
        max_iterations: Newton iterations for one load step.
        max_load_steps: Substeps that a load may be divided into.
        smallest_load_step: Smallest substep, as a fraction of the whole load.
        max_all_iterations: Newton iterations for a load, all its substeps together.
    """

    tolerance: float = 1e-13
    max_iterations: int = 40
    max_load_steps: int = 200
    smallest_load_step: float = 1e-5
    max_all_iterations: int = 800

    @property
    def numbers(self) -> tuple[float, ...]:
        """All of them in order."""
        return tuple(getattr(self, one.name) for one in dataclasses.fields(self))

    @classmethod
    def of(cls, numbers: Float[Array, " settings"]) -> Settings:
        """Return the settings of a compiled program, from all numbers in order."""
        return cls(*cast("list[Any]", [numbers[i] for i in range(len(numbers))]))


DEFAULT = Settings()


class NewtonResult(NamedTuple):
    """Result of Newton's method.

    Attributes:
        point: The solution, or the last guess.
        slid: Tendon slid over the contacts there, mm.
        bound: Largest log ratios of the contacts there.
        material: Memory of the material there.
        stroke: Tendon drawn out at the base there, mm.
        residual: Largest scaled residual there.
        iterations: Number of iterations.
        converged: Whether the residual is within the tolerance.
    """

    point: Iterate
    slid: tuple[Float[Array, "n t 2"], ...]
    bound: tuple[Float[Array, "n t 2"], ...]
    material: Any
    stroke: Float[Array, " t"]
    residual: Float[Array, ""]
    iterations: Int[Array, ""]
    converged: Bool[Array, ""]


class _Iteration(NamedTuple):
    """State of the line search.

    Attributes:
        best: The best point so far.
        allowed: Norm of the residual that the next point must not exceed.
        step: Step from the best point.
        fraction: Fraction of the step that is tried next.
        tries: Number of points tried from the best one.
        terminate: Whether the search is over.
    """

    best: NewtonResult
    allowed: Float[Array, ""]
    step: Iterate
    fraction: Float[Array, ""]
    tries: Int[Array, ""]
    terminate: Bool[Array, ""]


class NewtonProblem(NamedTuple):
    """A command on a chain, after another solved state.

    Attributes:
        chain: The chain.
        command: Tensions and strokes commanded, external loads.
        memory: History of contacts and material, as of the last solved state.
        last_tension: Base tensions of that state, N.
        predicts: Whether contacts are predicted where a stroke is commanded. The predictor takes
            it that a tendon is pulled as its tension rises, which is not so where a notch softens.
    """

    chain: Chain
    command: Command
    memory: Memory
    last_tension: Float[Array, " t"]
    predicts: Bool[Array, ""] | bool = True


# A step may turn a flexure by so much (rad); as `LARGEST_LOG_RATIO`.
_LARGEST_TURN = 0.5
_TRIES = 7
# The first steps are taken whole, whatever they do to the residual: where a tendon turns round,
# all its contacts must leave their bound at once, and the way there is not downhill.
_UNLIMITED = 8
# With a stroke commanded, the predictor sets the contacts in so many first iterations, while the
# residual is above this.
_PREDICTED = 15
_PREDICTED_ABOVE = 1e-4
# A state whose residual has stopped falling at this multiple of the tolerance is as good as
# rounding allows.
_ROUNDING = 100.0
_LARGEST_GROWTH = 1e4


def newton(
    problem: NewtonProblem, start: Iterate, settings: Settings, enough: Float[Array, ""]
) -> NewtonResult:
    """Find the equilibrium under a command near a starting point.

    Every pass of the loop evaluates one point: the start, a full Newton step, or half of the
    fraction tried before where that did not lessen the residual.

    Args:
        problem: The chain, the command and the history.
        start: Where to begin.
        settings: Tolerance and limits.
        enough: Residual that is small enough, should it be above the tolerance.

    Returns:
        The result; `converged` is false after a failure.
    """
    chain, command, memory, *_ = problem
    tolerance = _tolerance(chain, start, settings)
    small_enough = jnp.maximum(tolerance, enough)

    def proceed(search: _Iteration) -> Bool[Array, ""]:
        return ~search.terminate & (search.best.iterations <= settings.max_iterations)

    def iterate(search: _Iteration) -> _Iteration:
        best = search.best
        y = jax.tree.map(lambda at, by: at + search.fraction * by, best.point, search.step)
        at = evaluate(chain, y.unknowns, memory, y.base_tension, command.applied)
        demand = command_residual(chain, command, y.base_tension, at.base)
        fx = ravel_pytree((at.residual, demand))[0]
        largest, size = jnp.max(jnp.abs(fx)), jnp.linalg.norm(fx)
        unlimited = (best.iterations < _UNLIMITED) & (best.residual >= _ROUNDING * tolerance)
        falls = size <= search.allowed
        better = falls | (unlimited & jnp.isfinite(size))
        near = best.residual < _ROUNDING * tolerance
        at_rounding = near & (largest >= best.residual) & ~falls
        accept = better | (jnp.isfinite(size) & (search.tries >= _TRIES) & ~at_rounding)
        solved = accept & (largest < small_enough)
        within = solved | (largest < _ROUNDING * tolerance)
        new = _result(chain, command, y, at, largest, best.iterations + 1, within)
        step, fraction = jax.lax.cond(
            accept & ~solved,
            lambda: _next_step(problem, new, at, best.iterations),
            lambda: (search.step, 0.5 * search.fraction),
        )
        return _Iteration(
            best=choose(accept, new, best),
            allowed=jnp.where(accept, (1.0 - 1e-4) * size, search.allowed),
            step=step,
            fraction=fraction,
            tries=jnp.where(accept, 0, search.tries + 1),
            terminate=solved | at_rounding | (~accept & (search.tries >= _TRIES)),
        )

    best = jax.lax.while_loop(proceed, iterate, _begin(problem, start)).best
    if not chain.law.remembers:
        return best
    # Not carried through the loop: it is long, and only that of the last point counts.
    modes = best.point.unknowns.modes
    return best._replace(
        material=flexure_states(chain, modes, memory.material, with_pose=False).memory
    )


def _begin(problem: NewtonProblem, start: Iterate) -> _Iteration:
    """The search before anything is evaluated: its first point is the start."""
    nowhere = NewtonResult(
        point=start,
        slid=problem.memory.slid,
        bound=problem.memory.bound,
        material=(),
        stroke=jnp.zeros(problem.chain.tendons),
        residual=jnp.array(jnp.inf),
        iterations=jnp.array(-1),
        converged=jnp.array(False),
    )
    return _Iteration(
        best=nowhere,
        allowed=jnp.array(jnp.inf),
        step=jax.tree.map(jnp.zeros_like, start),
        fraction=jnp.ones(()),
        tries=jnp.zeros((), int),
        terminate=jnp.array(False),
    )


def _tolerance(chain: Chain, start: Iterate, settings: Settings) -> Float[Array, ""]:
    """Tolerance for these tensions: rounding grows with the moments that must balance."""
    height = jnp.max(jnp.sum(chain.rods.length, axis=-1))
    softest = jnp.min(jnp.where(chain.rods.padding_mask > 0.0, jnp.inf, chain.stiffness))
    turn_per_newton = height / softest
    largest_tension = jnp.max(jnp.maximum(start.base_tension, 0.0), initial=0.0)
    growth = jnp.minimum(1.0 + largest_tension * turn_per_newton, _LARGEST_GROWTH)
    return settings.tolerance * growth


def _result(
    chain: Chain,
    command: Command,
    point: Iterate,
    at: Evaluation,
    residual: Float[Array, ""],
    iterations: Int[Array, ""],
    within: Bool[Array, ""],
) -> NewtonResult:
    """Result at a point that is within the tolerance, or not."""
    return NewtonResult(
        point=point,
        slid=tuple(span.slid for span in at.spans),
        bound=tuple(span.bound for span in at.spans),
        material=(),
        stroke=stroke(chain, point.base_tension, at.base),
        residual=residual,
        iterations=iterations,
        converged=within
        & tension_is_bounded(chain, command, point.base_tension)
        & _is_possible(chain, at),
    )


def _is_possible(chain: Chain, at: Evaluation) -> Bool[Array, ""]:
    """Whether no notch is opened so far that its law of flattening has no meaning."""
    ends = chain.rods.section.ends
    if ends is None:
        return jnp.array(True)
    curvature = in_space(at.flexure.strain)[..., 1]
    return ~jnp.any((curvature < 0.0) & (ends.slope_factor(curvature) < 0.0))


def _next_step(
    problem: NewtonProblem, new: NewtonResult, at: Evaluation, iterations: Int[Array, ""]
) -> tuple[Iterate, Float[Array, ""]]:
    """Step from an accepted point, and the fraction of it to try first."""
    chain, command, memory, last_tension, predicts = problem
    point = new.point
    step = linear_step(chain, command, point.unknowns, memory, point.base_tension, at)
    step = limit_slack(chain, point, step)
    # Where strokes are commanded, contacts that turn round must not be held up on their way.
    by_tension = command.by_stroke is None
    limited = partial(limit_closing, chain, point.unknowns, at, step)
    turning = limited(jnp.ones(())) if by_tension else step
    turn = jnp.max(jnp.abs(turning.unknowns.modes))
    logs = [jnp.max(jnp.abs(leaf), initial=0.0) for leaf in step.unknowns.log_ratio]
    log_ratio = jnp.max(jnp.array([0.0, *logs]))
    by_turn = jnp.minimum(1.0, _LARGEST_TURN / turn)
    whole = jnp.minimum(by_turn, LARGEST_LOG_RATIO / log_ratio)
    if by_tension:
        return limited(whole), whole
    assert command.by_stroke is not None
    early = (iterations < _PREDICTED) & predicts
    early = jnp.any(command.by_stroke) & early & (new.residual > _PREDICTED_ABOVE)

    def predicted() -> Iterate:
        limits = memory._replace(bound=new.bound)
        return predict_contacts(chain, command, limits, last_tension, point, step, whole, by_turn)

    chosen = jax.lax.cond(early, predicted, lambda: step)
    part = jnp.where(early, by_turn, whole)
    if predicts is not True:
        held = limit_closing(chain, point.unknowns, at, chosen, part)
        chosen = choose(predicts, chosen, held)
    return chosen, part
