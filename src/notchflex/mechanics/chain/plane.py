"""Does a robot stay in one plane, under its tendons alone?"""

from __future__ import annotations

from functools import lru_cache

import numpy as np
from jaxtyping import Float

from notchflex.robot import Robot

# Part of a direction that may stick out of the plane by rounding.
_ROUNDING = 1e-12


@lru_cache(maxsize=64)
def bending_normal(robot: Robot) -> Float[np.ndarray, " 3"] | None:
    """Normal of the plane in which all notches bend, in the base frame; None if there is none."""
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


__all__ = ["bending_normal", "tendons_in_plane"]
