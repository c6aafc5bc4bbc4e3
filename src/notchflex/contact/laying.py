"""From the notches of a robot to the lips that may close them."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from jaxtyping import Array, Float

from notchflex._jax import constant
from notchflex.contact.edge import Edges
from notchflex.contact.lip import LipGroup
from notchflex.contact.spine import SpineLips
from notchflex.flexure import Rod
from notchflex.robot import Tube
from notchflex.robot.kinds import Notch
from notchflex.tendon.openings import passages


def lay_lips(
    notches: Sequence[Notch], tube: Tube, rods: Rod, body_length: Float[Array, " bodies"]
) -> tuple[LipGroup, ...]:
    """Lips of every kind that the notches have.

    Args:
        notches: Every notch, base to tip.
        tube: The tube, whose outer edges meet.
        rods: All flexures of the chain.
        body_length: Length of the rigid pieces on the tube axis, base first, mm.
    """
    groups: list[LipGroup] = []
    if np.any(rods.lip_closes):
        groups.append(SpineLips(rods.lip_closes[:, None]))
    sides = sorted({side % 360.0 for side in _sides(notches)})
    if sides:
        line = passages(notches, body_length, sides)
        angle = np.radians(sides)
        across = tube.outer_radius * np.stack([np.cos(angle), np.sin(angle), 0.0 * angle], axis=-1)
        along = np.array([0.0, 0.0, 1.0])
        groups.append(
            Edges(
                closes=constant(line.closes),
                visits=constant(line.visits),
                enters=constant(across + line.enters[..., None] * along),
                leaves=constant(across + line.leaves[..., None] * along),
                base_leaves=constant(
                    np.broadcast_to(
                        across + np.asarray(line.base_leaves)[:, None] * along,
                        (len(notches), *across.shape),
                    )
                ),
            )
        )
    return tuple(groups)


def _sides(notches: Sequence[Notch]) -> list[float]:
    """Sides on which a notch opens the wall, where it does not leave a spine."""
    neighbours = [None, *notches, None]
    return [
        opening.side_deg
        for before, notch, after in zip(neighbours, neighbours[1:], neighbours[2:], strict=False)
        if notch is not None
        for opening in notch.openings(before, after)
        if opening.side_deg is not None
    ]
