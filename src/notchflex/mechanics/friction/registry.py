"""Friction laws and their registry: limits of the tension ratio over a contact."""

from __future__ import annotations

from abc import ABC, abstractmethod
from functools import singledispatch
from typing import Any, ClassVar

from jaxtyping import Array, Bool, Float

from notchflex._imports import unregistered
from notchflex._jax import Pytree, jnp
from notchflex.robot import Frictionless

AtEdges = Float[Array, "*t 2"]
"""A value of every tendon at the exit edge of a gap, and at the entry edge."""


class FrictionLaw(Pytree, ABC):
    """Friction of a tendon at the two edges of a gap.

    Attributes:
        remembers: Whether a solved state depends on the one before.
    """

    # At a sliding contact the higher tension is exp(bound) times the lower one plus the constant
    # loss; a contact sticks anywhere between the two directions of sliding. A law states `bounds`
    # and, where it has a loss in N, `constant_loss`.

    remembers: ClassVar[bool] = True

    @abstractmethod
    def bounds(self, turning: AtEdges) -> AtEdges:
        """Return the largest |ln(tension ratio)| at both edges, by angles of turning, rad."""

    def constant_loss(self, turning: AtEdges) -> AtEdges | None:
        """Return the tension that sliding costs beside `bounds`, N, >= 0; None for none."""

    def offset(self) -> Float[Array, ""] | float:
        """Return what is added to tensions in their ratios, N: the loss at a turning of 1 rad."""
        # With a constant loss the tension beyond a contact may be 0 N, and is not 0 N beyond a
        # released one. Ratios of tensions that are raised by a loss are finite.
        loss = self.constant_loss(jnp.ones(2))
        # Above 0 the formulas are finite where the loss is zero.
        return 0.0 if loss is None else jnp.maximum(jnp.max(loss), 1e-100)

    def limits(self, turning: AtEdges, before: AtEdges, log_ratio: AtEdges) -> AtEdges:
        """Compute the largest |ln(tension ratio)| at both edges, constant losses included."""
        # With the tension T before an edge, on the base side, T' on the tip side and the offset a,
        # the ratio is (T + a) / (T' + a). At the limit of loading T = e^b T' + F, or T' = 0 where T
        # is below the loss F; at that of unloading T' = e^b T + F.
        ratio, loss = self.bounds(turning), self.constant_loss(turning)
        if loss is None:
            return ratio
        before, offset = jnp.maximum(before, 0.0), self.offset()
        lowest = jnp.exp(-ratio) * jnp.maximum(before - loss, 0.0)
        highest = jnp.exp(ratio) * before + loss
        loading = jnp.log((before + offset) / (lowest + offset))
        unloading = jnp.log((highest + offset) / (before + offset))
        return jnp.where(log_ratio >= 0.0, loading, unloading)

    def valid(self, turning: AtEdges) -> Bool[Array, "*t"]:
        """Return where the law is valid; elsewhere `bounds` is finite but meaningless."""
        return jnp.ones_like(turning[..., 0], dtype=bool)


@singledispatch
def friction_law(friction: Any) -> FrictionLaw:
    """Return the friction law of a description."""
    raise unregistered("friction law", friction, "friction", "friction_law")


class FrictionlessLaw(FrictionLaw):
    """Contacts without friction."""

    remembers = False

    def bounds(self, turning: AtEdges) -> AtEdges:
        """Return zero at both edges."""
        return jnp.zeros_like(turning)


@friction_law.register
def _(friction: Frictionless) -> FrictionlessLaw:
    return FrictionlessLaw()
