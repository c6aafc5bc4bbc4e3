"""A good guess of the tensions along a tendon: the play operator.

Where the loads on the bodies do not change, the tension behind every contact stays as it is unless
the tension before it leaves the band that the contact can bear (physics of Gao 2017, eq. 26, as a
local rule; the play operator of hysteresis). Marched from base to tip it tells at once which
contacts slide which way. Newton's method alone would find that one contact at a time.
"""

from __future__ import annotations

from jaxtyping import Array, Float

from notchflex._jax import jax, jnp
from notchflex.chain import Chain
from notchflex.statics.element import Memory

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

        def over_gap(
            tension: tuple[Array, Array], contact: tuple[Array, Array]
        ) -> tuple[tuple[Array, Array], Array]:
            ratio, limit = contact
            found = []
            for edge in (0, 1):
                old, new = tension
                old = old - ratio[:, edge]
                moved = jnp.clip(new - old, -limit[:, edge], limit[:, edge])
                tension = (old, new - moved)
                found.append(moved)
            return tension, jnp.stack(found, axis=-1)

        start = (
            jnp.log(jnp.maximum(before[numbers], _SLACK)),
            jnp.log(jnp.maximum(now[numbers], _SLACK)),
        )
        _, guess = jax.lax.scan(over_gap, start, (remembered, limits))
        guesses.append(guess)
    return tuple(guesses)
