"""Positions that were meant in another unit, which are out of reach."""

from __future__ import annotations

import numpy as np
from jaxtyping import Float

from notchflex.analysis.kinematics import tip_from_angles
from notchflex.robot import Robot

# A position is near a robot whose straight length it is a part from the first to the second of.
_LENGTH_RATIOS = (0.2, 2.0)
# Sizes of other units, mm.
_UNITS = {"m": 1000.0, "µm": 0.001}


def unit_hint(robot: Robot, position: Float[np.ndarray, " 3"] | None) -> str:
    """Say in which unit a position that is out of reach would be near the robot.

    Args:
        robot: The robot.
        position: Where its tip shall be, mm, NaN where free; None if no position is targeted.

    Returns:
        Words to add to a reason; empty where no other unit explains the position.
    """
    if position is None:
        return ""
    length = float(np.linalg.norm(tip_from_angles(robot, np.zeros(robot.number_of_notches))[0]))
    size = float(np.sqrt(np.nansum(position**2))) / length
    low, high = _LENGTH_RATIOS
    for unit, scale in _UNITS.items():
        if low <= size * scale <= high:
            return f"; positions are in mm, and this one would be near the robot in {unit}"
    return ""


__all__ = ["unit_hint"]
