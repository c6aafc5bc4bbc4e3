"""Shapes of which no solid can be made, in STL or in STEP."""

from __future__ import annotations

import math

from notchflex.errors import InputError
from notchflex.robot import Robot
from notchflex.robot.notches.cut import NotchCut


def check_window(cut: NotchCut, outer: float) -> tuple[float, float, float]:
    """Return start, end [mm] and half the angle [rad] of a radial cut.

    Raises:
        InputError: It is not a window with straight ends.
    """
    if len(cut.corners) == 4:
        (start, _), (low, bottom), (high, also), (end, _) = cut.corners
        if (start, end, bottom) == (low, high, also):
            return start, end, math.acos(bottom / outer)
    raise InputError.UNSUPPORTED(
        "a radial cut that is not a window with straight ends has no solid; export a flat pattern."
    )


def check_one_piece(count: int) -> None:
    """Raise if the cuts divide the tube.

    Raises:
        InputError: There is another number of pieces than one.
    """
    if count != 1:
        raise InputError.UNSUPPORTED(
            "the cuts and channels divide the tube into pieces that do not hold together; give "
            "the notches a larger uncut_length or a smaller depth, or a larger shank."
        )


def check_channels(robot: Robot, diameter: float) -> None:
    """Raise if a channel would break through the outer surface, or would cut nothing.

    Raises:
        InputError: It does not fit.
    """
    tube = robot.tube
    for number, tendon in enumerate(robot.tendon, start=1):
        far = tendon.radius + 0.5 * diameter
        if far >= tube.outer_radius:
            raise InputError.OUT_OF_RANGE(
                f"channels: {diameter:g} mm wide, the channel of tendon {number} reaches "
                f"{far:.6g} mm from the axis and the wall ends at {tube.outer_radius:.6g} mm; give "
                f"less than {2.0 * (tube.outer_radius - tendon.radius):.6g} mm."
            )
        if far <= tube.inner_radius:
            raise InputError.OUT_OF_RANGE(
                f"channels: {diameter:g} mm wide, the channel of tendon {number} lies within the "
                f"bore, {tube.inner_radius:.6g} mm from the axis, and cuts nothing; leave channels "
                "out."
            )
