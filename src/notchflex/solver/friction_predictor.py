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

from jaxtyping import Array, Float

from notchflex._jax import jnp
from notchflex.mechanics.chain import Chain
from notchflex.solver.element import Memory

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
