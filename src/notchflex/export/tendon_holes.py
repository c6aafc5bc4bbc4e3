"""Points where tendons pass the edges of the bodies."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from jaxtyping import Float

from notchflex._jax import constant
from notchflex.mechanics.chain.mass import body_lengths
from notchflex.mechanics.tendon.openings import passage
from notchflex.robot import Robot


class Hole(NamedTuple):
    """A point that a tendon is led through.

    Attributes:
        body: The body it is fixed to, 0 the base.
        place: Its place in the frame of that body, mm.
    """

    body: int
    place: Float[np.ndarray, " 3"]


def tendon_holes(robot: Robot, tendon: int) -> list[Hole]:
    """Return the points that a tendon runs through, base to tip.

    Args:
        robot: The robot.
        tendon: Which tendon, from 0.
    """
    one = robot.tendon[tendon]
    lengths = constant(body_lengths(robot.tube, robot.notches))
    line = passage(robot.notches, lengths, one.direction_deg, robot.tube.outer_radius, one.radius)
    side = np.radians(one.direction_deg)
    position = one.radius * np.array([np.cos(side), np.sin(side), 0.0])

    def hole(body: int, along: float) -> Hole:
        return Hole(body, position + np.array([0.0, 0.0, along]))

    last = one.end_body or robot.number_of_notches
    holes = [hole(0, 0.0)]
    if line.base_leaves > 0.0:
        holes.append(hole(0, float(line.base_leaves)))
    for j in np.flatnonzero(line.visits[:last]):
        holes.append(hole(int(j) + 1, float(line.enters[j])))
        if j + 1 < last:
            holes.append(hole(int(j) + 1, float(line.leaves[j])))
    return holes
