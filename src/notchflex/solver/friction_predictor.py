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

from jaxtyping import Array, Float

from notchflex._jax import jnp
from notchflex.mechanics.chain import Chain
from notchflex.solver.element import Memory

# Tensions below this (N) count as slack, so that logarithms stay finite.
_SLACK = 1e-100


def predict_log_ratios(
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
