"""The numbers of a robot file, and robots with other numbers that nothing has checked.

What remains without its numbers is the structure of a robot: kinds of its parts, how many there
are, words such as "on-axis", and directions, which decide what lies in a plane.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any, NamedTuple

from notchflex.robot.part import unchecked
from notchflex.robot.robot import Robot

_OF_STRUCTURE = ("direction_deg",)


class NumberPath(NamedTuple):
    """Where a number of a robot file stands.

    Attributes:
        section: "tube", "notch", "tendon", "material" or "friction".
        entry: Which entry of the file, from 0; a row of equal notches is one.
        key: The key.
    """

    section: str
    entry: int
    key: str


def entries_of(robot: Robot) -> dict[str, tuple[Any, ...]]:
    """Return the parts of a robot that hold numbers, by section."""
    single = {name: (getattr(robot, name),) for name in ("tube", "material", "friction")}
    return {"notch": robot.notch, "tendon": robot.tendon, **single}


def numbers_of(robot: Robot) -> dict[NumberPath, float]:
    """Return every finite number of a robot, in the order of its file.

    Example:
        >>> from notchflex.robot import load_robot
        >>> numbers_of(load_robot("pacheco2021-a"))[NumberPath("notch", 0, "depth")]
        1.4
    """
    return {
        NumberPath(section, entry, key): value
        for section, parts in entries_of(robot).items()
        for entry, part in enumerate(parts)
        for key, value in vars(part).items()
        if type(value) is float and math.isfinite(value) and key not in _OF_STRUCTURE
    }


def with_numbers(robot: Robot, numbers: Mapping[NumberPath, Any]) -> Robot:
    """Return the robot with other numbers, which may be traced; they are not checked."""
    parts: dict[str, Any] = {}
    for section, entries in entries_of(robot).items():
        changed = tuple(
            unchecked(
                part,
                **{
                    path.key: value
                    for path, value in numbers.items()
                    if path[:2] == (section, entry)
                },
            )
            for entry, part in enumerate(entries)
        )
        parts[section] = changed if section in ("notch", "tendon") else changed[0]
    return unchecked(robot, **parts)
