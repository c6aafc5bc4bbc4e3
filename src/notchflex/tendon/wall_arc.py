"""A tendon that follows the wall of the bent tube: Pacheco's l = h - theta (r_i + ybar).

Across a gap it lies on the arc concentric with the neutral axis, so its length and turning are
functions of that notch's own modes. It follows the wall over every notch up to its end body,
whichever way the notch faces.
"""

from __future__ import annotations

from typing import Any

import equinox as eqx
from jaxtyping import Array, Float

from notchflex._jax import jnp
from notchflex.flexure import FlexureState, Rod, fibre_stretch
from notchflex.tendon.crossing import Crossing, TendonGroup, fall, guarded_norm


class WallArc(TendonGroup):
    """Tendons along the wall.

    Attributes:
        across: Where the tendon crosses the rod's section, from the neutral axis, mm.
    """

    acts_on_bodies = False

    numbers: tuple[int, ...] = eqx.field(static=True)
    present: Float[Array, "*n t"]
    visits: Float[Array, "*n t"]
    ends: Float[Array, "*n t"]
    body_length: Float[Array, "*n t"]
    natural_gap: Float[Array, "*n t"]
    across: Float[Array, "*n t 2"]

    def leave_base(self, base_tension: Float[Array, " t"]) -> Any:
        """Only the tension is carried."""
        return base_tension

    def no_reaction(self) -> Any:
        """Nothing is pulled from afar: each gap acts on its own flexure."""
        return ()

    def cross(
        self,
        rod: Rod,
        flexure: FlexureState,
        log_ratios: Float[Array, "t 2"],
        carried: Any,
        reaction: Any,
    ) -> Crossing:
        """Length, turning and pull on the wall arc; half the turning at each edge."""
        weights = fibre_stretch(self.across)
        gap_tension = self.present * fall(carried, log_ratios[:, 0])
        body_tension = self.present * fall(gap_tension, log_ratios[:, 1])
        slope = jnp.einsum("tc,icm,i->tm", weights, rod.basis, rod.length)
        half_turning = 0.5 * jnp.broadcast_to(guarded_norm(flexure.bend), gap_tension.shape)
        return Crossing(
            gap_tension=gap_tension,
            body_tension=body_tension,
            shortening=-self.present
            * jnp.einsum("tc,ic,i->t", weights, flexure.strain, rod.length),
            exit_turning=half_turning,
            entry_turning=half_turning,
            pull=gap_tension @ slope,
            wrench=None,
            carried=body_tension,
            reaction=reaction,
        )
