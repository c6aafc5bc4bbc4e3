"""How a group of tendons crosses one flexure: what goes in, what comes out.

The chain is walked twice. From base to tip every tendon carries its tension along (and, where it
runs straight, the point and direction with which it left the last body it visits). From tip to
base it hands back how much tendon has been drawn out beyond, and the pull on that last point.
Both walks meet at a flexure in `TendonGroup.cross`.
"""

from __future__ import annotations

from abc import abstractmethod
from typing import Any, ClassVar, NamedTuple

import equinox as eqx
from jaxtyping import Array, Float

from notchflex._jax import jnp
from notchflex.flexure import FlexureState, Rod


class Crossing(NamedTuple):
    """A group of t tendons over one gap and the body behind it (mm, N, rad).

    Attributes:
        gap_tension: Tension in the gap.
        body_tension: Tension inside the distal body.
        shortening: How much shorter the way across the gap is than in the free robot.
        exit_turning: Turning angle at the edge of the proximal body, >= 0.
        entry_turning: Turning angle at the edge of the distal body, >= 0.
        pull: Tension times change of the gap's length per unit of mode, where the length is
            a function of this flexure's modes alone.
        wrench: Moment and force of the tendons on the distal body, about and along its frame;
            None for a group that does not act on bodies.
        carried: What goes on to the next flexure.
        reaction: What the pull does to the last body visited, as a wrench about the proximal
            body's origin; nothing for a group that does not act on bodies.
    """

    gap_tension: Float[Array, " t"]
    body_tension: Float[Array, " t"]
    shortening: Float[Array, " t"]
    exit_turning: Float[Array, " t"]
    entry_turning: Float[Array, " t"]
    pull: Float[Array, " modes"]
    wrench: Float[Array, " 6"] | None
    carried: Any
    reaction: Any


class TendonGroup(eqx.Module):
    """Tendons of one kind of path. Arrays carry the flexures as leading axis, then the tendons.

    Attributes:
        acts_on_bodies: Whether its pull is a force on the bodies (and poses are needed), or
            acts on the modes of each flexure alone.
        numbers: Which tendons of the robot these are, from 0.
        present: 1 where the tendon crosses this gap.
        visits: 1 where it passes through (or ends in) the distal body.
        ends: 1 where it is fixed in the distal body.
        body_length: Length of tendon inside the distal body.
        natural_gap: Length of its way across the gap in the free robot.
    """

    acts_on_bodies: ClassVar[bool]
    numbers: eqx.AbstractVar[tuple[int, ...]]
    present: eqx.AbstractVar[Float[Array, "*n t"]]
    visits: eqx.AbstractVar[Float[Array, "*n t"]]
    ends: eqx.AbstractVar[Float[Array, "*n t"]]
    body_length: eqx.AbstractVar[Float[Array, "*n t"]]
    natural_gap: eqx.AbstractVar[Float[Array, "*n t"]]

    @abstractmethod
    def leave_base(self, base_tension: Float[Array, " t"]) -> Any:
        """What the tendons carry when they leave the base."""

    @abstractmethod
    def no_reaction(self) -> Any:
        """What comes back from beyond the tip: nothing."""

    @abstractmethod
    def cross(
        self,
        rod: Rod,
        flexure: FlexureState,
        log_ratios: Float[Array, "t 2"],
        carried: Any,
        reaction: Any,
    ) -> Crossing:
        """Cross one flexure (of a group without its leading axis).

        Args:
            rod: The flexure.
            flexure: Its state.
            log_ratios: ln(tension on the base side / on the tip side) at both edges.
            carried: What the tendons bring from the base side.
            reaction: Pull from beyond on the points where they leave the distal body.
        """


def fall(tension: Float[Array, " t"], log_ratio: Float[Array, " t"]) -> Float[Array, " t"]:
    """Tension behind a contact. Not written with ln T, so that a slack tendon stays regular."""
    return tension * jnp.exp(-log_ratio)


def guarded_norm(vector: Float[Array, "... d"]) -> Float[Array, ...]:
    """Length of vectors, with derivative 0 where it is 0 (a straight tendon has no kink)."""
    squared = jnp.sum(vector * vector, axis=-1)
    zero = squared == 0.0
    return jnp.where(zero, 0.0, jnp.sqrt(jnp.where(zero, 1.0, squared)))
