"""How a group of tendons crosses one gap: its way as a function of where the two bodies are.

A span leads from the body that the tendon visited last, its anchor, to the next one that it visits.
All that it does depends on the pose of the one seen from the other (or, along the wall of a bent
notch, on that notch's strains alone); tension, friction and balance are the chain's business.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from typing import ClassVar, NamedTuple

from jaxtyping import Array, Float, Int

from notchflex._jax import jax, jnp
from notchflex._pytree import Pytree, static
from notchflex.mechanics.flexure import FlexureState, Rod
from notchflex.mechanics.motion import Motion


class Crossing(NamedTuple):
    """A group of t tendons over one gap (mm, rad).

    Attributes:
        length: Length of the way across the gap.
        exit_turning: Turning angle at the edge of the body before, >= 0.
        entry_turning: Turning angle at the edge of the distal body, >= 0.
        wrench: Moment and force on the distal body per unit of the span's tension, reversed,
            about and along its frame; its opposite acts on the anchor. None for a group that does
            not act on bodies.
        slope: Change of the length per unit of mode; None for a group that acts on bodies.
    """

    length: Float[Array, " t"]
    exit_turning: Float[Array, " t"]
    entry_turning: Float[Array, " t"]
    wrench: Float[Array, "t w"] | None
    slope: Float[Array, "t modes"] | None


class TendonGroup(Pytree, ABC):
    """Tendons of one kind of path. Arrays carry the flexures as leading axis, then the tendons.

    Attributes:
        acts_on_bodies: Whether its pull is a force on the bodies (and poses are needed), or
            acts on the modes of each flexure alone.
        by_modes: Whether its way depends on the modes of the flexure, beside the bodies' poses.
        numbers: Which tendons of the robot these are, from 0.
        present: 1 where the tendon crosses this gap.
        visits: 1 where it passes through (or ends in) the distal body.
        ends: 1 where it is fixed in the distal body.
        back: How many bodies before the distal one its anchor is, 1 where it skips none.
        body_length: Length of tendon inside the distal body.
        natural_gap: Length of its way across the gap in the free robot.
    """

    acts_on_bodies: ClassVar[bool]
    numbers: tuple[int, ...] = static()
    present: Float[Array, "*n t"]
    visits: Float[Array, "*n t"]
    ends: Float[Array, "*n t"]
    back: Int[Array, "*n t"]
    body_length: Float[Array, "*n t"]
    natural_gap: Float[Array, "*n t"]

    @property
    def by_modes(self) -> bool:
        """Whether the way depends on the modes of the flexure, beside the bodies' poses."""
        return not self.acts_on_bodies

    @property
    def runs(self) -> Float[Array, "*n t"]:
        """1 where the tendon has a span that ends at the distal body."""
        return self.visits

    @property
    def fibre(self) -> Float[Array, "*n t 2"] | None:
        """Where the tendon crosses a rod's section, mm from its neutral axis.

        None for a tendon that does not run along the rod, as a fibre of it.
        """
        return None

    @abstractmethod
    def cross(self, rod: Rod, flexure: FlexureState, anchors: Motion | None) -> Crossing:
        """Cross one gap (of a group without its leading axis).

        Args:
            rod: The flexure.
            flexure: Its state.
            anchors: Pose of the distal body seen from every tendon's anchor, tendons as leading
                axis; None where nothing acts on bodies.
        """


def guarded_norm(
    vector: Float[Array, "*s d"],
    slope: Float[Array, "*s d"] | None = None,
    rounding: float = 0.0,
) -> Float[Array, "*s"]:
    """Return the length of vectors, with a stated derivative where it is 0.

    Args:
        vector: The vectors.
        slope: Derivative of the length by a vector that is 0; 0 where not given.
        rounding: Up to this length a vector has the stated derivative.
    """
    squared = jnp.sum(vector * vector, axis=-1)
    zero = squared == 0.0
    length = jnp.where(zero, 0.0, jnp.sqrt(jnp.where(zero, 1.0, squared)))
    if slope is None:
        return length
    along, stop = jnp.sum(vector * slope, axis=-1), jax.lax.stop_gradient
    return jnp.where(squared <= rounding**2, stop(length) + (along - stop(along)), length)


def direction(vector: Float[Array, "*s d"]) -> Float[Array, "*s d"]:
    """Return unit vectors; 0 for vectors that are 0."""
    length = guarded_norm(vector)
    return vector / jnp.where(length == 0.0, 1.0, length)[..., None]
