"""Reading a plan file."""

from __future__ import annotations

import os
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from pydantic import TypeAdapter

from notchflex.results.files.specification import read_specification, robot_named, validated
from notchflex.robot.robot import Robot
from notchflex.sweeping.plan.parts import SweepPlan


def read_plan(path: str | os.PathLike[str]) -> tuple[SweepPlan, Robot]:
    """Read a plan file and the robot that it names.

    Args:
        path: The TOML file, in mm, N, MPa and deg.

    Returns:
        What is swept, and the robot that is varied.

    Raises:
        InputError: The file or its robot cannot be read, or a value in it is not allowed.
    """
    plan = read_specification(path, "plan file", plan_from_table)
    return plan, robot_named(plan.robot, Path(path).parent)


def plan_from_table(table: Mapping[str, Any]) -> SweepPlan:
    """Make a plan from the plain table of a plan file.

    Raises:
        InputError: A key is missing, not known, or its value is not allowed.

    Example:
        >>> depth = {"value": "notch.depth", "lower": 1.36, "upper": 1.42, "count": 7}
        >>> load, keep = {"pulled": {"tension": 1.0}}, [{"quantity": "total_angle"}]
        >>> table = {"robot": "pacheco2021-a", "variable": [depth], "load": load, "keep": keep}
        >>> plan_from_table(table).rows
        7
    """
    return validated(SweepPlan, table)


def plan_table(plan: SweepPlan) -> dict[str, Any]:
    """Return a plan as a plain table, which `plan_from_table` reads back."""
    table = TypeAdapter(SweepPlan).dump_python(plan, mode="json", exclude_none=True)
    return {key: value for key, value in table.items() if value is not None}
