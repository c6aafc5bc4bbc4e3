"""Where a line along the wall leaves one rigid piece of the tube and enters the next.

A tendon is such a line, and so are the edges of the notches. What a notch opens, on which side,
its description knows (`Notch.openings`).
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np
from jaxtyping import Array, Float, Int

from notchflex._arrays import xp
from notchflex._jax import constant
from notchflex.robot.kinds import Notch, openings_along


class Passage(NamedTuple):
    """One line along the wall over n flexures (mm, in the frames of the bodies behind them).

    Attributes:
        visits: 1 where the body behind the flexure has wall on that side.
        on_side: 1 where the opening is on that very side, not all round.
        back: How many bodies before that one it visited the last one, its anchor; 1 where it does
            not visit.
        left: Where it left the anchor, along the tube in the anchor's frame.
        enters: Where the line enters that body, along the tube.
        leaves: Where it leaves that body again.
        base_leaves: Where it leaves the base.
    """

    visits: Float[np.ndarray, " n"]
    on_side: Float[np.ndarray, " n"]
    back: Int[np.ndarray, " n"]
    left: Float[Array, " n"]
    enters: Float[Array, " n"]
    leaves: Float[Array, " n"]
    base_leaves: Float[Array, ""]


def passage(
    notches: Sequence[Notch],
    body_length: Float[Array, " bodies"],
    direction_deg: float,
    outer_radius: float = 0.0,
    radius: float | None = None,
) -> Passage:
    """Follow a line along the wall.

    Args:
        notches: Every notch, base to tip.
        body_length: Length of the rigid pieces on the tube axis, base first, mm.
        direction_deg: Side of the tube.
        outer_radius: Outer radius of the tube, mm, for a line inside the wall.
        radius: Distance of the line from the tube axis, mm; None for one on the outer surface, in
            the middle of the openings.
    """
    count = len(notches)
    visits, on_side, back = xp.zeros(count), xp.zeros(count), xp.ones(count, int)
    left: list[Any] = [0.0] * count
    enters: list[Any] = [0.0] * count
    leaves, last = list(body_length), 0
    for body, opening in openings_along(notches, direction_deg):
        inside = 0.0
        if radius is not None:
            inside = opening.inside(direction_deg, outer_radius, radius)
        visits[body - 1] = 1.0
        enters[body - 1] = opening.enters + inside * opening.enters_rise
        on_side[body - 1] = opening.faces(direction_deg)
        leaves[last] += opening.leaves + inside * opening.leaves_rise
        back[body - 1], left[body - 1] = body - last, leaves[last]
        last = body
    along = map(constant, (left, enters, leaves[1:], leaves[0]))
    return Passage(visits, on_side, back, *along)


def passages(
    notches: Sequence[Notch],
    body_length: Float[Array, " bodies"],
    directions_deg: Sequence[float],
    outer_radius: float = 0.0,
    radii: Sequence[float] | None = None,
) -> Passage:
    """Follow several lines; they are the last axis."""
    distances = [None] * len(directions_deg) if radii is None else radii
    lines = [
        passage(notches, body_length, direction, outer_radius, radius)
        for direction, radius in zip(directions_deg, distances, strict=True)
    ]
    return Passage(*(xp.stack(values, axis=-1) for values in zip(*lines, strict=True)))
