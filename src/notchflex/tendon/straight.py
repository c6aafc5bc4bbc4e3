"""A tendon pulled straight from the edge of one body to the edge of the next it visits.

It may skip bodies. The pull between two bodies is a force along the straight span on each of
them; cutting beam and tendon in a gap shows that contact forces need not be summed
(physics of Gao 2017 and Liu 2022 alike).

Liu 2022 also reads the pull as a dead load or a follower: it then stands along the channel of
the proximal or the distal body, on the same point, while the way and its turning stay as they
are. That is a reading of a paper; it is no tendon whose work is tension times length.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import equinox as eqx
from jaxtyping import Array, Float

from notchflex._jax import jnp
from notchflex.flexure import FlexureState, Rod
from notchflex.motion import wrenches_at
from notchflex.tendon.crossing import Crossing, TendonGroup, fall, guarded_norm


class Carried(NamedTuple):
    """Tension, and where and how the tendon left the last body, in the current body's frame."""

    tension: Float[Array, " t"]
    point: Float[Array, "t 3"]
    direction: Float[Array, "t 3"]


class Straight(TendonGroup):
    """Tendons straight across the gaps.

    Attributes:
        entry: Where the tendon enters the distal body, in its frame, mm.
        exit: Where it leaves the distal body, in its frame, mm.
        channel: Unit direction of its channel through the distal body.
        base_exit: Where it leaves the base, mm, the same for every flexure.
        base_channel: Unit direction of its channel in the base.
        pulls: Along what it pulls: the "gap", or the channel of the body before ("dead") or
            behind ("follower").
        turns_with_chord: Whether it turns at the distal body by the turn of the flexure's chord
            rather than that of the body (the reading of Liu 2022).
    """

    acts_on_bodies = True

    numbers: tuple[int, ...] = eqx.field(static=True)
    present: Float[Array, "*n t"]
    visits: Float[Array, "*n t"]
    ends: Float[Array, "*n t"]
    body_length: Float[Array, "*n t"]
    natural_gap: Float[Array, "*n t"]
    entry: Float[Array, "*n t 3"]
    exit: Float[Array, "*n t 3"]
    channel: Float[Array, "*n t 3"]
    base_exit: Float[Array, "*n t 3"]
    base_channel: Float[Array, "*n t 3"]
    pulls: str = eqx.field(static=True)
    turns_with_chord: bool = eqx.field(static=True)

    def leave_base(self, base_tension: Float[Array, " t"]) -> Any:
        """Tension, exit point and direction at the base."""
        return Carried(base_tension, self.base_exit[0], self.base_channel[0])

    def no_reaction(self) -> Any:
        """No pull from beyond the tip."""
        return jnp.zeros((len(self.numbers), 6))

    def cross(
        self,
        rod: Rod,
        flexure: FlexureState,
        log_ratios: Float[Array, "t 2"],
        carried: Any,
        reaction: Any,
    ) -> Crossing:
        """Straight span from the carried point to the entry of the distal body."""
        del rod
        pose = flexure.pose
        assert pose is not None  # acts_on_bodies asks for it
        point = pose.points_inside(carried.point)
        direction = carried.direction @ pose.rotation
        span = self.entry - point
        length = guarded_norm(span)
        along = span / jnp.where(length == 0.0, 1.0, length)[:, None]
        gap_tension = self.visits * fall(carried.tension, log_ratios[:, 0])
        body_tension = self.visits * fall(gap_tension, log_ratios[:, 1])
        pulled = {"gap": along, "dead": direction, "follower": self.channel}[self.pulls]
        force = -gap_tension[:, None] * pulled
        on_entry = wrenches_at(self.entry, force)
        visited = self.visits[:, None] > 0.0
        going_on = self.visits == 0.0
        back = jnp.where(visited, -on_entry, reaction)
        return Crossing(
            gap_tension=gap_tension,
            body_tension=body_tension,
            shortening=self.visits * (self.natural_gap - length),
            exit_turning=turning(direction, along),
            entry_turning=turning(along, self._onward(flexure, direction)),
            pull=jnp.zeros_like(flexure.internal),
            wrench=jnp.sum(on_entry + self.visits[:, None] * reaction, axis=0),
            carried=Carried(
                tension=jnp.where(going_on, carried.tension, body_tension),
                point=jnp.where(visited, self.exit, point),
                direction=jnp.where(visited, self.channel, direction),
            ),
            reaction=pose.wrenches(back),
        )

    def _onward(self, flexure: FlexureState, direction: Float[Array, "t 3"]) -> Float[Array, "t 3"]:
        """Direction in which the tendon goes on through the distal body, in its frame."""
        if not self.turns_with_chord:
            return self.channel
        pose, turn = flexure.pose, flexure.chord_turn
        assert pose is not None
        assert turn is not None
        before = direction @ pose.rotation.T
        return before @ turn.T @ pose.rotation


def turning(before: Float[Array, "t 3"], after: Float[Array, "t 3"]) -> Float[Array, " t"]:
    """Angle between two unit directions, exact for small angles, with slope 0 at zero."""
    return jnp.atan2(guarded_norm(jnp.cross(before, after)), jnp.sum(before * after, axis=-1))
