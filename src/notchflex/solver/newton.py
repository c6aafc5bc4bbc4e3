"""Newton's method on the whole chain, from a state near the answer, with a line search."""

from __future__ import annotations

import dataclasses
from functools import partial
from typing import Any, NamedTuple, cast

from jax.flatten_util import ravel_pytree
from jaxtyping import Array, Bool, Float, Int

from notchflex._jax import jax, jnp
from notchflex._pytree import Pytree
from notchflex.loads.command import Command
from notchflex.mechanics.chain import Chain
from notchflex.solver.actuation import command_residual, stroke, tension_is_bounded
from notchflex.solver.block_elimination import NewtonStep, linear_step
from notchflex.solver.element import Memory, Unknowns, is_active, notch_heights
from notchflex.solver.friction_predictor import predict_log_ratios
from notchflex.solver.residual import Evaluation, evaluate


class Settings(Pytree, eq=True):
    """How hard the solver tries.

    Attributes:
        tolerance: Largest scaled imbalance (about an angle, rad) of a solved state.
        max_iterations: Newton iterations for one load step.
        max_load_steps: Parts a load may be cut into before the solver gives up.
        smallest_load_step: Smallest such part, of the whole load.
        max_all_iterations: Newton iterations for a load, all its parts together: a load that no
            shape can bear is given up after a while.
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
        """Settings of a compiled program, from all numbers in order."""
        return cls(*cast("list[Any]", [numbers[i] for i in range(len(numbers))]))


DEFAULT = Settings()


class Iterate(NamedTuple):
    """A guess or an answer: the unknowns and the base tensions."""

    unknowns: Unknowns
    base_tension: Float[Array, " t"]


class NewtonResult(NamedTuple):
    """Where Newton's method ended.

    Attributes:
        point: The answer, or the last guess.
        slid: Tendon slid over the contacts there, mm.
        bound: Largest log ratios of the contacts there.
        stroke: Tendon drawn out at the base there, mm.
        residual: Largest scaled imbalance there.
        iterations: Iterations taken.
        converged: Whether the imbalance is within the tolerance.
    """

    point: Iterate
    slid: tuple[Float[Array, "n t 2"], ...]
    bound: tuple[Float[Array, "n t 2"], ...]
    stroke: Float[Array, " t"]
    residual: Float[Array, ""]
    iterations: Int[Array, ""]
    converged: Bool[Array, ""]


class _Search(NamedTuple):
    """State of the search: the best point, and the part of a step that is tried from it."""

    best: NewtonResult
    allowed: Float[Array, ""]
    step: Iterate
    part: Float[Array, ""]
    tries: Int[Array, ""]
    over: Bool[Array, ""]


# A step may turn a flexure by so much (rad) and change a log ratio by so much; beyond, the
# linear model says nothing of use. Both are far above what a good step needs.
_LARGEST_TURN = 0.5
_LARGEST_LOG_RATIO = 1.0
_TRIES = 7
# The first steps are taken whole, whatever they do to the imbalance: where a tendon turns round,
# all its contacts must leave their bound at once, and the way there is not downhill.
_UNLIMITED = 8
# With a stroke given, contacts are put by the play operator in so many first iterations, while the
# imbalance is above this.
_PLAYED = 15
_PLAYED_ABOVE = 1e-4
# A state whose imbalance has stopped falling at this multiple of the tolerance is as good as
# rounding allows.
_ROUNDING = 100.0
_LARGEST_GROWTH = 1e4
# Lips are brought together by a little more than their gap, so that they count as closed: by this
# part of the gap, and of the notch's height. Without the latter a gap that is a rounding error
# would hold every step up at itself, and the lips would neither close nor open.
_BEYOND, _OVERLAP = 1e-6, 1e-12


def newton(
    chain: Chain,
    command: Command,
    memory: Memory,
    before: Float[Array, " t"],
    start: Iterate,
    settings: Settings,
    enough: Float[Array, ""],
) -> NewtonResult:
    """Find the equilibrium under a command near a starting point.

    Every pass of the loop evaluates one point: the start, a full Newton step, or half of the
    part tried before where that did not lessen the imbalance.

    Args:
        chain: The chain.
        command: What is demanded of the tendons.
        memory: What the contacts remember; not changed.
        before: Base tensions of the last solved state, N.
        start: Where to begin.
        settings: How hard to try.
        enough: Imbalance that is small enough, should it be above the tolerance.

    Returns:
        The result; a failure is told by `converged`, never raised.
    """
    # Rounding grows with the moments that must balance, so the tolerance does, within reason.
    height = jnp.max(jnp.sum(chain.rods.length, axis=-1))
    softest = jnp.min(jnp.where(chain.rods.padding_mask > 0.0, jnp.inf, chain.stiffness))
    turn_per_newton = height / softest
    largest_tension = jnp.max(jnp.maximum(start.base_tension, 0.0), initial=0.0)
    growth = jnp.minimum(1.0 + largest_tension * turn_per_newton, _LARGEST_GROWTH)
    tolerance = settings.tolerance * growth
    small_enough = jnp.maximum(tolerance, enough)

    def searching(search: _Search) -> Bool[Array, ""]:
        return ~search.over & (search.best.iterations <= settings.max_iterations)

    def iterate(search: _Search) -> _Search:
        best = search.best
        point = jax.tree.map(lambda at, by: at + search.part * by, best.point, search.step)
        here = (point.unknowns, memory, point.base_tension)
        at = evaluate(chain, *here, command.applied)
        demand = command_residual(chain, command, point.base_tension, at.base)
        residual = ravel_pytree((at.residual, demand))[0]
        largest, size = jnp.max(jnp.abs(residual)), jnp.linalg.norm(residual)
        unlimited = (best.iterations < _UNLIMITED) & (best.residual >= _ROUNDING * tolerance)
        falls = size <= search.allowed
        better = falls | (unlimited & jnp.isfinite(size))
        near = best.residual < _ROUNDING * tolerance
        at_rounding = near & (largest >= best.residual) & ~falls
        taken = better | (jnp.isfinite(size) & (search.tries >= _TRIES) & ~at_rounding)
        solved = taken & (largest < small_enough)
        found = NewtonResult(
            point=point,
            slid=tuple(span.slid for span in at.spans),
            bound=tuple(span.bound for span in at.spans),
            stroke=stroke(chain, point.base_tension, at.base),
            residual=largest,
            iterations=best.iterations + 1,
            converged=(solved | (largest < _ROUNDING * tolerance))
            & tension_is_bounded(chain, command, point.base_tension),
        )

        def again() -> tuple[Iterate, Array]:
            step = linear_step(chain, command, *here, at)
            step = _moderate(chain, point, step)
            # Where strokes are given, contacts that turn round must not be held up on their way.
            stops = command.by_stroke is None
            stopped = partial(_stopped_by_lips, chain, point.unknowns, at, step)
            turning = stopped(jnp.ones(())) if stops else step
            turn = jnp.max(jnp.abs(turning.unknowns.modes))
            logs = [jnp.max(jnp.abs(leaf), initial=0.0) for leaf in step.unknowns.log_ratio]
            log_ratio = jnp.max(jnp.array([0.0, *logs]))
            by_turn = jnp.minimum(1.0, _LARGEST_TURN / turn)
            whole = jnp.minimum(by_turn, _LARGEST_LOG_RATIO / log_ratio)
            if stops:
                step = stopped(whole)
                return Iterate(step.unknowns, step.base_tension), whole
            assert command.by_stroke is not None
            early = (
                jnp.any(command.by_stroke) & (best.iterations < _PLAYED) & (largest > _PLAYED_ABOVE)
            )
            limits = memory._replace(bound=found.bound)

            def contacts_put() -> NewtonStep:
                return _contacts_put(chain, command, limits, before, point, step, whole, by_turn)

            chosen = jax.lax.cond(early, contacts_put, lambda: step)
            part = jnp.where(early, by_turn, whole)
            return Iterate(chosen.unknowns, chosen.base_tension), part

        step, part = jax.lax.cond(taken & ~solved, again, lambda: (search.step, 0.5 * search.part))
        return _Search(
            best=jax.tree.map(lambda old, new: jnp.where(taken, new, old), best, found),
            allowed=jnp.where(taken, (1.0 - 1e-4) * size, search.allowed),
            step=step,
            part=part,
            tries=jnp.where(taken, 0, search.tries + 1),
            over=solved | at_rounding | (~taken & (search.tries >= _TRIES)),
        )

    nowhere = NewtonResult(
        point=start,
        slid=memory.slid,
        bound=memory.bound,
        stroke=jnp.zeros(chain.tendons),
        residual=jnp.array(jnp.inf),
        iterations=jnp.array(-1),
        converged=jnp.array(False),
    )
    search = _Search(
        best=nowhere,
        allowed=jnp.array(jnp.inf),
        step=jax.tree.map(jnp.zeros_like, start),
        part=jnp.ones(()),
        tries=jnp.zeros((), int),
        over=jnp.array(False),
    )
    return jax.lax.while_loop(searching, iterate, search).best


def _moderate(chain: Chain, point: Iterate, step: NewtonStep) -> NewtonStep:
    """A step that changes log ratios of slack tendons by no more than is of use.

    Without tension they act on nothing, and a contact that sticks would throw them about: all that
    matters is which way it slides. The rest of the step need not be shortened for their sake.
    """
    slack = (point.base_tension == 0.0) & (step.base_tension == 0.0)
    logs = tuple(
        jnp.where(
            slack[jnp.array(group.numbers)][None, :, None],
            jnp.clip(own, -_LARGEST_LOG_RATIO, _LARGEST_LOG_RATIO),
            own,
        )
        for group, own in zip(chain.groups, step.unknowns.log_ratio, strict=True)
    )
    return step._replace(unknowns=step.unknowns._replace(log_ratio=logs))


def _stopped_by_lips(
    chain: Chain, unknowns: Unknowns, at: Evaluation, step: NewtonStep, part: Float[Array, ""]
) -> NewtonStep:
    """A step of which a part takes no notch farther than to where its lips meet.

    Beyond, the law of the material would be taken at a bend that the notch cannot have, and what
    follows from it would open the lips again.
    """
    modes = step.unknowns.modes
    for group, contact, force in zip(
        chain.contact_pairs, at.contacts, unknowns.contact_force, strict=True
    ):
        if contact.slope is None:
            continue  # bodies have more than one flexure to come together by
        closing = -part * jnp.einsum("nlm,nm->nl", contact.slope, modes)
        is_open = ~is_active(chain.contact_stiffness, group.has_contact, force, contact.gap)
        stops = is_open & (closing > contact.gap) & (contact.gap > 0.0) & (group.has_contact > 0.0)
        reach = (1.0 + _BEYOND) * contact.gap + _OVERLAP * notch_heights(chain)[:, None]
        allowed = jnp.where(stops, reach / jnp.where(stops, closing, 1.0), 1.0)
        modes = modes * jnp.minimum(jnp.min(allowed, axis=-1, keepdims=True), 1.0)
    return step._replace(unknowns=step.unknowns._replace(modes=modes))


def _contacts_put(
    chain: Chain,
    command: Command,
    memory: Memory,
    before: Float[Array, " t"],
    point: Iterate,
    step: NewtonStep,
    whole: Float[Array, ""],
    part: Float[Array, ""],
) -> NewtonStep:
    """A step whose contacts go where their tension would leave them, not where a linear step does.

    It serves while the tensions of tendons drawn by stroke are still to be found, and concerns only
    these. Stuck contacts, which make a tendon very stiff, must not throw its tension about: it
    stays moderate. Of the step that is returned `part` is to be taken, of the linear one it would
    have been `whole`.
    """
    assert command.by_stroke is not None
    tension = point.base_tension + whole * step.base_tension
    moderate = jnp.clip(
        tension, 0.5 * point.base_tension, 2.0 * point.base_tension + chain.closing_force
    )
    tension = command.either(moderate, tension)
    put = predict_log_ratios(chain, before, tension, memory)
    logs = []
    for group, there, here, own in zip(
        chain.groups, put, point.unknowns.log_ratio, step.unknowns.log_ratio, strict=True
    ):
        sought = command.by_stroke[jnp.array(group.numbers)][None, :, None]
        logs.append(jnp.where(sought, there - here, whole * own) / part)
    return NewtonStep(
        step.unknowns._replace(log_ratio=tuple(logs)),
        (tension - point.base_tension) / part,
    )
