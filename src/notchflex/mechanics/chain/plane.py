"""Whether a robot stays in one plane under its tendons alone."""

from __future__ import annotations

from functools import lru_cache

import numpy as np
from jaxtyping import Float

from notchflex.robot import Robot

# Tolerance of a direction's component out of the plane.
_ROUNDING = 1e-12


@lru_cache(maxsize=64)
def bending_normal(robot: Robot) -> Float[np.ndarray, " 3"] | None:
    """Return the normal of the plane in which all notches bend, in the base frame, or None."""
    direction = np.radians([notch.direction_deg for notch in robot.notches])
    if (np.abs(np.sin(direction - direction[0])) > _ROUNDING).any():
        return None
    return np.array([-np.sin(direction[0]), np.cos(direction[0]), 0.0])


@lru_cache(maxsize=64)
def tendons_in_plane(robot: Robot) -> bool:
    """Return whether every tendon runs in the one plane in which all notches bend."""
    normal = bending_normal(robot)
    if normal is None:
        return False
    direction = np.radians([tendon.direction_deg for tendon in robot.tendon])
    return bool(
        (np.abs(np.cos(direction) * normal[0] + np.sin(direction) * normal[1]) < 1e-9).all()
    )
