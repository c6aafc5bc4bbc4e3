"""Masses of the pieces of a robot: uncut tube, and the sections that the notches leave."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from jaxtyping import Float

from notchflex._arrays import xp
from notchflex.mechanics.flexure import Rod
from notchflex.robot import Robot, Tube
from notchflex.robot.kinds import Notch

# From kg/m3 to g/mm3.
_GRAMS = 1e-6


def body_lengths(tube: Tube, notches: Sequence[Notch]) -> Float[np.ndarray, " bodies"]:
    """Return the length of each rigid piece on the tube axis, base first, mm."""
    following = (*notches[1:], None)
    spacings = (notch.spacing(after) for notch, after in zip(notches, following, strict=True))
    return xp.stack(xp.broadcast_arrays(tube.base_length, *spacings))


def body_masses(
    robot: Robot, rods: Rod
) -> tuple[Float[np.ndarray, " bodies"], Float[np.ndarray, "bodies 3"]]:
    """Compute mass and centre of mass of each body, with its share of the notches.

    A body is a piece of uncut tube: the area of the tube's wall times the body's axial length,
    its centre halfway on the tube axis. Only bodies carry loads, so the mass of each flexure (area
    of its sections times the length of the neutral axis) is lumped: half at the start of the
    neutral axis on the body before it, half at its end on the body after it.

    Args:
        robot: The robot, n notches.
        rods: Its flexures, each starting from the proximal body, without factors on stiffness.

    Returns:
        Masses (g, (n + 1,)), base first, and centres (mm, (n + 1, 3)) in the frames of the
        bodies; zero masses where the material's density is not known.
    """
    bodies = len(robot.notches) + 1
    density = robot.material.density
    if density is None:
        return np.zeros(bodies), np.zeros((bodies, 3))
    length = body_lengths(robot.tube, robot.notches)
    wall = np.pi * (robot.tube.outer_radius**2 - robot.tube.inner_radius**2)
    piece = wall * length
    half = 0.5 * xp.sum(rods.section.area * rods.length, axis=-1)
    end = -xp.einsum("nba,nb->na", rods.end_rotation, rods.end_offset)
    nothing = np.zeros(1)
    before, behind = xp.concatenate([half, nothing]), xp.concatenate([nothing, half])
    # Every body has a volume: where no tube is left between two notches, half of each flexure.
    volume = piece + before + behind
    on_axis = (0.5 * length * piece)[:, None] * np.eye(3)[2]
    at_starts = before[:, None] * xp.pad(rods.start_offset, ((0, 1), (0, 0)))
    at_ends = behind[:, None] * xp.pad(end, ((1, 0), (0, 0)))
    return _GRAMS * density * volume, (on_axis + at_starts + at_ends) / volume[:, None]
