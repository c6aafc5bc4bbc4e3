"""Files that ask for something of a robot that they name, such as a design or a sweep: TOML."""

from __future__ import annotations

import os
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any, TypeVar

from pydantic import TypeAdapter, ValidationError

from notchflex.errors import InputError
from notchflex.robot.error_messages import sentences
from notchflex.robot.reading import load_robot, parse_toml, read_text
from notchflex.robot.robot import Robot

Asked = TypeVar("Asked")


def read_specification(
    path: str | os.PathLike[str], kind: str, make: Callable[[Mapping[str, Any]], Asked]
) -> Asked:
    """Read a file and make what it asks.

    Args:
        path: The TOML file.
        kind: What messages call it.
        make: Makes it of the plain table of the file.

    Raises:
        InputError: The file cannot be read, or a value in it is not allowed; every line of the
            message names the file.
    """
    shown = os.fspath(path)
    text = read_text(path, kind)
    try:
        return make(parse_toml(text, shown, kind, InputError))
    except InputError as error:
        lines = str(error).splitlines()
        named = (line if line.startswith(shown) else f"{shown}: {line}" for line in lines)
        raise InputError("\n".join(named), error.code) from None


def validated(kind: type[Asked], table: Mapping[str, Any]) -> Asked:
    """Make a value of a checked class of a plain table.

    Raises:
        InputError: A key is missing, not known, or its value is not allowed.
    """
    try:
        return TypeAdapter(kind).validate_python(dict(table))
    except ValidationError as error:
        raise InputError.INVALID_SPECIFICATION("\n".join(sentences(error, kind))) from None


def robot_named(name: str, folder: Path) -> Robot:
    """Read the robot that a file names, from the folder of the file if it is a path.

    Raises:
        InputError: There is no such robot, or it cannot be read.
    """
    is_file = name.endswith(".toml") or os.sep in name
    return load_robot(folder / name if is_file else name)
