"""Changes the friction law or the material of a robot."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any, NamedTuple

from notchflex.errors import InputError
from notchflex.robot import Friction, Material, Robot, kinds_of, list_robots, load_robot, to_table
from notchflex.robot.fields import fields_of, is_list

SECTIONS: dict[str, type] = {"friction": Friction, "material": Material}


class PartNumber(NamedTuple):
    """A number of a part: key in the robot file, value, unit ("" for none), description."""

    key: str
    value: float
    unit: str
    text: str


def kinds(section: str) -> list[str]:
    """Return the kinds of a part, `friction` or `material`, whose values are single numbers."""
    every = kinds_of(SECTIONS[section])
    return [kind for kind, cls in every.items() if not any(map(is_list, fields_of(cls).values()))]


def with_kind(robot: Robot, section: str, kind: str, original: Robot | None = None) -> Robot:
    """Return a robot with another kind of `friction` or `material`.

    Values that both kinds have are kept. Others come from the original robot, as its file describes
    it, if it is of this kind, else from the first ready robot of this kind.

    Raises:
        InputError: The kind is unknown, or no robot has values for it.
    """
    if original is not None and getattr(original, section).kind == kind:
        return robot.replace(**{section: getattr(original, section)})
    try:
        return robot.with_value(f"{section}.kind", kind)
    except InputError:
        if kind not in kinds(section):
            raise
    present = to_table(robot)[section]
    for ready in list_robots():
        table = to_table(load_robot(ready))[section]
        if table["kind"] == kind:
            shared = {key: present.get(key, value) for key, value in table.items()}
            for values in (shared, table):  # values of both kinds need not fit together
                named = {f"{section}.{key}": value for key, value in values.items()}
                try:
                    return robot.with_values({**named, f"{section}.kind": kind})
                except InputError:
                    continue
    raise InputError.UNKNOWN_NAME(
        f'no ready robot has a {section} of the kind "{kind}" to take values from'
    )


def numbers(robot: Robot, section: str) -> Iterator[PartNumber]:
    """Yield the numbers of the `friction` or the `material` of a robot.

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
            yield PartNumber(key, value, unit, str(field.description))
