"""No friction: the tension is the same all along the tendon."""

from __future__ import annotations

from jaxtyping import Array, Float

from notchflex._jax import jnp
from notchflex.mechanics.friction.registry import FrictionLaw, friction_law
from notchflex.robot import Frictionless


class FrictionlessLaw(FrictionLaw):
    """Contacts without friction."""

    remembers = False

    def bounds(
        self, exit_turning: Float[Array, "*t"], entry_turning: Float[Array, "*t"]
    ) -> tuple[Float[Array, "*t"], Float[Array, "*t"]]:
        """Return zero at both edges."""
        return jnp.zeros_like(exit_turning), jnp.zeros_like(entry_turning)


@friction_law.register
def _(friction: Frictionless) -> FrictionlessLaw:
    del friction
    return FrictionlessLaw()
