"""Predictor of the tensions along a tendon: the play operator of hysteresis.

Where the loads on the bodies do not change, the tension beyond every contact is constant until the
tension before it leaves the friction band of the contact (Gao 2017, eq. 26, as a local rule).
From base to tip this gives the direction in which every contact slides; Newton's method alone would
find one contact at a time.

A contact with log ratio r and bound l absorbs l - r of a rise of ln T before it, or l + r of a
fall, and transmits the rest. Cumulative sums from the base therefore give all contacts at once.
"""

from __future__ import annotations

from typing import Any

from jaxtyping import Array, Float

from notchflex._jax import jax, jnp
from notchflex.loads.command import Command
from notchflex.mechanics.chain import Chain
from notchflex.solver.element import Iterate, Memory
from notchflex.solver.tendon_spans import slip_mask

MAX_LOG_RATIO_STEP = 1.0
"""Largest change of a log ratio in one step; beyond, the linear model is not valid."""

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
    """Predict the log ratios of all contacts for new base tensions.

    Args:
        chain: The chain.
        before: Base tensions of the last solved state, N.
        base_tension: The new ones, N.
        memory: History of the contacts, as of that state.

    Returns:
        Log ratios in the form of the unknowns.
    """
    predicted = []
    for group, old_ratio, bound in zip(chain.groups, memory.log_ratio, memory.bound, strict=True):
        numbers = jnp.array(group.numbers)
        old, new = (
            jnp.maximum(tension[numbers], _MIN_TENSION) for tension in (before, base_tension)
        )
        zero = jnp.zeros_like(group.natural_gap)  # the loss at rest suffices for a prediction
        losses = chain.friction.constant_loss(zero, zero)
        if losses is not None:
            loss, offset = slip_mask(group) * jnp.stack(losses, axis=-1), chain.friction.offset()
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
    """Limit the log-ratio step of slack and nearly slack tendons.

    Without tension their log ratios have no effect, and a sticking contact would change them at
    random: only the direction of sliding matters. They must not shorten the rest of the step.
    """
    # With a constant loss a slack tendon may be tight beyond its first contact.
    tension = jnp.maximum(jnp.abs(point.base_tension), jnp.abs(step.base_tension))
    tension = tension + chain.friction.offset()
    relative = tension / chain.closing_force
    limits = jnp.where(relative <= _NEGLIGIBLE, _SMALL_LOG_RATIO, MAX_LOG_RATIO_STEP)
    limits = jnp.where(relative <= _NEARLY_SLACK, limits, jnp.inf)
    logs = tuple(
        jnp.clip(change, -limit, limit)
        for group, change in zip(chain.groups, step.unknowns.log_ratio, strict=True)
        for limit in (limits[jnp.array(group.numbers)][None, :, None],)
    )
    return step._replace(unknowns=step.unknowns._replace(log_ratio=logs))


def predict_contacts(
    chain: Chain,
    command: Command,
    memory: Memory,
    last: Iterate,
    point: Iterate,
    step: Iterate,
    linear_fraction: Float[Array, ""],
    fraction: Float[Array, ""],
) -> Iterate:
    """Replace the log ratios of a step by those of the friction predictor.

    For tendons driven by stroke, whose tensions are unknown. Sticking contacts make a tendon very
    stiff, so the change of its tension is limited. `fraction` of the returned step is to be taken;
    of the linear step it would be `linear_fraction`. `last` is the last
    solved point.
    """
    assert command.by_stroke is not None
    tension = point.base_tension + linear_fraction * step.base_tension
    moderate = jnp.clip(
        tension, 0.5 * point.base_tension, 2.0 * point.base_tension + chain.closing_force
    )
    tension = command.either(moderate, tension)
    predicted = predict_log_ratios(chain, last.base_tension, tension, memory)
    logs = []
    for group, new, present, change in zip(
        chain.groups, predicted, point.unknowns.log_ratio, step.unknowns.log_ratio, strict=True
    ):
        by_stroke = command.by_stroke[jnp.array(group.numbers)][None, :, None]
        logs.append(jnp.where(by_stroke, new - present, linear_fraction * change) / fraction)
    return Iterate(
        step.unknowns._replace(log_ratio=tuple(logs)), (tension - point.base_tension) / fraction
    )


def _predict_sequentially(
    old: Float[Array, " t"],
    new: Float[Array, " t"],
    offset: Float[Array, ""] | float,
    remembered: Float[Array, "n t 2"],
    limits: Float[Array, "n t 2"],
    loss: Float[Array, "n t 2"],
) -> Float[Array, "n t 2"]:
    """Predict log ratios contact by contact, for laws with a constant loss.

    Bounds then depend on the tension, so cumulative sums over contacts do not apply.
    """

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
