"""What is sought and remembered at every flexure, and the two laws with a switch in them.

Contact and friction are conditions of the kind "one of two"; both are written as one equation that
Newton's method can take, and solved together with the balance.
"""

from __future__ import annotations

from typing import NamedTuple

from jaxtyping import Array, Bool, Float

from notchflex._jax import jnp
from notchflex.mechanics.chain import Chain

# The memory law x = clip(x + rate (slip - (x - x_prev) / stiction)). The rate is how strongly slip
# drives the logarithm while Newton searches, and drops out at the solution; the stiction only
# keeps the equation regular where a slack tendon makes the tension ratio meaningless. Both are
# per slip in notch_heights of the notch, so that a robot of another size is solved alike.
RATE = 8.0
STICTION = 1e15


class Unknowns(NamedTuple):
    """Unknowns of all flexures, flexures as leading axis.

    Attributes:
        modes: Amplitudes of the strain modes.
        contact_force: Contact forces of the lips, N, for each kind of lips.
        log_ratio: ln(tension on the base side / tip side) at both edges of the gap, for each
            group of tendons.
    """

    modes: Float[Array, "*n modes"]
    contact_force: tuple[Float[Array, "*n l"], ...]
    log_ratio: tuple[Float[Array, "*n t 2"], ...]


class Memory(NamedTuple):
    """What the contacts remember of the last solved state.

    Attributes:
        log_ratio: Their log ratios.
        slid: Tendon slid over them, mm.
        bound: Their largest log ratios, which only help to guess the next state.
    """

    log_ratio: tuple[Float[Array, "*n t 2"], ...]
    slid: tuple[Float[Array, "*n t 2"], ...]
    bound: tuple[Float[Array, "*n t 2"], ...]


def notch_heights(chain: Chain) -> Float[Array, " n"]:
    """Length of every flexure, mm: the scale of lengths."""
    return jnp.sum(chain.rods.length, axis=-1)


def trial_log_ratio(
    chain: Chain,
    log_ratio: Float[Array, "n t 2"],
    slid: Float[Array, "n t 2"],
    memory: Memory,
    k: int,
) -> Float[Array, "n t 2"]:
    """Log ratios as slip drives them, before their bound stops them, of the k-th group."""
    slip = (slid - memory.slid[k]) / notch_heights(chain)[:, None, None]
    return log_ratio + RATE * (slip - (log_ratio - memory.log_ratio[k]) / STICTION)


def clip_symmetric(value: Float[Array, ...], limit: Float[Array, ...]) -> Float[Array, ...]:
    """Clip to +-limit; at a tie the limit is followed, so that a contact at rest can slide."""
    return jnp.where(value >= limit, limit, jnp.where(value <= -limit, -limit, value))


def bound_side(value: Float[Array, ...], limit: Float[Array, ...]) -> Float[Array, ...]:
    """+1 where a log ratio lies on its upper bound, -1 on its lower, 0 inside."""
    near = 1e-9
    return jnp.where(value >= limit - near, 1, jnp.where(value <= -limit + near, -1, 0))


def is_active(
    stiffness: Float[Array, " n"],
    has_contact: Float[Array, "n l"],
    force: Float[Array, "n l"],
    gap: Float[Array, "n l"],
) -> Bool[Array, "n l"]:
    """Which lips press, by Signorini's condition: force >= 0, gap >= 0, product 0."""
    return (force - stiffness[:, None] * gap > 0.0) & (has_contact > 0.0)


def signorini(
    chain: Chain,
    has_contact: Float[Array, "n l"],
    force: Float[Array, "n l"],
    gap: Float[Array, "n l"],
) -> Float[Array, "n l"]:
    """What is left of Signorini's condition as one equation, scaled to be a part of a height."""
    stiffness = chain.contact_stiffness
    by_force = force / (stiffness * notch_heights(chain))[:, None]
    by_gap = gap / notch_heights(chain)[:, None]
    return jnp.where(is_active(stiffness, has_contact, force, gap), by_gap, by_force)
