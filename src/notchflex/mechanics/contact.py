"""Contact between the edges of a notch that close it."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from jaxtyping import Array, Float

from notchflex._arrays import decide, xp
from notchflex._jax import jax
from notchflex.mechanics.flexure import FlexureState, Rod, in_space
from notchflex.mechanics.motion import Motion, wrench_at
from notchflex.mechanics.tendon import (
    TUBE_AXIS,
    AlongFibres,
    Crossing,
    CrossingGroup,
    fibre_lengths,
    on_tube,
    passages,
)
from notchflex.robot import Tube
from notchflex.robot.kinds import Notch

# Contact between the edges of a notch: gap and contact force.
#
# Like a tendon's span, a contact connects an anchor, the body with the face, and the body with the
# edge. The gap depends on their relative pose, or on the flexure's strains alone.


class ContactGroup(CrossingGroup):
    """Contacts of one kind."""

    has_contact: Float[Array, "*n l"]  # 1 where a flexure has such a contact


# Contact of two rigid pieces across a slot or a triangular notch.
#
# The edge of the distal piece touches the face of the proximal one, which may be several bodies
# back, as in a row of slots cut alternately from both sides. The gap is the distance of the edge
# from the plane of that face, and the force is normal to the plane (no friction).


class EdgeContact(ContactGroup):
    """Edges on several sides of the tube."""

    acts_on_bodies = True
    leaves: Float[Array, "*n l d"]  # A point of the face, in the frame of the anchor, mm
    enters: Float[Array, "*n l d"]  # Edge of the distal body, in its frame, mm
    normal: Float[Array, "*n l d"]  # Normal of the face, in the frame of the anchor

    def cross(self, rod: Rod, flexure: FlexureState, anchors: Motion | None) -> Crossing:
        """Compute the distance of the edge from the face, and the wrench of a unit normal force."""
        assert anchors is not None  # acts_on_bodies asks for it

        def press(anchor: Motion, leaves: Array, enters: Array, normal: Array) -> Any:
            along = normal @ anchor.rotation
            gap = (enters - anchor.point_inside(leaves)) @ along
            return gap, wrench_at(enters, along)

        gap, wrench = jax.vmap(press)(anchors, self.leaves, self.enters, self.normal)
        return Crossing(gap, wrench, slope=None)


# Contact opposite a solid spine: it closes where its fibre between the edges has zero length.
#
# On the concentric arc of Pacheco 2021 the gap is h - (r_o + ybar) theta.


class SpineContact(AlongFibres, ContactGroup):
    """One contact at every notch that has a spine."""


def closing_angles(rods: Rod) -> Float[Array, " n"]:
    """Compute the elastic angle at which every notch closes, rad; infinite without a spine."""
    # It is the amplitude of the first mode at which the fibre between the edges has zero length:
    # for an arc h / (r_o + ybar) less the precurvature.
    edges, basis = rods.closure[:, None], xp.asarray(rods.basis)
    free = fibre_lengths(rods, edges, rods.reference_strain)[:, 0]
    slope = fibre_lengths(rods, edges, basis[..., 0])[:, 0]
    spine = xp.asarray(rods.has_closure) > 0.0
    return xp.where(spine, -free / xp.where(spine, slope, 1.0), np.inf)


def free_angle(rods: Rod) -> Float[Array, " n"]:
    """Return the precurvature of every notch with a spine, rad."""
    bending = xp.asarray(in_space(rods.reference_strain))[..., 1]
    return xp.einsum("ni,ni->n", rods.length, bending)


# Contacts that may close the notches of a robot.


def build_contacts(
    notches: Sequence[Notch], tube: Tube, rods: Rod, body_length: Float[Array, " bodies"]
) -> tuple[ContactGroup, ...]:
    """Build the contacts of every kind that the notches have."""
    groups: list[ContactGroup] = []
    if decide(xp.any(rods.has_closure)):
        has_contact, across = rods.has_closure[:, None], rods.closure[:, None]
        groups.append(
            SpineContact(
                back=xp.ones(has_contact.shape, int),
                has_contact=has_contact,
                natural_gap=fibre_lengths(rods, across, rods.reference_strain),
                across=across,
            )
        )
    sides = _sides(notches)
    if sides:
        line = passages(notches, body_length, sides)
        radii = xp.stack([(notch.tube or tube).outer_radius for notch in notches])
        across = radii[:, None, None] * on_tube([1.0] * len(sides), sides)
        # Keep as many contacts as close at one flexure, on any side.
        count = int(line.on_side.sum(axis=1).max(initial=1.0))
        chosen = xp.argsort(-line.on_side, axis=1, kind="stable")[:, :count]

        def closing(values: Array) -> Any:
            index = chosen.reshape(*chosen.shape, *(1,) * (values.ndim - 2))
            return xp.take_along_axis(values, index, axis=1)

        has_contact = closing(line.on_side)
        groups.append(
            EdgeContact(
                has_contact=has_contact,
                back=xp.where(has_contact > 0.0, closing(line.back), 1),
                leaves=closing(across + line.left[..., None] * TUBE_AXIS),
                enters=closing(across + line.enters[..., None] * TUBE_AXIS),
                normal=xp.broadcast_to(TUBE_AXIS, (*has_contact.shape, 3)),
            )
        )
    return tuple(groups)


def _sides(notches: Sequence[Notch]) -> list[float]:
    """List the sides on which notches without a spine open the wall, deg, each once."""
    # Two edges on one side would share the force that presses there, in no determined way.
    neighbours, sides = [None, *notches, None], list[float]()
    for before, notch, after in zip(neighbours, neighbours[1:], neighbours[2:], strict=False):
        for opening in () if notch is None else notch.openings(before, after):
            if opening.side_deg is not None and not any(map(opening.faces, sides)):
                sides.append(opening.side_deg % 360.0)
    return sorted(sides)
