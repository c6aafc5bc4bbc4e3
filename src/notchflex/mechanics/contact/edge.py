"""Contact of two rigid pieces across a slot or a triangular notch.

The edge of the distal piece touches the face of the proximal one, which may be several bodies
back, as in a row of slots cut alternately from both sides. The gap is the distance of the edge from
the plane of that face, and the force is normal to the plane (no friction).
"""

from __future__ import annotations

from jaxtyping import Array, Float

from notchflex._jax import jax
from notchflex.mechanics.contact.pairs import ContactGroup, GapResponse
from notchflex.mechanics.flexure import FlexureState, Rod
from notchflex.mechanics.motion import Motion, wrench_at


class EdgeContact(ContactGroup):
    """Edges on several sides of the tube.

    Attributes:
        leaves: A point of the face, in the frame of the anchor, mm.
        enters: Edge of the distal body, in its frame, mm.
        normal: Normal of the face, in the frame of the anchor.
    """

    acts_on_bodies = True
    leaves: Float[Array, "*n l d"]
    enters: Float[Array, "*n l d"]
    normal: Float[Array, "*n l d"]

    def gap_response(self, rod: Rod, flexure: FlexureState, anchors: Motion | None) -> GapResponse:
        """Compute the distance of the edge from the face, and the wrench of a unit normal force."""
        del rod, flexure
        assert anchors is not None  # acts_on_bodies asks for it

        def one(anchor: Motion, leaves: Array, enters: Array, normal: Array) -> tuple[Array, Array]:
            along = normal @ anchor.rotation
            gap = (enters - anchor.point_inside(leaves)) @ along
            return gap, wrench_at(enters, along)

        gap, wrench = jax.vmap(one)(anchors, self.leaves, self.enters, self.normal)
        return GapResponse(gap, wrench, slope=None)
