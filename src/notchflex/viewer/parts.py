"""Other friction laws and materials for a robot, to see what each does."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any, NamedTuple

from notchflex.errors import InputError
from notchflex.robot import Friction, Material, Robot, kinds_of, list_robots, load_robot, to_table

SECTIONS: dict[str, type] = {"friction": Friction, "material": Material}


class Number(NamedTuple):
    """A number of a part that can be changed.

    Attributes:
        key: Its key in the robot file, such as `coefficient`.
        value: What it is now.
        unit: Its unit; "" for a pure number.
        text: What it is, in a few words.
    """

    key: str
    value: float
    unit: str
    text: str


def kinds(section: str) -> list[str]:
    """Return the words for the kinds of a part, `friction` or `material`."""
    return list(kinds_of(SECTIONS[section]))


def with_kind(robot: Robot, section: str, kind: str, original: Robot | None = None) -> Robot:
    """Return a robot with another kind of friction or material.

    It keeps the values that both kinds share. Others come from the robot as its file has it, if
    that is of this kind, else from the first ready robot that is.

    Args:
        robot: The robot.
        section: `friction` or `material`.
        kind: The word for the kind.
        original: The robot as its file has it.

    Raises:
        InputError: There is no such kind, or nothing to take its values from.
    """
    if original is not None and getattr(original, section).kind == kind:
        return robot.replace(**{section: getattr(original, section)})
    try:
        return robot.with_value(f"{section}.kind", kind)
    except InputError:
        if kind not in kinds(section):
            raise
    own = to_table(robot)[section]
    for ready in list_robots():
        table = to_table(load_robot(ready))[section]
        if table["kind"] == kind:
            keys = {key: own.get(key, value) for key, value in table.items() if key != "kind"}
            values = {f"{section}.{key}": value for key, value in keys.items()}
            return robot.with_values({f"{section}.kind": kind, **values})
    raise InputError.UNKNOWN_NAME(
        f'no ready robot has a {section} of the kind "{kind}" to take values from'
    )


def numbers(robot: Robot, section: str) -> Iterator[Number]:
    """Return what can be changed bit by bit about a part: its numbers that are set.

    Args:
        robot: The robot.
        section: `friction` or `material`.

    Example:
        >>> [one.key for one in numbers(load_robot("pacheco2021-a"), "friction")]
        ['coefficient']
    """
    part = getattr(robot, section)
    fields: dict[str, Any] = getattr(type(part), "__pydantic_fields__", {})
    for key, field in fields.items():
        value = getattr(part, key)
        if isinstance(value, float):
            unit = str((field.json_schema_extra or {}).get("unit", ""))
            yield Number(key, value, unit, str(field.description))


__all__ = ["Number", "kinds", "numbers", "with_kind"]
