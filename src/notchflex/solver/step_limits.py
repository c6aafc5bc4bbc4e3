"""Limit of Newton's step where a contact closes."""

from __future__ import annotations

from jaxtyping import Array, Float

from notchflex._jax import jnp
from notchflex.mechanics.chain import Chain
from notchflex.solver.element import Iterate, Unknowns, is_active, notch_heights
from notchflex.solver.residual import Evaluation

# A limited step goes slightly beyond the gap, so that the contact counts as closed: by these parts
# of the gap and of the notch's height. Without the latter a gap that is a rounding error would
# stop every step, and the contact would neither close nor open.
_OVERTRAVEL, _OVERLAP = 1e-6, 1e-12


def limit_closing(
    chain: Chain, unknowns: Unknowns, at: Evaluation, step: Iterate, fraction: Float[Array, ""]
) -> Iterate:
    """Limit a step so that its fraction to be taken bends no notch beyond contact.

    Beyond, the material law would be evaluated at an impossible strain, and the next step would
    open the contact again.
    """
    modes = step.unknowns.modes
    for group, response, force in zip(
        chain.contact_pairs, at.contacts, unknowns.contact_force, strict=True
    ):
        if response.slope is None:
            continue  # several flexures bring these bodies together
        closing = -fraction * jnp.einsum("nlm,nm->nl", response.slope, modes)
        is_open = ~is_active(chain.contact_stiffness, group.has_contact, force, response.gap)
        stops = (
            is_open & (closing > response.gap) & (response.gap > 0.0) & (group.has_contact > 0.0)
        )
        reach = (1.0 + _OVERTRAVEL) * response.gap + _OVERLAP * notch_heights(chain)[:, None]
        allowed = jnp.where(stops, reach / jnp.where(stops, closing, 1.0), 1.0)
        modes = modes * jnp.minimum(jnp.min(allowed, axis=-1, keepdims=True), 1.0)
    return step._replace(unknowns=step.unknowns._replace(modes=modes))
