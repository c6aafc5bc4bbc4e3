"""Unknowns and history of every flexure, and its two complementarity laws: contact and friction.

Each law is written as one equation that Newton's method solves together with the equilibrium.
"""

from __future__ import annotations

from typing import Any, NamedTuple

from jaxtyping import Array, Bool, Float

from notchflex._jax import jnp
from notchflex.mechanics.chain import Chain
from notchflex.mechanics.contact import ContactGroup

# Friction law: x = clip(x + r (slip - c (x - x_prev))). The augmentation parameter r only affects
# convergence and drops out at the solution; the compliance c of sticking contacts keeps the law
# regular where a slack tendon leaves the tension ratio undefined. Slip is in heights of the notch,
# so that a scaled robot is solved in the same way.
AUGMENTATION = 8.0
MIN_STICK_COMPLIANCE = 1e-15


class Unknowns(NamedTuple):
    """Unknowns of all flexures, flexures as leading axis.

    Attributes:
        modes: Amplitudes of the strain modes.
        contact_force: Contact forces, N, for each kind of contacts.
        log_ratio: ln(tension on the base side / tip side) at both edges of the gap, for each
            group of tendons.
    """

    modes: Float[Array, "*n modes"]
    contact_force: tuple[Float[Array, "*n l"], ...]
    log_ratio: tuple[Float[Array, "*n t 2"], ...]


class Iterate(NamedTuple):
    """A point of Newton's method, or a step between two.

    Attributes:
        unknowns: The unknowns of all flexures.
        base_tension: The base tensions, N.
    """

    unknowns: Unknowns
    base_tension: Float[Array, " t"]


class Memory(NamedTuple):
    """History of the friction contacts and of the material, as of the last solved state.

    Attributes:
        log_ratio: Their log ratios.
        slid: Tendon slid over them, mm.
        bound: Their largest log ratios, for the predictor of the next state alone.
        material: Memory of the material at every node; () where it has none.
        damping: While a notch snaps: viscosity as a fraction of the stiffness at rest, and the
            modes that it refers to; None otherwise.
        stick_compliance: Additional slip over a sticking contact, in heights of the notch, per
            change of its log ratio; None for none.
    """

    log_ratio: tuple[Float[Array, "*n t 2"], ...]
    slid: tuple[Float[Array, "*n t 2"], ...]
    bound: tuple[Float[Array, "*n t 2"], ...]
    material: Any = ()
    damping: tuple[Float[Array, ""], Float[Array, "*n modes"]] | None = None
    stick_compliance: Float[Array, ""] | None = None

    @property
    def slip_per_log_ratio(self) -> Float[Array, ""] | float:
        """Slip over a sticking contact per change of its log ratio, in heights of the notch."""
        return (
            MIN_STICK_COMPLIANCE
            if self.stick_compliance is None
            else MIN_STICK_COMPLIANCE + self.stick_compliance
        )


def notch_heights(chain: Chain) -> Float[Array, " n"]:
    """Return the length of every flexure, mm: the scale of lengths."""
    return jnp.sum(chain.rods.length, axis=-1)


def trial_log_ratio(
    chain: Chain,
    log_ratio: Float[Array, "n t 2"],
    slid: Float[Array, "n t 2"],
    memory: Memory,
    k: int,
) -> Float[Array, "n t 2"]:
    """Compute the trial log ratios of the k-th group from the slip, before they are clipped."""
    slip = (slid - memory.slid[k]) / notch_heights(chain)[:, None, None]
    return log_ratio + AUGMENTATION * (
        slip - memory.slip_per_log_ratio * (log_ratio - memory.log_ratio[k])
    )


def clip_symmetric(value: Float[Array, ...], limit: Float[Array, ...]) -> Float[Array, ...]:
    """Clip to +-limit; an equal value counts as the limit, so that a contact at rest can slide."""
    return jnp.where(value >= limit, limit, jnp.where(value <= -limit, -limit, value))


def bound_side(value: Float[Array, ...], limit: Float[Array, ...]) -> Float[Array, ...]:
    """Return +1 where a log ratio lies on its upper bound, -1 on its lower, 0 inside."""
    near = 1e-9
    return jnp.where(value >= limit - near, 1, jnp.where(value <= -limit + near, -1, 0))


def is_active(
    chain: Chain, group: ContactGroup, force: Float[Array, "n l"], gap: Float[Array, "n l"]
) -> Bool[Array, "n l"]:
    """Return which contacts press, by Signorini's condition: force >= 0, gap >= 0, product 0."""
    return (force - chain.contact_stiffness[:, None] * gap > 0.0) & (group.has_contact > 0.0)


def signorini(
    chain: Chain, group: ContactGroup, force: Float[Array, "n l"], gap: Float[Array, "n l"]
) -> Float[Array, "n l"]:
    """Compute the residual of Signorini's condition, as a fraction of the notch's height."""
    by_force = force / (chain.contact_stiffness * notch_heights(chain))[:, None]
    by_gap = gap / notch_heights(chain)[:, None]
    return jnp.where(is_active(chain, group, force, gap), by_gap, by_force)
