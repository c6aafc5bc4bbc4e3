"""Whether a state or a file belongs to a robot: values that differ, a fingerprint of all."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Mapping
from typing import Any

from notchflex.robot import Robot
from notchflex.robot.robot import to_table

# Values without effect on states: the name, the limit of strain warnings and tolerances.
_NO_EFFECT = ("name", "material.allowed_strain", "tolerance.")
_MAX_NAMED = 3


def differences(robot: Robot, other: Robot) -> list[str]:
    """List the values in which two robots differ, by their names in a robot file.

    Args:
        robot: The robot whose values are given first.
        other: The robot that it is compared with.

    Returns:
        One text for each value, such as `notch.depth = 1.38 instead of 1.4`; a value that differs
        in all notches in the same way is listed once.

    Example:
        >>> from notchflex.robot import load_robot
        >>> wrist = load_robot("pacheco2021-a")
        >>> differences(wrist.with_value("notch.depth", 1.38), wrist)
        ['notch.depth = 1.38 instead of 1.4']
    """
    first, second = _values(robot), _values(other)
    changes: dict[str, dict[tuple[Any, Any], list[str]]] = {}
    for name in dict.fromkeys([*first, *second]):
        pair = first.get(name), second.get(name)
        if pair[0] != pair[1]:
            changes.setdefault(_general(name), {}).setdefault(pair, []).append(name)
    changed: list[str] = []
    for general, pairs in changes.items():
        for (mine, its), names in pairs.items():
            everywhere = len(names) == sum(_general(one) == general for one in first)
            shown = [general] if everywhere else names
            changed += [f"{name} = {_text(mine)} instead of {_text(its)}" for name in shown]
    return changed


def mismatch(robot: Robot, other: Robot) -> str:
    """Describe in a few words how a robot differs from another one; "" where it does not."""
    if robot is other:  # robots do not change
        return ""
    changed = differences(robot, other)
    more = len(changed) - _MAX_NAMED
    return ", ".join(changed[:_MAX_NAMED]) + (f" and {more} more" if more > 0 else "")


def _values(robot: Robot) -> dict[str, Any]:
    """Return every value of a robot by its name, notch by notch."""
    table = to_table(robot.replace(notch=robot.notches))
    values: dict[str, Any] = {}
    for section, part in table.items():
        if isinstance(part, Mapping):
            parts = {section: part}
        elif isinstance(part, list):
            parts = {f"{section}[{number}]": one for number, one in enumerate(part, start=1)}
        else:
            values[section] = part
            continue
        values |= {
            f"{name}.{key}": value for name, one in parts.items() for key, value in one.items()
        }
    return {name: value for name, value in values.items() if not name.startswith(_NO_EFFECT)}


def _general(name: str) -> str:
    """Return the name that means a value of all notches or tendons."""
    section, _, key = name.partition(".")
    return f"{section.partition('[')[0]}.{key}"


def _text(value: Any) -> str:
    if value is None:
        return "none"
    return f"{value:g}" if isinstance(value, float) else str(value)


def robot_digest(robot: Robot) -> str:
    """Return 12 hexadecimal digits that depend on every value of a robot, its name included.

    Args:
        robot: The robot; comments and the order of keys in its file have no effect.

    Example:
        >>> from notchflex.robot import load_robot
        >>> wrist = load_robot("pacheco2021-a")
        >>> robot_digest(wrist) == robot_digest(wrist.with_value("notch.depth", 1.39))
        False
    """
    text = json.dumps(to_table(robot), sort_keys=True, ensure_ascii=False)
    return hashlib.sha256(text.encode()).hexdigest()[:12]
