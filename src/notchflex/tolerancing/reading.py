"""Files of tolerances and acceptance limits: TOML in mm, N, MPa and deg."""

from __future__ import annotations

import os
from collections.abc import Iterator, Mapping
from dataclasses import replace
from typing import Any, cast

import numpy as np

from notchflex._load_words import TendonCommand, load_columns, read_body_force, read_command, vector
from notchflex._quantity import REGISTERED
from notchflex.errors import InputError
from notchflex.loads import BodyForce, LoadPath
from notchflex.loads.validation import check_number, short_repr
from notchflex.results.files.writing import read_text
from notchflex.robot import Robot
from notchflex.robot.error_messages import unknown_key
from notchflex.robot.reading import parse_toml
from notchflex.tolerancing.spec import LIMIT_KEYS, AcceptanceLimit, ToleranceSpec

_TABLES = ("load", "accept", "tolerance", "yield")
_VECTORS = ("tip_force", "tip_moment", "tip_point", "gravity")
LOAD_KEYS = (
    *("tension", "stroke", "base_rotation"),
    *_VECTORS,
    *("tip_mass", "body_force", "following"),
)
"""Keys of a load in a file."""


def read_tolerance_spec(file: str | os.PathLike[str], robot: Robot) -> ToleranceSpec:
    """Read a file of tolerances and acceptance limits.

    Args:
        file: A TOML file in mm, N, MPa and deg with `[load.NAME]`, `[[accept]]` and, if the robot's
            own are not meant, `[tolerance]`; and `wanted` in `[yield]`.
        robot: The robot that it is for.

    Returns:
        What the file asks, in mm, N, MPa and rad.

    Raises:
        InputError: There is no such file, or it cannot be used; the message names the key.
    """
    name = os.fspath(file)
    table = parse_toml(read_text(file, "TOML file"), name)
    try:
        return spec_of(table, robot)
    except InputError as problem:
        raise type(problem)(f"{name}: {problem}", problem.code) from None


def spec_of(table: Mapping[str, Any], robot: Robot) -> ToleranceSpec:
    """Make a specification from the table of a file.

    Args:
        table: As read from TOML.
        robot: The robot that it is for.
    """
    for key in table:
        if key not in _TABLES:
            raise InputError.UNKNOWN_NAME(unknown_key(key, key, _TABLES))
    loads = _table(table, "load")
    if not loads:
        raise InputError.MISSING_VALUE(
            'there is no load; write, for example, [load.pulled] and below it tension = "0:2:5".'
        )
    yields = _table(table, "yield")
    _known(yields, ("wanted",), "yield")
    target = yields.get("wanted")
    return ToleranceSpec(
        list(_limits(table)),
        {name: read_load(_table(loads, name, "load."), name, robot) for name in loads},
        cast("Mapping[str, Any] | None", table.get("tolerance")),
        None if target is None else check_number(target, "yield.wanted"),
    )


def _table(table: Mapping[str, Any], key: str, before: str = "") -> dict[str, Any]:
    value = table.get(key, {})
    if not isinstance(value, dict):
        raise InputError.WRONG_TYPE(f"`{before}{key}` is not a table; write [{before}{key}].")
    return cast("dict[str, Any]", value)


def _known(table: Mapping[str, Any], allowed: tuple[str, ...], where: str) -> None:
    for key in table:
        if key not in allowed:
            raise InputError.UNKNOWN_NAME(unknown_key(f"{where}.{key}", key, allowed))


def _limits(table: Mapping[str, Any]) -> Iterator[AcceptanceLimit]:
    given = table.get("accept", [])
    if not isinstance(given, list) or not given:
        raise InputError.MISSING_VALUE(
            "there is no acceptance limit; write, for example, [[accept]] and below it quantity = "
            '"total_angle" and lower = 80.0.'
        )
    for number, one in enumerate(cast("list[Any]", given), start=1):
        where = f"accept[{number}]"
        if not isinstance(one, dict):
            raise InputError.WRONG_TYPE(f"`{where}` is not a table; write [[accept]].")
        keys = cast("dict[str, Any]", one)
        _known(keys, LIMIT_KEYS, where)
        if "quantity" not in keys:
            raise InputError.MISSING_VALUE(f"`{where}.quantity` is missing.")
        try:
            limit = AcceptanceLimit(**keys)
        except InputError as problem:
            raise type(problem)(f"`{where}`: {problem}", problem.code) from None
        scale = REGISTERED[limit.quantity].scale
        ends = {
            key: None if (end := getattr(limit, key)) is None else end / scale
            for key in ("lower", "upper")
        }
        yield replace(limit, **ends)


def read_load(table: Mapping[str, Any], name: str, robot: Robot) -> LoadPath:
    """Make a load of the table of a file, whose keys are the options of `notchflex simulate`.

    Args:
        table: As read from TOML.
        name: Name of the load, for messages.
        robot: The robot that it is for.
    """
    where = f"load.{name}"
    _known(table, LOAD_KEYS, where)
    commands = {
        key: [_command(key, where, one) for one in _several(table.get(key))]
        for key in ("tension", "stroke")
    }
    if not table:
        raise InputError.MISSING_VALUE(
            f'`{where}` is empty; write, for example, tension = "0:2:5".'
        )
    if not any(commands.values()):
        commands["tension"] = [TendonCommand("tension", 1, [float("nan")])]  # all hang slack
    try:
        tensions, strokes = load_columns(
            commands["tension"], commands["stroke"], robot.number_of_tendons
        )
        turn = np.radians(_vector(table.get("base_rotation", (0.0, 0.0, 0.0)), "angles in deg"))
        return _loaded(LoadPath(tensions, strokes, turn), table)
    except InputError as problem:
        raise type(problem)(f"`{where}`: {problem}", problem.code) from None


def _several(given: Any) -> list[Any]:
    if given is None:
        return []
    return cast("list[Any]", given) if isinstance(given, list) else [given]


def _command(key: str, where: str, given: Any) -> TendonCommand:
    """Read a number or a text such as `0:2:5` or `1=0:2:5`."""
    if isinstance(given, bool) or not isinstance(given, int | float | str):
        raise InputError.WRONG_TYPE(
            f'`{where}.{key}` is {short_repr(given)}; give a number, or text such as "0:2:5".'
        )
    text = given if isinstance(given, str) else repr(given)
    try:
        return read_command(f"{where}.{key}", key == "stroke", text)
    except InputError as problem:
        raise type(problem)(f"`{where}.{key}`: {problem}", problem.code) from None


def _vector(given: Any, what: str) -> tuple[float, float, float]:
    """Read three numbers, or the text `X,Y,Z`."""
    if isinstance(given, list | tuple):
        given = ",".join(repr(one) for one in cast("list[Any]", given))
    return vector(what)(str(given))


def _loaded(path: LoadPath, table: Mapping[str, Any]) -> LoadPath:
    """Put external loads on all steps."""
    vectors = {key: _vector(table[key], f"numbers of {key}") for key in _VECTORS if key in table}
    following = table.get("following", False)
    forces = [
        BodyForce(body, force, point=point or (0.0, 0.0, 0.0), following=following)
        for body, force, point in (
            read_body_force(str(one)) for one in _several(table.get("body_force"))
        )
    ]
    turns = {"following": following} if following and {"tip_force", "tip_moment"} & {*table} else {}
    mass = {"tip_mass": table["tip_mass"]} if "tip_mass" in table else {}
    bodies = {"body_forces": forces} if forces else {}
    external: dict[str, Any] = {**vectors, **mass, **bodies, **turns}
    return path.loaded(**external) if external else path
