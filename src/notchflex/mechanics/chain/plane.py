"""Whether a robot stays in one plane under its tendons alone."""

from __future__ import annotations

import numpy as np
from jaxtyping import Float

from notchflex._arrays import cached, xp
from notchflex.robot import Robot

# Tolerance of a direction's component out of the plane.
_ROUNDING = 1e-12


@cached(64)
def bending_normal(robot: Robot) -> Float[np.ndarray, " 3"] | None:
    """Return the normal of the plane in which all notches bend, in the base frame, or None."""
    direction = xp.radians([notch.direction_deg for notch in robot.notches])
    if (xp.abs(xp.sin(direction - direction[0])) > _ROUNDING).any():
        return None
    return xp.array([-xp.sin(direction[0]), xp.cos(direction[0]), 0.0])


@cached(64)
def tendons_in_plane(robot: Robot) -> bool:
    """Return whether every tendon runs in the one plane in which all notches bend."""
    normal = bending_normal(robot)
    if normal is None:
        return False
    direction = xp.radians([tendon.direction_deg for tendon in robot.tendon])
    return bool(
        (xp.abs(xp.cos(direction) * normal[0] + xp.sin(direction) * normal[1]) < 1e-9).all()
    )
