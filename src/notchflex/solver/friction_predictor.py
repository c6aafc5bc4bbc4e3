"""A good guess of the tensions along a tendon: the play operator.

Where the loads on the bodies do not change, the tension behind every contact stays as it is unless
the tension before it leaves the band that the contact can bear (physics of Gao 2017, eq. 26, as a
local rule; the play operator of hysteresis). From base to tip it tells at once which contacts slide
which way. Newton's method alone would find that one contact at a time.

A contact with log ratio r, of at most l, takes l - r of a rise of ln T before it, or l + r of a
fall, and hands on the rest. So the contacts up to any one together take the sums of these, and no
contact waits for the one before.
"""

from __future__ import annotations

from typing import Any

from jaxtyping import Array, Float

from notchflex._jax import jax, jnp
from notchflex.mechanics.chain import Chain
from notchflex.mechanics.friction.registry import LEAST_RATIO
from notchflex.solver.element import Memory
from notchflex.solver.residual import holds

# Tensions below this (N) count as slack, so that logarithms stay finite.
_SLACK = 1e-100


def played(
    chain: Chain,
    before: Float[Array, " t"],
    now: Float[Array, " t"],
    memory: Memory,
) -> tuple[Float[Array, "n t 2"], ...]:
    """Log ratios at all contacts for new base tensions.

    Args:
        chain: The chain.
        before: Base tensions of the last solved state, N.
        now: The new ones.
        memory: What the contacts remember of that state.

    Returns:
        Log ratios in the form of the unknowns.
    """
    guesses = []
    for group, remembered, limits in zip(chain.groups, memory.log_ratio, memory.bound, strict=True):
        numbers = jnp.array(group.numbers)
        old, new = (jnp.maximum(tension[numbers], _SLACK) for tension in (before, now))
        none = jnp.zeros_like(group.natural_gap)  # a loss at rest is good enough for a guess
        losses = chain.friction.constant_loss(none, none)
        if losses is not None:
            old, new = (chain.friction.least_taut(one, none, none) for one in (old, new))
            loss = holds(group) * jnp.stack(losses, axis=-1)
            guesses.append(_march(old, new, remembered, limits, loss))
            continue
        change = jnp.broadcast_to(jnp.log(new / old)[None, :, None], remembered.shape)
        rise, fall = (_up_to(jnp.maximum(limits - way * remembered, 0.0)) for way in (1.0, -1.0))
        behind = jnp.maximum(change - rise, 0.0) + jnp.minimum(change + fall, 0.0)
        # Before an edge stands what is behind the edge before, which may be of the gap before.
        gaps = jnp.concatenate([change[:1, :, :1], behind[:-1, :, 1:]])
        ahead = jnp.concatenate([gaps, behind[..., :1]], axis=-1)
        # What nothing drives sticks: it stands within its bound, if only just.
        stuck = (1.0 - 1e-13) * remembered
        driven = jnp.clip(remembered + ahead, -limits, limits)
        guesses.append(jnp.where(ahead == 0.0, stuck, driven))
    return tuple(guesses)


def _up_to(values: Float[Array, "n t 2"]) -> Float[Array, "n t 2"]:
    """Sums over all edges up to each, base to tip."""
    both = jnp.cumsum(jnp.sum(values, axis=-1), axis=0)
    return jnp.stack([both - values[..., 1], both], axis=-1)


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
