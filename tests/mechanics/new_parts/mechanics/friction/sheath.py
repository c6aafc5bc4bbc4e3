"""The law of a sheath."""

from notchflex._jax import constant, jnp
from notchflex.mechanics.friction.registry import FrictionLaw, friction_law
from notchflex.robot.friction.sheath import Sheath


class SheathLaw(FrictionLaw):
    """A constant loss, N."""

    loss: float

    def bounds(self, exit_turning, entry_turning):
        return jnp.zeros_like(exit_turning), jnp.zeros_like(entry_turning)

    def constant_loss(self, exit_turning, entry_turning):
        return self.loss + 0.0 * exit_turning, self.loss + 0.0 * entry_turning


@friction_law.register
def _(friction: Sheath) -> SheathLaw:
    return SheathLaw(constant(friction.loss))
