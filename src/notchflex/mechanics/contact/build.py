"""Contacts that may close the notches of a robot."""

from __future__ import annotations

from collections.abc import Sequence
from typing import cast

import numpy as np
from jaxtyping import Array, Float

from notchflex._arrays import decide, xp
from notchflex._jax import constant
from notchflex.mechanics.contact.edge import EdgeContact
from notchflex.mechanics.contact.pairs import ContactGroup
from notchflex.mechanics.contact.spine import SpineContact
from notchflex.mechanics.flexure import Rod
from notchflex.mechanics.tendon.openings import passages
from notchflex.robot import Tube
from notchflex.robot.kinds import Notch


def build_contacts(
    notches: Sequence[Notch], tube: Tube, rods: Rod, body_length: Float[Array, " bodies"]
) -> tuple[ContactGroup, ...]:
    """Build the contacts of every kind that the notches have.

    Args:
        notches: Every notch, base to tip.
        tube: The tube, whose outer edges meet.
        rods: All flexures of the chain.
        body_length: Length of the rigid pieces on the tube axis, base first, mm.
    """
    groups: list[ContactGroup] = []
    if decide(xp.any(rods.has_closure)):
        has_contact = rods.has_closure[:, None]
        groups.append(SpineContact(has_contact, cast("Array", xp.ones(has_contact.shape, int))))
    sides = _sides(notches)
    if sides:
        line = passages(notches, body_length, sides)
        angle = xp.radians(sides)
        across = tube.outer_radius * xp.stack([xp.cos(angle), xp.sin(angle), 0.0 * angle], axis=-1)
        along = xp.array([0.0, 0.0, 1.0])
        # Keep as many contacts as close at one flexure, on any side.
        count = int(line.on_side.sum(axis=1).max(initial=1.0))
        chosen = xp.argsort(-line.on_side, axis=1, kind="stable")[:, :count]

        def own(values: np.ndarray) -> np.ndarray:
            index = chosen.reshape(*chosen.shape, *(1,) * (values.ndim - 2))
            return xp.take_along_axis(values, index, axis=1)

        has_contact = own(line.on_side)
        groups.append(
            EdgeContact(
                has_contact=constant(has_contact),
                back=cast("Array", xp.where(has_contact > 0.0, own(line.back), 1)),
                leaves=constant(own(across + line.left[..., None] * along)),
                enters=constant(own(across + line.enters[..., None] * along)),
                normal=constant(xp.broadcast_to(along, (*has_contact.shape, 3))),
            )
        )
    return tuple(groups)


def _sides(notches: Sequence[Notch]) -> list[float]:
    """List the sides on which a notch without a spine opens the wall, once each but for rounding.

    Two edges on one side would share the force that presses there, in no determined way.
    """
    neighbours, sides = [None, *notches, None], list[float]()
    for before, notch, after in zip(neighbours, neighbours[1:], neighbours[2:], strict=False):
        for opening in () if notch is None else notch.openings(before, after):
            if opening.side_deg is not None and not any(map(opening.faces, sides)):
                sides.append(opening.side_deg % 360.0)
    return sorted(sides)
