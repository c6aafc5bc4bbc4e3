"""A tendon that follows the wall of the bent tube: Pacheco's l = h - theta (r_i + ybar).

Across a gap it lies on the arc concentric with the neutral axis, so its length and turning are
functions of that notch's own modes. It follows the wall over every notch up to its end body,
whichever way the notch faces.
"""

from __future__ import annotations

from jaxtyping import Array, Float

from notchflex._jax import jnp
from notchflex.mechanics.flexure import FlexureState, Rod, fibre_slope, fibre_stretch, of_rod
from notchflex.mechanics.motion import Motion
from notchflex.mechanics.tendon.crossing import Crossing, TendonGroup, direction, guarded_norm


class WallArc(TendonGroup):
    """Tendons along the wall.

    Attributes:
        across: Where the tendon crosses the rod's section, from the neutral axis, mm.
    """

    acts_on_bodies = False

    across: Float[Array, "*n t 2"]

    @property
    def fibre(self) -> Float[Array, "*n t 2"]:
        """Where the tendon crosses the rod's section, mm from its neutral axis."""
        return self.across

    @property
    def runs(self) -> Float[Array, "*n t"]:
        """Over every notch up to its end."""
        return self.present

    def cross(self, rod: Rod, flexure: FlexureState, anchors: Motion | None) -> Crossing:
        """Return the length and turning on the wall arc; half the turning at each edge."""
        del anchors
        weights = of_rod(rod, fibre_stretch(self.across))
        bend = jnp.broadcast_to(flexure.bend, (len(self.across), len(flexure.bend)))
        half_turning = 0.5 * guarded_norm(bend, self._pulls(len(flexure.bend)))
        return Crossing(
            length=self.natural_gap + (rod.length @ flexure.strain) @ weights.T,
            exit_turning=half_turning,
            entry_turning=half_turning,
            wrench=None,
            slope=fibre_slope(rod, weights),
        )

    def _pulls(self, axes: int) -> Float[Array, "t axes"]:
        """Unit axes about which the tendons bend the rod, the slope of the turning at rest."""
        x, y = self.across[:, 0], self.across[:, 1]
        return direction(jnp.stack([x] if axes == 1 else [-y, x], axis=-1))
