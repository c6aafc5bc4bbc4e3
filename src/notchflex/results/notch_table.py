"""What a notch is before anything pulls, and how it closes: one row for every notch."""

from __future__ import annotations

from typing import Any

import numpy as np

from notchflex.flexure import Rod, rod
from notchflex.results.quantities import DEGREES
from notchflex.robot import Robot
from notchflex.robot.kinds import Notch
from notchflex.statics import closing


def notch_table(robot: Robot) -> list[dict[str, Any]]:
    """Return geometry, section and closing of every notch, base to tip.

    Args:
        robot: The robot, n notches, t tendons.

    Returns:
        n rows with the values of the robot file and

        * `area_mm2`, `centroid_mm` (from the tube axis toward the spine), `second_moment_mm4`
          of the section that the cut leaves,
        * `moment_arm_mm`, t numbers: how far each tendon runs from the neutral axis, positive
          where it bends the notch toward its direction,
        * `closing_angle_deg`, `closing_tendon` (from 1: the one with the longest arm),
          `closing_tension_N` (of that tendon, pulled from rest; NaN if the notch never closes),
          `closing_outer_strain` (Pacheco 2021, eq. 16) and `closing_peak_strain` (farthest fibre).

    Example:
        >>> from notchflex import load_robot
        >>> row = notch_table(load_robot("pacheco2021-a"))[0]
        >>> round(row["closing_angle_deg"], 2), round(row["moment_arm_mm"][0], 3)
        (30.63, 1.387)
    """
    table = closing(robot)
    sections: dict[Notch, Rod] = {}  # equal notches have equal sections
    rows: list[dict[str, Any]] = []
    for index, notch in enumerate(robot.notches):
        if notch not in sections:
            sections[notch] = rod(notch, robot.tube)
        section = sections[notch].section
        centroid = robot.tube.outer_radius - float(section.edge_spine[0])
        rows.append(
            {
                "notch": index + 1,
                **{
                    name: getattr(notch, key)
                    for key, name in {
                        "cut": "cut",
                        "depth": "depth_mm",
                        "height": "height_mm",
                        "uncut_length": "uncut_length_mm",
                        "direction_deg": "direction_deg",
                        "precurvature_deg": "precurvature_deg",
                    }.items()
                },
                "area_mm2": float(section.area[0]),
                "centroid_mm": centroid,
                "second_moment_mm4": float(section.second_moment_weak[0]),
                "moment_arm_mm": [
                    centroid
                    + tendon.radius
                    * float(np.cos(np.radians(tendon.direction_deg - notch.direction_deg)))
                    for tendon in robot.tendon
                ],
                "closing_angle_deg": float(table.angle[index]) * DEGREES,
                "closing_tendon": int(table.tendon[index]),
                "closing_tension_N": float(table.tension[index]),
                "closing_outer_strain": float(table.outer_strain[index]),
                "closing_peak_strain": float(table.peak_strain[index]),
            }
        )
    return rows
