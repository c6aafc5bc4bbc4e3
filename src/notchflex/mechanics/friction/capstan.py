"""Capstan friction: the tension falls by exp(-coefficient * turning) and a constant loss."""

from __future__ import annotations

from jaxtyping import Array, Float

from notchflex._jax import constant, jnp
from notchflex.mechanics.friction.registry import AtEdges, FrictionLaw, friction_law
from notchflex.robot import Capstan


class CapstanLaw(FrictionLaw):
    """Capstan law with the turning of a gap placed at one edge or at both."""

    coefficient: Float[Array, ""]  # Coefficient of friction
    # Part of the entry edge's turning that counts at the exit edge: 0 where each edge keeps its
    # own, 1 where the whole turning of a notch lies ahead of it (Pacheco 2021, eq. 10, whose
    # product includes the notch itself)
    moved_to_exit: Float[Array, ""]
    # Tension that sliding over an edge costs whatever the turning, N; None for none
    loss: Float[Array, ""] | None

    def bounds(self, turning: AtEdges) -> AtEdges:
        """Return coefficient times turning at each edge."""
        moved = self.moved_to_exit * turning[..., 1:]
        return self.coefficient * (turning + jnp.concatenate([moved, -moved], axis=-1))

    def constant_loss(self, turning: AtEdges) -> AtEdges | None:
        """Return the same loss at every edge."""
        return None if self.loss is None else self.loss + 0.0 * turning


@friction_law.register
def _(friction: Capstan) -> CapstanLaw:
    return CapstanLaw(
        coefficient=constant(friction.coefficient),
        moved_to_exit=constant(1.0 if friction.wrap == "whole-before" else 0.0),
        loss=constant(friction.constant_loss) if friction.constant_loss else None,
    )
