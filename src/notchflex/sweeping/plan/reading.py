"""Reading a plan file."""

from __future__ import annotations

import os
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from pydantic import TypeAdapter, ValidationError

from notchflex.errors import InputError
from notchflex.results.files.writing import read_text
from notchflex.robot.error_messages import sentences
from notchflex.robot.reading import load_robot, parse_toml
from notchflex.robot.robot import Robot
from notchflex.sweeping.plan.parts import SweepPlan

KIND = "plan file"
TEMPLATE = Path(__file__).with_name("template.toml")
"""The plan file that `notchflex new --sweep` writes."""


def read_plan(path: str | os.PathLike[str]) -> tuple[SweepPlan, Robot]:
    """Read a plan file and the robot that it names.

    Args:
        path: The TOML file, in mm, N, MPa and deg.

    Returns:
        What is swept, and the robot that is varied.

    Raises:
        InputError: The file or its robot cannot be read, or a value in it is not allowed.
    """
    shown = os.fspath(path)
    text = read_text(path, KIND)
    try:
        plan = plan_from_table(parse_toml(text, shown, KIND, InputError))
    except InputError as error:
        lines = str(error).splitlines()
        said = (line if line.startswith(shown) else f"{shown}: {line}" for line in lines)
        raise InputError("\n".join(said), error.code) from None
    file = Path(path).parent / plan.robot
    is_file = plan.robot.endswith(".toml") or os.sep in plan.robot
    return plan, load_robot(file if is_file else plan.robot)


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
    try:
        return TypeAdapter(SweepPlan).validate_python(dict(table))
    except ValidationError as error:
        raise InputError.INVALID_SPECIFICATION("\n".join(sentences(error, SweepPlan))) from None


def plan_table(plan: SweepPlan) -> dict[str, Any]:
    """Return a plan as a plain table, which `plan_from_table` reads back."""
    table = TypeAdapter(SweepPlan).dump_python(plan, mode="json", exclude_none=True)
    return {key: value for key, value in table.items() if value is not None}
