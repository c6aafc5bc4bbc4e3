"""The law of a sheath."""

from notchflex._jax import constant, jnp
from notchflex.mechanics.friction.registry import FrictionLaw, friction_law
from notchflex.robot.friction.sheath import Sheath


class SheathLaw(FrictionLaw):
    """A constant loss, N."""

    loss: float

    def bounds(self, turning):
        return jnp.zeros_like(turning)

    def constant_loss(self, turning):
        return self.loss + 0.0 * turning


@friction_law.register
def _(friction: Sheath) -> SheathLaw:
    return SheathLaw(constant(friction.loss))
