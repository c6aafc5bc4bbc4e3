"""Friction at a sharp corner: Coulomb's law with the pressure on the bisector."""

from __future__ import annotations

from jaxtyping import Array, Bool, Float

from notchflex._jax import constant, jnp
from notchflex.mechanics.friction.registry import AtEdges, FrictionLaw, friction_law
from notchflex.robot import Corner

# At mu tan(beta/2) = 1 a corner holds any tension. Just below, the logarithm of the ratio is
# bounded by 21 (a ratio of 1e9), and its derivative is finite.
_STEEPEST = 1.0 - 1e-9


class CornerLaw(FrictionLaw):
    """Law of a string over a corner, each edge with its own turning (Gao 2017, eq. 23)."""

    coefficient: Float[Array, ""]  # Coefficient of friction

    def bounds(self, turning: AtEdges) -> AtEdges:
        """Return 2 artanh(coefficient * tan(turning / 2)) at each edge."""
        # It is ln((cos b + mu sin b) / (cos b - mu sin b)) with b = half the turning.
        return 2.0 * jnp.arctanh(jnp.minimum(self._slope(turning), _STEEPEST))

    def valid(self, turning: AtEdges) -> Bool[Array, "*t"]:
        """Return where coefficient times tangent of half the turning is below 1 at both edges."""
        return jnp.all(self._slope(turning) < _STEEPEST, axis=-1)

    def _slope(self, turning: AtEdges) -> AtEdges:
        return self.coefficient * jnp.tan(0.5 * turning)


@friction_law.register
def _(friction: Corner) -> CornerLaw:
    return CornerLaw(coefficient=constant(friction.coefficient))
