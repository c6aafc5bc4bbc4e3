"""Reading a design file."""

from __future__ import annotations

import os
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from pydantic import TypeAdapter, ValidationError

from notchflex.designing.specification.spec import DesignSpec
from notchflex.errors import InputError
from notchflex.results.files.writing import read_text
from notchflex.robot.error_messages import sentences
from notchflex.robot.reading import load_robot, parse_toml
from notchflex.robot.robot import Robot

KIND = "design file"


def read_design(path: str | os.PathLike[str]) -> tuple[DesignSpec, Robot]:
    """Read a design file and the robot that it names.

    Args:
        path: The TOML file, in mm, N, MPa and deg.

    Returns:
        What is asked, and the robot to begin with.

    Raises:
        InputError: The file or its robot cannot be read, or a value in it is not allowed.
    """
    shown = os.fspath(path)
    text = read_text(path, KIND)
    try:
        spec = spec_from_table(parse_toml(text, shown, KIND, InputError))
    except InputError as error:
        lines = str(error).splitlines()
        told = (line if line.startswith(shown) else f"{shown}: {line}" for line in lines)
        raise InputError("\n".join(told), error.code) from None
    return spec, robot_of(spec, Path(path).parent)


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
    try:
        return TypeAdapter(DesignSpec).validate_python(dict(table))
    except ValidationError as error:
        raise InputError.INVALID_SPECIFICATION("\n".join(sentences(error, DesignSpec))) from None


def robot_of(spec: DesignSpec, folder: Path) -> Robot:
    """Read the robot that a specification names, from the folder of its file if it is a path."""
    path = folder / spec.robot
    is_file = spec.robot.endswith(".toml") or os.sep in spec.robot
    return load_robot(path if is_file else spec.robot)
