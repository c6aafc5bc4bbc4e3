"""Newton's method with a line search on the whole chain, from a state near the solution."""

from __future__ import annotations

import dataclasses
from functools import partial
from typing import Any, NamedTuple, cast

from jax.flatten_util import ravel_pytree
from jaxtyping import Array, Bool, Float, Int

from notchflex._jax import Pytree, choose, jax, jnp
from notchflex.loads.command import Command
from notchflex.mechanics.chain import Chain, flexure_states
from notchflex.mechanics.flexure import in_space
from notchflex.solver.linear_step import linear_step
from notchflex.solver.residual import (
    Evaluation,
    Iterate,
    Memory,
    Unknowns,
    command_residual,
    evaluate,
    is_active,
    notch_heights,
    of_group,
    rounding_growth,
    slip_mask,
    stroke,
    tension_is_bounded,
    warmed,
    without_slack,
)

# A limited step goes slightly beyond the gap, so that the contact counts as closed: by these parts
# of the gap and of the notch's height. Without the latter a gap that is a rounding error would
# stop every step, and the contact would neither close nor open.
_OVERTRAVEL, _OVERLAP = 1e-6, 1e-12


def limit_closing(
    chain: Chain,
    unknowns: Unknowns,
    evaluation: Evaluation,
    step: Iterate,
    fraction: Float[Array, ""],
) -> Iterate:
    """Limit a step so that its fraction to be taken bends no notch beyond contact."""
    # Beyond, the material law would be evaluated at an impossible strain, and the next step would
    # open the contact again.
    modes = step.unknowns.modes
    for group, response, force in zip(
        chain.contact_pairs, evaluation.contacts, unknowns.contact_force, strict=True
    ):
        if response.slope is None:
            continue  # several flexures bring these bodies together
        closing = -fraction * jnp.einsum("nlm,nm->nl", response.slope, modes)
        is_open = ~is_active(chain, group, force, response.gap)
        stops = (
            is_open & (closing > response.gap) & (response.gap > 0.0) & (group.has_contact > 0.0)
        )
        reach = (1.0 + _OVERTRAVEL) * response.gap + _OVERLAP * notch_heights(chain)[:, None]
        allowed = jnp.where(stops, reach / jnp.where(stops, closing, 1.0), 1.0)
        modes = modes * jnp.minimum(jnp.min(allowed, axis=-1, keepdims=True), 1.0)
    return step._replace(unknowns=step.unknowns._replace(modes=modes))


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
        """All settings, in the order of the fields."""
        return dataclasses.astuple(self)

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
        presses: Which contacts of notches press there.
        residual: Largest scaled residual there.
        iterations: Number of iterations.
        converged: Whether the residual is within the tolerance.
    """

    point: Iterate
    slid: tuple[Float[Array, "n t 2"], ...]
    bound: tuple[Float[Array, "n t 2"], ...]
    material: Any
    stroke: Float[Array, " t"]
    presses: tuple[Bool[Array, "n l"], ...]
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
        backtracks: Number of points tried from the best one.
        terminate: Whether the search is over.
    """

    best: NewtonResult
    allowed: Float[Array, ""]
    step: Iterate
    fraction: Float[Array, ""]
    backtracks: Int[Array, ""]
    terminate: Bool[Array, ""]


# Largest rotation of a flexure, rad, and largest change of a log ratio in one step; beyond, the
# linear model is not valid.
_MAX_ROTATION_STEP, _MAX_LOG_RATIO_STEP = 0.5, 1.0
_MAX_BACKTRACKS = 7
# The line search does not guard the first steps: where the motion of a tendon reverses, all its
# contacts leave their bounds at once, and the residual rises before it falls; so it does for every
# notch that closes (tests/analysis/test_closing.py). What snaps is lost by more such steps.
_UNGUARDED_STEPS = 6
# A residual below this multiple of the tolerance that no longer falls is rounding error.
_ROUNDING = 100.0


def newton(
    chain: Chain,
    command: Command,
    memory: Memory,
    start: Iterate,
    settings: Settings,
    residual_target: Float[Array, ""],
) -> NewtonResult:
    """Find the equilibrium near a point, to `residual_target` if above the tolerance."""
    # Every pass of the loop evaluates one point: the start, a full Newton step, or half of the
    # fraction tried before if that did not reduce the residual.
    tolerance = settings.tolerance * rounding_growth(chain, start)

    def proceed(search: _Iteration) -> Bool[Array, ""]:
        return ~search.terminate & (search.best.iterations <= settings.max_iterations)

    def iterate(search: _Iteration) -> _Iteration:
        best = search.best
        trial = jax.tree.map(lambda x, dx: x + search.fraction * dx, best.point, search.step)
        evaluation = evaluate(chain, trial, memory, command.applied)
        demand = command_residual(chain, command, memory.sheath, evaluation.base)
        scaled_residual = ravel_pytree((evaluation.residual, demand))[0]
        largest, size = jnp.max(jnp.abs(scaled_residual)), jnp.linalg.norm(scaled_residual)
        near, falls = best.residual < _ROUNDING * tolerance, size <= search.allowed
        unguarded = (best.iterations < _UNGUARDED_STEPS) & ~near
        at_rounding = near & (largest >= best.residual) & ~falls
        exhausted = search.backtracks >= _MAX_BACKTRACKS
        accept = falls | (jnp.isfinite(size) & (unguarded | (exhausted & ~at_rounding)))
        solved = accept & (largest < jnp.maximum(tolerance, residual_target))
        within = solved | (largest < _ROUNDING * tolerance)
        new = _result(chain, command, trial, evaluation, largest, best.iterations + 1, within)
        following = jax.lax.cond(
            accept & ~solved,
            lambda: _next_step(chain, command, memory, trial, evaluation),
            lambda: (search.step, 0.5 * search.fraction),
        )
        return _Iteration(
            choose(accept, new, best),
            jnp.where(accept, (1.0 - 1e-4) * size, search.allowed),
            *following,
            backtracks=jnp.where(accept, 0, search.backtracks + 1),
            terminate=solved | at_rounding | (~accept & exhausted),
        )

    best = jax.lax.while_loop(proceed, iterate, _begin(chain, memory, start)).best
    # Forces of contacts that do not press, and tensions of slack tendons, are exactly zero.
    point = without_slack(chain, command, best.point, best.stroke)
    pushing = jax.tree.map(
        lambda presses, force: jnp.where(presses, jnp.maximum(force, 0.0), 0.0),
        best.presses,
        point.unknowns.contact_force,
    )
    point = point._replace(unknowns=point.unknowns._replace(contact_force=pushing))
    best = best._replace(point=choose(best.converged, point, best.point))
    if not chain.law.remembers:
        return best
    # The loop does not carry the memory: it is long, and only that of the last point counts.
    modes, chain = best.point.unknowns.modes, warmed(chain, command.applied)
    state = flexure_states(chain, modes, memory.material, with_pose=False)
    return best._replace(material=state.memory)


def _begin(chain: Chain, memory: Memory, start: Iterate) -> _Iteration:
    """Return the state of the line search before the first evaluation."""
    unevaluated = NewtonResult(
        point=start,
        slid=memory.slid,
        bound=memory.bound,
        material=(),
        stroke=jnp.zeros(chain.tendons),
        presses=tuple(group.has_contact > 1.0 for group in chain.contact_pairs),
        residual=jnp.array(jnp.inf),
        iterations=jnp.array(-1),
        converged=jnp.array(False),
    )
    return _Iteration(
        best=unevaluated,
        allowed=jnp.array(jnp.inf),
        step=jax.tree.map(jnp.zeros_like, start),
        fraction=jnp.ones(()),
        backtracks=jnp.zeros((), int),
        terminate=jnp.array(False),
    )


def _result(
    chain: Chain,
    command: Command,
    point: Iterate,
    evaluation: Evaluation,
    residual: Float[Array, ""],
    iterations: Int[Array, ""],
    within: Bool[Array, ""],
) -> NewtonResult:
    """Assemble the result at a point: no notch may be beyond the range of its law of flattening."""
    converged = within & tension_is_bounded(chain, command, point)
    ends = chain.rods.section.ends
    if ends is not None:
        curvature = in_space(evaluation.flexure.strain)[..., 1]
        beyond = (curvature < 0.0) & (ends.slope_factor(curvature) < 0.0)
        converged = converged & ~jnp.any(beyond)
    return NewtonResult(
        point=point,
        slid=tuple(span.slid for span in evaluation.spans),
        bound=tuple(span.bound for span in evaluation.spans),
        material=(),
        stroke=stroke(chain, evaluation.base),
        presses=tuple(
            is_active(chain, group, force, response.gap)
            for group, force, response in zip(
                chain.contact_pairs, point.unknowns.contact_force, evaluation.contacts, strict=True
            )
        ),
        residual=residual,
        iterations=iterations,
        converged=converged,
    )


def _next_step(
    chain: Chain, command: Command, memory: Memory, point: Iterate, evaluation: Evaluation
) -> tuple[Iterate, Float[Array, ""]]:
    """Return the step from a point, and the fraction of it to try first."""
    step = linear_step(chain, command, point, memory, evaluation)
    step = limit_slack(chain, point, step)
    limited = partial(limit_closing, chain, point.unknowns, evaluation, step)
    rotation = jnp.max(jnp.abs(limited(jnp.ones(())).unknowns.modes))
    log_ratio = jnp.max(jnp.abs(ravel_pytree(step.unknowns.log_ratio)[0]), initial=0.0)
    fraction = jnp.minimum(1.0, _MAX_ROTATION_STEP / rotation)
    fraction = jnp.minimum(fraction, _MAX_LOG_RATIO_STEP / log_ratio)
    return limited(fraction), fraction


# Predictor of the tensions along a tendon: the play operator of hysteresis.
#
# Where the loads on the bodies do not change, the tension beyond every contact is constant until
# the tension before it leaves the friction band of the contact (Gao 2017, eq. 26, as a local rule).
# From base to tip this gives the direction in which every contact slides; Newton's method alone
# would find one contact at a time.
#
# A contact with log ratio r and bound l absorbs l - r of a rise of ln T before it, or l + r of a
# fall, and transmits the rest. Cumulative sums from the base therefore give all contacts at once.

# Fractions of the closing force below which a tendon is nearly slack, or below the solver's
# tolerance; limit of the change of its log ratios in one step (only their sign counts).
_NEARLY_SLACK, _NEGLIGIBLE, _SMALL_LOG_RATIO = 1e-8, 1e-14, 0.1
# Largest ratio that a contact without its constant loss is predicted to hold.
_MAX_GROWTH = 1e3
# Tensions below this (N) count as slack, so that logarithms stay finite.
_MIN_TENSION = 1e-100


def predict_log_ratios(
    chain: Chain, before: Float[Array, " t"], base_tension: Float[Array, " t"], memory: Memory
) -> tuple[Float[Array, "n t 2"], ...]:
    """Predict the log ratios of all contacts from base tensions before and now, N."""
    predicted = []
    for group, old_ratio, bound in zip(chain.groups, memory.log_ratio, memory.bound, strict=True):
        old, new = (
            jnp.maximum(of_group(tension, group), _MIN_TENSION)
            for tension in (before, base_tension)
        )
        slips = slip_mask(group)
        loss = chain.friction.constant_loss(0.0 * slips)  # at rest: it suffices for a prediction
        if loss is not None:
            loss, offset = slips * loss, chain.friction.offset()
            predicted.append(_predict_sequentially(old, new, offset, old_ratio, bound, loss))
            continue
        change = jnp.broadcast_to(jnp.log(new / old)[None, :, None], old_ratio.shape)
        rise, fall = (_cumulate(jnp.maximum(bound - side * old_ratio, 0.0)) for side in (1.0, -1.0))
        change_beyond = jnp.maximum(change - rise, 0.0) + jnp.minimum(change + fall, 0.0)
        # The change before an edge is the change beyond the previous one, perhaps of another gap.
        at_exit = jnp.concatenate([change[:1, :, :1], change_beyond[:-1, :, 1:]])
        change_before = jnp.concatenate([at_exit, change_beyond[..., :1]], axis=-1)
        # A contact without a change sticks, slightly within its bound.
        stuck = (1.0 - 1e-13) * old_ratio
        sliding = jnp.clip(old_ratio + change_before, -bound, bound)
        predicted.append(jnp.where(change_before == 0.0, stuck, sliding))
    return tuple(predicted)


def _cumulate(values: Float[Array, "n t 2"]) -> Float[Array, "n t 2"]:
    """Sum over all edges up to each, from base to tip."""
    both = jnp.cumsum(jnp.sum(values, axis=-1), axis=0)
    return jnp.stack([both - values[..., 1], both], axis=-1)


def limit_slack(chain: Chain, point: Iterate, step: Iterate) -> Iterate:
    """Limit the log-ratio step of slack and nearly slack tendons."""
    # Without tension their log ratios have no effect, and a sticking contact would change them at
    # random: only the direction of sliding matters. They must not shorten the rest of the step.
    # With a constant loss a slack tendon may be tight beyond its first contact.
    tension = jnp.maximum(jnp.abs(point.base_tension), jnp.abs(step.base_tension))
    tension = tension + chain.friction.offset()
    relative = tension / chain.closing_force
    limits = jnp.where(relative <= _NEGLIGIBLE, _SMALL_LOG_RATIO, _MAX_LOG_RATIO_STEP)
    limits = jnp.where(relative <= _NEARLY_SLACK, limits, jnp.inf)
    logs = tuple(
        jnp.clip(change, -limit, limit)
        for group, change in zip(chain.groups, step.unknowns.log_ratio, strict=True)
        for limit in (of_group(limits, group)[None, :, None],)
    )
    return step._replace(unknowns=step.unknowns._replace(log_ratio=logs))


def _predict_sequentially(
    old: Float[Array, " t"],
    new: Float[Array, " t"],
    offset: Float[Array, ""] | float,
    remembered: Float[Array, "n t 2"],
    limits: Float[Array, "n t 2"],
    loss: Float[Array, "n t 2"],
) -> Float[Array, "n t 2"]:
    """Predict log ratios contact by contact, for laws with a constant loss."""
    # Bounds then depend on the tension, so cumulative sums over contacts do not apply.

    def step(tensions: tuple[Array, Array], contact: tuple[Array, ...]) -> Any:
        old, new = tensions
        ratio, limit, force = contact
        # The bound of the law without the loss follows from the limit in the last direction.
        loading = jnp.maximum(old - force, 0.0) / jnp.maximum(
            (old + offset) * jnp.exp(-limit) - offset, _MIN_TENSION
        )
        unloading = ((old + offset) * jnp.exp(limit) - offset - force) / jnp.maximum(
            old, _MIN_TENSION
        )
        growth = jnp.clip(jnp.where(ratio < 0.0, unloading, loading), 1.0, _MAX_GROWTH)
        old_beyond = (old + offset) * jnp.exp(-ratio) - offset
        lowest = jnp.maximum(new - force, 0.0) / growth
        tension_beyond = jnp.clip(old_beyond, lowest, new * growth + force)
        predicted = jnp.log((new + offset) / (tension_beyond + offset))
        stuck = (1.0 - 1e-13) * ratio
        return (old_beyond, tension_beyond), jnp.where(new == old, stuck, predicted)

    edges = tuple(
        jnp.moveaxis(values, 2, 1).reshape(-1, len(old)) for values in (remembered, limits, loss)
    )
    log_ratios = jax.lax.scan(step, (old, new), edges)[1]
    return jnp.moveaxis(log_ratios.reshape(-1, 2, len(old)), 1, 2)
