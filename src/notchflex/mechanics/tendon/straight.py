"""A tendon pulled straight from the edge of one body to the edge of the next it visits.

It may skip bodies. The pull between two bodies is a force along the straight span on each of
them; cutting beam and tendon in a gap shows that contact forces need not be summed
(physics of both Gao 2017 and Liu 2022).

Liu 2022 also reads the pull as a dead load or a follower: it then stands along the channel of
the proximal or the distal body, on the same point, while the way and its turning stay as they
are. That is a reading of a paper; it is not a tendon whose work is tension times length.
"""

from __future__ import annotations

from jaxtyping import Array, Float

from notchflex._jax import jax, jnp
from notchflex._pytree import static
from notchflex.mechanics.flexure import FlexureState, Rod
from notchflex.mechanics.motion import Motion, moment_of, wrench_at
from notchflex.mechanics.tendon.crossing import Crossing, TendonGroup, direction, guarded_norm

# Products of unit vectors that are parallel are off 0 by less.
_ROUNDING = 1e-15


class Straight(TendonGroup):
    """Tendons straight across the gaps.

    Attributes:
        leaves: Where the tendon leaves its anchor, in the anchor's frame, mm.
        enters: Where it enters the distal body, in that body's frame, mm.
        along: Unit direction of its channels, in the frames of the bodies.
        pulls: Along what it pulls: the "gap", or the channel of the body before ("dead") or
            behind ("follower").
        turns_with_chord: Whether it turns at the distal body by the turn of the flexure's chord
            rather than that of the body (the reading of Liu 2022), behind a strip; other notches
            have no chord.
    """

    acts_on_bodies = True

    leaves: Float[Array, "*n t d"]
    enters: Float[Array, "*n t d"]
    along: Float[Array, "*n t d"]
    pulls: str = static()
    turns_with_chord: bool = static()

    @property
    def by_modes(self) -> bool:
        """Only where the chord of the flexure tells how the tendon turns."""
        return self.turns_with_chord

    def cross(self, rod: Rod, flexure: FlexureState, anchors: Motion | None) -> Crossing:
        """Straight span from the anchor to the entry of the distal body."""
        assert anchors is not None  # acts_on_bodies asks for it
        chord = rod.chord if self.turns_with_chord else None

        def one(anchor: Motion, leaves: Array, enters: Array, channel: Array) -> tuple[Array, ...]:
            span = enters - anchor.point_inside(leaves)
            length = guarded_norm(span)
            gap = span / jnp.where(length == 0.0, 1.0, length)
            before = channel @ anchor.rotation
            onward = channel
            if chord is not None:
                onward = jnp.where(chord > 0.0, self._onward(flexure, before), channel)
            pulled = {"gap": gap, "dead": before, "follower": channel}[self.pulls]
            # A pull turns the distal body toward the tendon's side.
            axis = direction(moment_of(channel, enters))
            turns = turning(before, gap, axis), turning(gap, onward, axis)
            return length, *turns, wrench_at(enters, pulled)

        found = jax.vmap(one)(anchors, self.leaves, self.enters, self.along)
        return Crossing(*found, slope=None)

    def _onward(self, flexure: FlexureState, channel: Float[Array, " d"]) -> Float[Array, " d"]:
        """Direction in which the tendon goes on by the chord's turn, in the distal body's frame."""
        pose, turn = flexure.pose, flexure.chord_turn
        assert pose is not None
        assert turn is not None
        before = pose.rotation @ channel
        return (turn @ before) @ pose.rotation


def turning(
    before: Float[Array, " d"], after: Float[Array, " d"], axis: Float[Array, " a"]
) -> Float[Array, ""]:
    """Return the angle between two unit directions, exact for small angles.

    A straight tendon turns with any rotation, to whichever side; its slope here is that of the
    rotation that its own pull causes. With it the first step from rest knows the friction.
    A span without length has no direction (its vector is 0) and turns nothing, with slope 0.

    Args:
        before: The one direction.
        after: The other.
        axis: Unit axis about which a pull turns the distal body; 0 where it turns nothing.
    """
    across, cosine = moment_of(before, after), jnp.sum(before * after)
    nowhere = jnp.all(across == 0.0) & (cosine == 0.0)
    sine = guarded_norm(across, jnp.where(nowhere, 0.0, axis), _ROUNDING)
    return jnp.atan2(sine, jnp.where(nowhere, 1.0, cosine))
