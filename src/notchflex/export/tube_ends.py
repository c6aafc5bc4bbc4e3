"""The ends of the tube that is cut: the tip, moved where the robot file ends inside a cut."""

from __future__ import annotations

from typing import NamedTuple

from notchflex.export.cuts import RobotCuts
from notchflex.robot import Robot


class TubeEnd(NamedTuple):
    """Ends of the tube.

    Attributes:
        at: Distance of its end from the base [mm].
        warning: A sentence where that is not the tip of the robot file; "" where it is.
    """

    at: float
    warning: str = ""


def tube_end(robot: Robot, cuts: RobotCuts) -> TubeEnd:
    """Return the end of the tube: the tip, or a wall thickness beyond a cut that reaches it."""
    last = max(one.end for one in cuts.cuts)
    if cuts.tip > last:
        return TubeEnd(cuts.tip)
    wall = robot.tube.outer_radius - robot.tube.inner_radius
    return TubeEnd(
        last + wall,
        f"the last cut ends at {last:.6g} mm and the robot file at {cuts.tip:.6g} mm, which leaves "
        f"no ring at the tip; a ring of the thickness of the wall, {wall:.6g} mm, was added beyond "
        "the cut. Give the last notch an `uncut_length` to set it.",
    )
