"""Setting values of a robot by their names (`--set`)."""

import tomllib
from collections.abc import Iterable, Mapping
from typing import Any, NamedTuple, cast

from notchflex.errors import InputError
from notchflex.robot.error_messages import nearest, unknown_key
from notchflex.robot.fields import fields_of
from notchflex.robot.kinds import kinds_of
from notchflex.robot.robot import Robot, from_table, remember_source, source_of, to_table
from notchflex.robot.value_names.paths import (
    EXAMPLES,
    SECTIONS,
    ValuePath,
    class_of,
    parse_path,
    tables_at,
)

# Begins the name of a tolerance, such as `tolerance.notch.depth`.
_TOLERANCE = "tolerance."


class Changed(NamedTuple):
    """A robot with new values, and the keys that a change of kind dropped."""

    robot: Robot
    dropped: tuple[str, ...]


def set_values(
    robot: Robot, values: Mapping[str, object] | Iterable[tuple[str, object]]
) -> Changed:
    """Set values of a robot by their names; all are set before any is checked.

    Kinds are changed first, then the values of all notches or tendons, then those of single ones,
    so that the order of `values` does not matter.

    Args:
        robot: The robot to start from; it stays as it is.
        values: New values by path (see `Robot.with_value`), in mm, N, MPa and deg.

    Returns:
        The new robot, and the paths of the values that a change of kind dropped.

    Raises:
        InputError: A path is not known or given twice, or a value is not allowed.
    """
    table = to_table(robot)
    dropped = change_table(table, values)
    return Changed(remember_source(from_table(table), source_of(robot)), dropped)


def change_table(
    table: dict[str, Any], values: Mapping[str, object] | Iterable[tuple[str, object]]
) -> tuple[str, ...]:
    """Set values in the plain table of a robot; return the paths that a change of kind dropped."""
    given = cast("Mapping[str, object]", values).items() if isinstance(values, Mapping) else values
    pairs = [(str(path), value) for path, value in given]
    tolerances = {path: value for path, value in pairs if path.strip().startswith(_TOLERANCE)}
    targets = [(parse_path(path), value) for path, value in pairs if path not in tolerances]
    targets.sort(key=lambda item: (item[0].key != "kind", item[0].number is not None))
    for path, value in tolerances.items():
        table.setdefault("tolerance", {})[path.strip().removeprefix(_TOLERANCE)] = value
    dropped: list[str] = []
    seen: set[tuple[str, int | None, str]] = set()
    for target, value in targets:
        if target[1:] in seen:
            raise InputError.CONFLICT(f"`{target.path}` is set twice; set it once.")
        seen.add(target[1:])
        if target.section == "name":
            table["name"] = value
        elif target.key == "kind":
            dropped += _set_kind(table, target, value)
        else:
            _set_key(table, target, value)
    for path in dropped:
        table.get("tolerance", {}).pop(path, None)
    return tuple(dropped)


def parse_assignment(text: str) -> tuple[str, object]:
    """Read `PATH=VALUE` of the command line; the value is a number, or else text.

    Args:
        text: Such as `notch[2].depth=1.3` or `friction.wrap=geometric`.

    Raises:
        InputError: There is no `=`, no path or no value.

    Example:
        >>> parse_assignment("notch[2].depth=1.3")
        ('notch[2].depth', 1.3)
    """
    path, equals, value = (piece.strip() for piece in text.partition("="))
    if not (path and equals and value):
        raise InputError.BAD_SYNTAX(
            f"`{text}` sets nothing; {EXAMPLES.replace('depth', 'depth=1.3', 1)}."
        )
    return path, parse_value(value)


def parse_value(text: str) -> object:
    """Read a value as a robot file holds it: a number, true or false, or else text."""
    for read in (int, float, lambda one: tomllib.loads(f"x = {one}")["x"]):
        try:
            return read(text)
        except (ValueError, RecursionError):
            continue
    return text


def _set_key(table: dict[str, Any], target: ValuePath, value: object) -> None:
    """Set a key wherever the kind of part has it."""
    if (target.section, target.key) == ("notch", "repeat"):
        raise InputError.UNSUPPORTED(
            f"`{target.path}` would change the number of notches; change `repeat` in the robot "
            "file instead."
        )
    taken = False
    allowed: dict[str, None] = {}
    for one in tables_at(table, target):
        keys = fields_of(class_of(target.section, one))
        allowed |= dict.fromkeys(keys)
        if target.key in keys:
            one[target.key] = value
            taken = True
    if not taken:
        raise InputError.UNKNOWN_NAME(unknown_key(target.path, target.key, allowed))


def _set_kind(table: dict[str, Any], target: ValuePath, value: object) -> list[str]:
    """Replace a kind: keep the keys that both kinds share, and return the paths of the others."""
    base = SECTIONS[target.section]
    if target.section in ("tube", "tendon", "drawing"):
        raise InputError.UNKNOWN_NAME(unknown_key(target.path, "kind", fields_of(base)))
    kinds = kinds_of(base)
    if value not in kinds:
        allowed = ", ".join(f'"{kind}"' for kind in kinds)
        raise InputError.UNKNOWN_NAME(
            f'`{target.path}` is "{value}"; allowed: {allowed}{nearest(str(value), kinds)}.'
        )
    new = fields_of(kinds[str(value)])
    dropped: list[str] = []
    for one in tables_at(table, target):
        for key in [key for key in one if key not in new]:
            dropped.append(target.path.removesuffix("kind") + key)
            del one[key]
        one["kind"] = value
    return list(dict.fromkeys(dropped))
