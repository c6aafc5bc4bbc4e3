"""Edges of two rigid pieces that meet across a slot or a triangular notch.

The edge of the distal piece touches the face of the proximal one, which may be several bodies
back, as in a row of slots cut from either side in turn. The gap is the distance of the edge from
the plane of that face, and the force stands on the plane (no friction).
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from jaxtyping import Array, Float

from notchflex._jax import jnp
from notchflex.contact.lip import LipGroup, Touch
from notchflex.flexure import FlexureState, Rod
from notchflex.motion import wrenches_at


class Face(NamedTuple):
    """A point of the face last left on every side, and its normal, in the current body's frame."""

    point: Float[Array, "l 3"]
    normal: Float[Array, "l 3"]


class Edges(LipGroup):
    """Edges on several sides of the tube.

    Attributes:
        closes: 1 where an edge of the distal body closes an opening.
        visits: 1 where the distal body has wall on that side at all.
        enters: Edge of the distal body, in its frame, mm.
        leaves: Edge of its far face, from where the next opening begins.
        base_leaves: The same of the base, equal for every flexure.
    """

    acts_on_bodies = True
    closes: Float[Array, "*n l"]
    visits: Float[Array, "*n l"]
    enters: Float[Array, "*n l 3"]
    leaves: Float[Array, "*n l 3"]
    base_leaves: Float[Array, "*n l 3"]

    def leave_base(self) -> Any:
        """The faces of the base."""
        return Face(self.base_leaves[0], jnp.broadcast_to(_ALONG, self.base_leaves[0].shape))

    def no_reaction(self) -> Any:
        """No force from beyond the tip."""
        return jnp.zeros((self.closes.shape[-1], 6))

    def touch(
        self,
        rod: Rod,
        flexure: FlexureState,
        force: Float[Array, " l"],
        carried: Any,
        reaction: Any,
    ) -> Touch:
        """Distance of the edge from the plane of the face, and the force along its normal."""
        del rod
        pose = flexure.pose
        assert pose is not None  # acts_on_bodies asks for it
        point = pose.points_inside(carried.point)
        normal = carried.normal @ pose.rotation
        along = jnp.broadcast_to(_ALONG, self.leaves.shape)
        visits = self.visits[:, None]
        pressed = (force * self.closes)[:, None] * normal
        on_edge = wrenches_at(self.enters, pressed)
        # Where a piece ends here, what comes back from beyond acts on it.
        wrench = jnp.sum(on_edge + visits * reaction, axis=0)
        back = jnp.where(visits > 0.0, -on_edge, reaction)
        return Touch(
            gap=jnp.sum((self.enters - point) * normal, axis=-1),
            pull=jnp.zeros_like(flexure.internal),
            wrench=wrench,
            carried=Face(
                point=jnp.where(visits > 0.0, self.leaves, point),
                normal=jnp.where(visits > 0.0, along, normal),
            ),
            reaction=pose.wrenches(back),
        )


_ALONG = np.array([0.0, 0.0, 1.0])
