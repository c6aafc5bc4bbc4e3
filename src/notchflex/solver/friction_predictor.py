"""Predictor of the tensions along a tendon: the play operator of hysteresis.

Where the loads on the bodies do not change, the tension behind every contact stays as it is unless
the tension before it leaves the friction band of the contact (Gao 2017, eq. 26, as a local rule).
From base to tip this gives which contacts slide which way; Newton's method alone would find that
one contact at a time.

A contact with log ratio r, of at most l, takes l - r of a rise of ln T before it, or l + r of a
fall, and transmits the rest. So the contacts up to any one together take the sums of these, and all
are found at once.
"""

from __future__ import annotations

from typing import Any

from jaxtyping import Array, Float

from notchflex._jax import jax, jnp
from notchflex.loads.command import Command
from notchflex.mechanics.chain import Chain
from notchflex.mechanics.friction.registry import LEAST_RATIO
from notchflex.solver.element import Memory
from notchflex.solver.linear_step.block_elimination import Iterate
from notchflex.solver.tendon_spans import slip_mask

LARGEST_LOG_RATIO = 1.0
"""A step may change a log ratio by so much; beyond, the linear model says nothing of use."""

# Base tensions up to these parts of the force that closes a notch act on next to nothing, and on
# nothing that the tolerance of the solver could show. A log ratio behind them may change by so much
# in a step: whichever way the contact slides, it is soon found.
_NEARLY_SLACK, _NOTHING, _SMALL_LOG_RATIO = 1e-8, 1e-14, 0.1
# Tensions below this (N) count as slack, so that logarithms stay finite.
_SLACK = 1e-100


def predict_log_ratios(
    chain: Chain, last_tension: Float[Array, " t"], base_tension: Float[Array, " t"], memory: Memory
) -> tuple[Float[Array, "n t 2"], ...]:
    """Predict the log ratios of all contacts for new base tensions.

    Args:
        chain: The chain.
        last_tension: Base tensions of the last solved state, N.
        base_tension: The new ones, N.
        memory: History of the contacts, as of that state.

    Returns:
        Log ratios in the form of the unknowns.
    """
    predicted = []
    for group, old_ratio, bound in zip(chain.groups, memory.log_ratio, memory.bound, strict=True):
        numbers = jnp.array(group.numbers)
        old, new = (
            jnp.maximum(tension[numbers], _SLACK) for tension in (last_tension, base_tension)
        )
        none = jnp.zeros_like(group.natural_gap)  # a loss at rest is good enough for a prediction
        losses = chain.friction.constant_loss(none, none)
        if losses is not None:
            old, new = (chain.friction.least_taut(one, none, none) for one in (old, new))
            loss = slip_mask(group) * jnp.stack(losses, axis=-1)
            predicted.append(_march(old, new, old_ratio, bound, loss))
            continue
        change = jnp.broadcast_to(jnp.log(new / old)[None, :, None], old_ratio.shape)
        rise, fall = (_cumulate(jnp.maximum(bound - side * old_ratio, 0.0)) for side in (1.0, -1.0))
        behind = jnp.maximum(change - rise, 0.0) + jnp.minimum(change + fall, 0.0)
        # The change before an edge is that behind the edge before, which may be of the gap before.
        at_exit = jnp.concatenate([change[:1, :, :1], behind[:-1, :, 1:]])
        ahead = jnp.concatenate([at_exit, behind[..., :1]], axis=-1)
        # A contact that nothing drives sticks: it stays within its bound, if only just.
        stuck = (1.0 - 1e-13) * old_ratio
        sliding = jnp.clip(old_ratio + ahead, -bound, bound)
        predicted.append(jnp.where(ahead == 0.0, stuck, sliding))
    return tuple(predicted)


def _cumulate(values: Float[Array, "n t 2"]) -> Float[Array, "n t 2"]:
    """Sums over all edges up to each, base to tip."""
    both = jnp.cumsum(jnp.sum(values, axis=-1), axis=0)
    return jnp.stack([both - values[..., 1], both], axis=-1)


def limit_slack(chain: Chain, point: Iterate, step: Iterate) -> Iterate:
    """Limit the log-ratio step of slack tendons, and of those that are all but slack.

    Without tension they act on nothing, and a sticking contact would change them at random: all
    that matters is which way it slides. The rest of the step need not be shortened for their sake.
    """
    tension = jnp.maximum(jnp.abs(point.base_tension), jnp.abs(step.base_tension))
    part = tension / chain.closing_force
    most = jnp.where(part <= _NOTHING, _SMALL_LOG_RATIO, LARGEST_LOG_RATIO)
    most = jnp.where(part <= _NEARLY_SLACK, most, jnp.inf)
    logs = tuple(
        jnp.clip(change, -limit, limit)
        for group, change in zip(chain.groups, step.unknowns.log_ratio, strict=True)
        for limit in (most[jnp.array(group.numbers)][None, :, None],)
    )
    return step._replace(unknowns=step.unknowns._replace(log_ratio=logs))


def predict_contacts(
    chain: Chain,
    command: Command,
    memory: Memory,
    last_tension: Float[Array, " t"],
    point: Iterate,
    step: Iterate,
    whole: Float[Array, ""],
    part: Float[Array, ""],
) -> Iterate:
    """Replace the log ratios of a step by those that the friction predictor gives.

    For tendons driven by stroke, while their tensions are still to be found. Sticking contacts make
    a tendon very stiff; the change of its tension is limited. Of the step that is returned `part`
    is to be taken, of the linear one it would have been `whole`. `last_tension` are the base
    tensions (N) of the last solved state.
    """
    assert command.by_stroke is not None
    tension = point.base_tension + whole * step.base_tension
    moderate = jnp.clip(
        tension, 0.5 * point.base_tension, 2.0 * point.base_tension + chain.closing_force
    )
    tension = command.either(moderate, tension)
    predicted = predict_log_ratios(chain, last_tension, tension, memory)
    logs = []
    for group, there, here, change in zip(
        chain.groups, predicted, point.unknowns.log_ratio, step.unknowns.log_ratio, strict=True
    ):
        by_stroke = command.by_stroke[jnp.array(group.numbers)][None, :, None]
        logs.append(jnp.where(by_stroke, there - here, whole * change) / part)
    return Iterate(
        step.unknowns._replace(log_ratio=tuple(logs)), (tension - point.base_tension) / part
    )


def _march(
    old: Float[Array, " t"],
    new: Float[Array, " t"],
    remembered: Float[Array, "n t 2"],
    limits: Float[Array, "n t 2"],
    loss: Float[Array, "n t 2"],
) -> Float[Array, "n t 2"]:
    """Predict log ratios contact by contact where sliding costs a constant force too.

    Limits then depend on the tension, and no sum over several contacts tells what they hold.
    """

    def step(tensions: tuple[Array, Array], contact: tuple[Array, ...]) -> Any:
        old, new = tensions
        ratio, limit, force = contact
        part = force / jnp.maximum(old, LEAST_RATIO * jnp.maximum(force, _SLACK))
        pulled = limit + jnp.log(jnp.maximum(1.0 - part, LEAST_RATIO))
        let_go = jnp.log(jnp.maximum(jnp.exp(limit) - part, 1.0))
        bound = jnp.maximum(jnp.where(ratio < 0.0, let_go, pulled), 0.0)  # without the loss
        behind = old * jnp.exp(-ratio)
        lowest = jnp.maximum(new - force, LEAST_RATIO * new) * jnp.exp(-bound)
        onward = jnp.clip(behind, lowest, new * jnp.exp(bound) + force)
        guess = jnp.log(new / onward)
        stuck = (1.0 - 1e-13) * ratio
        return (behind, onward), jnp.where(new == old, stuck, guess)

    edges = tuple(
        jnp.moveaxis(values, 2, 1).reshape(-1, len(old)) for values in (remembered, limits, loss)
    )
    guesses = jax.lax.scan(step, (old, new), edges)[1]
    return jnp.moveaxis(guesses.reshape(-1, 2, len(old)), 1, 2)
