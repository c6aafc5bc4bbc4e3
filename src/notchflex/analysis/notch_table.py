"""Geometry, section and closing of every notch, one row each."""

from __future__ import annotations

from typing import Any

import numpy as np

from notchflex.analysis.closing_loads import Closing, closing, moment_arms
from notchflex.mechanics.chain import assemble, sites_of
from notchflex.mechanics.flexure import Site, rod_at
from notchflex.results.quantities.registry import DEGREES
from notchflex.robot import Robot, Tube
from notchflex.robot.fields import fields_of
from notchflex.robot.kinds import Notch


def notch_table(robot: Robot, closing_table: Closing | None = None) -> list[dict[str, Any]]:
    """Return geometry, section and closing of every notch, base to tip.

    Args:
        robot: The robot, n notches, t tendons.
        closing_table: What `closing` returned of it; found anew where not given.

    Returns:
        n rows with the values of the robot file, their units in their names, and

        * `area_mm2` and `second_moment_mm4` of the section that the cut leaves, where it is
          weakest; `centroid_mm` (from the tube axis toward the spine) where there is a spine,
        * `moment_arm_mm`, t numbers: how far each tendon runs from the neutral axis, positive
          where it bends the notch toward its direction, 0 where it does not go,
        * `closing_angle_deg`, `closing_tendon` (from 1: the one with the longest arm),
          `closing_tension_N` (of that tendon, pulled from rest; NaN if none was found),
          `closing_status` ("closes", "never", or "not found" where the solver failed),
          `closing_outer_strain` (Pacheco 2021, eq. 16) and `closing_peak_strain` (farthest fibre),
          both NaN without a spine.

    Example:
        >>> from notchflex import load_robot
        >>> row = notch_table(load_robot("pacheco2021-a"))[0]
        >>> round(row["closing_angle_deg"], 2), round(row["moment_arm_mm"][0], 3)
        (30.63, 1.387)
    """
    table = closing(robot) if closing_table is None else closing_table
    arms = moment_arms(assemble(robot, flat=False))
    placed = list(zip(robot.notches, sites_of(robot), strict=True))
    described = {each: _description(*each, robot.tube) for each in dict.fromkeys(placed)}
    return [
        {
            "notch": index + 1,
            **described[each],
            "moment_arm_mm": arms[index].tolist(),
            "closing_angle_deg": float(table.angle[index]) * DEGREES,
            "closing_tendon": int(table.tendon[index]),
            "closing_tension_N": float(table.tension[index]),
            "closing_status": str(table.status[index]),
            "closing_outer_strain": float(table.outer_strain[index]),
            "closing_peak_strain": float(table.peak_strain[index]),
        }
        for index, each in enumerate(placed)
    ]


def named_values(notch: Notch) -> dict[str, Any]:
    """Return the values of a notch as in a robot file, their units in their names.

    Example:
        >>> from notchflex import load_robot
        >>> list(named_values(load_robot("pacheco2021-a").notches[0]))[:3]
        ['kind', 'cut', 'depth_mm']
    """
    values: dict[str, Any] = {}
    for name, field in fields_of(type(notch)).items():
        unit = (field.json_schema_extra or {}).get("unit", "")
        with_unit = f"{name}_{unit}" if unit and not name.endswith(f"_{unit}") else name
        values[with_unit] = getattr(notch, name)
    del values["repeat"]
    return values


def _description(notch: Notch, site: Site | None, tube: Tube) -> dict[str, Any]:
    one = rod_at(site, notch, tube)
    section = one.section
    weakest = int(np.argmin(section.second_moment_weak))
    values: dict[str, Any] = {
        "area_mm2": float(section.area[weakest]),
        "second_moment_mm4": float(section.second_moment_weak[weakest]),
    }
    if float(one.has_closure) > 0.0:  # opposite a spine
        values["centroid_mm"] = tube.outer_radius - float(section.edge_spine[weakest])
    return named_values(notch) | values
