"""Loads of files: a table whose keys are the options of `notchflex simulate`."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Annotated, Any

import numpy as np
from pydantic import Field

from notchflex import BodyForce, InputError, LoadPath, Robot
from notchflex.specification.reading import known, placed
from notchflex.specification.records import as_list
from notchflex.support import (
    TendonCommand,
    Vector,
    load_columns,
    parse_spec,
    parse_vector,
    read_body_force,
    read_command,
    short_repr,
)

_DRIVES = ("tension", "stroke")
_VECTORS = ("tip_force", "tip_moment", "tip_point", "gravity")
_NUMBERS = "tip_mass", "sheath_bend_deg"
_OTHERS = "temperature", "body_force", "following"
LOAD_KEYS = (*_DRIVES, "base_rotation", *_VECTORS, *_NUMBERS, *_OTHERS)
"""Keys of a load in a file."""

LoadTables = Annotated[dict[str, dict[str, Any]], Field(min_length=1, max_length=100)]


def read_load(table: Mapping[str, Any], name: str, robot: Robot) -> LoadPath:
    """Make a load of the table of a file.

    Args:
        table: As read from TOML.
        name: Name of the load, for messages.
        robot: The robot that it is for.

    Raises:
        InputError: A key is not known, or a load is not allowed.
    """
    with placed(f"`load.{name}`"):
        for key in table:
            known(key, dict.fromkeys(LOAD_KEYS), "key")
        if not table:
            raise InputError.MISSING_VALUE('it is empty; write, for example, tension = "0:2:5".')
        tension, stroke = (
            [_command(key, given) for given in as_list(table.get(key, ()))] for key in _DRIVES
        )
        if not tension and not stroke:
            tension = [TendonCommand("tension", 1, [math.nan])]  # all hang slack
        columns = load_columns(tension, stroke, robot.number_of_tendons)
        turn = np.radians(_vector("base_rotation", table.get("base_rotation", "0,0,0")))
        return _with_external(LoadPath(*columns, turn), table)


def _command(key: str, given: Any) -> TendonCommand:
    """Read a number or a text such as `0:2:5` or `1=0:2:5`."""
    with placed(f"`{key}`"):
        if isinstance(given, bool) or not isinstance(given, int | float | str):
            got = short_repr(given)
            raise InputError.WRONG_TYPE(f'it is {got}; give a number, or text such as "0:2:5".')
        return read_command(key, key == "stroke", str(given))


def _vector(key: str, given: Any) -> Vector:
    """Read three numbers, or the text `X,Y,Z`."""
    text = ",".join(map(str, given)) if isinstance(given, list | tuple) else str(given)
    return parse_vector(f"numbers of {key}")(text)


def _with_external(path: LoadPath, table: Mapping[str, Any]) -> LoadPath:
    """Put external loads on all steps."""
    following = table.get("following", False)
    forces = [
        BodyForce(**read_body_force(str(force))._asdict(), following=following)
        for force in as_list(table.get("body_force", ()))
    ]
    return path.loaded(
        **{key: _vector(key, table[key]) for key in _VECTORS if key in table},
        temperature=parse_spec(str(table["temperature"])) if "temperature" in table else None,
        **{key: table.get(key) for key in _NUMBERS},
        body_forces=forces or None,
        following=following if {"tip_force", "tip_moment"} & {*table} else None,
    )
