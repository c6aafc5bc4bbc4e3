"""Reading a design file."""

from __future__ import annotations

import os
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from notchflex.designing.specification.spec import DesignSpec
from notchflex.results.files.specification import read_specification, robot_named, validated
from notchflex.robot.robot import Robot


def read_design(path: str | os.PathLike[str]) -> tuple[DesignSpec, Robot]:
    """Read a design file and the robot that it names.

    Args:
        path: The TOML file, in mm, N, MPa and deg.

    Returns:
        What is asked, and the robot to begin with.

    Raises:
        InputError: The file or its robot cannot be read, or a value in it is not allowed.
    """
    spec = read_specification(path, "design file", spec_from_table)
    return spec, robot_named(spec.robot, Path(path).parent)


def spec_from_table(table: Mapping[str, Any]) -> DesignSpec:
    """Make a specification from the plain table of a design file.

    Raises:
        InputError: A key is missing, not known, or its value is not allowed.

    Example:
        >>> wish = {"quantity": "notch.height", "goal": "minimise"}
        >>> height = {"value": "notch.height", "lower": 0.3, "upper": 1.0}
        >>> table = {"robot": "pacheco2021-a", "variable": [height], "objective": [wish]}
        >>> spec_from_table(table).variable[0].along
        'all'
    """
    return validated(DesignSpec, table)
