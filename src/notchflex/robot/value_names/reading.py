"""Reading values of a robot by their names: number, unit and limits."""

import math
from collections.abc import Iterator
from typing import NamedTuple

from notchflex.errors import InputError
from notchflex.robot.error_messages import nearest
from notchflex.robot.fields import fields_of
from notchflex.robot.robot import Robot, to_table
from notchflex.robot.tolerance import amount
from notchflex.robot.value_names.paths import EXAMPLES, class_of, parse_path, tables_at


class Described(NamedTuple):
    """A number of a robot: its unit ("" for none) and its limits."""

    unit: str
    lower: float
    upper: float


def number_at(robot: Robot, path: str) -> float:
    """Return a number of a robot by its name, in the units of the robot file.

    Args:
        robot: The robot.
        path: Its name, as for `Robot.with_value`.

    Raises:
        InputError: There is no such value, it is not a number that can vary continuously, or
            notches have different ones.
    """
    if not isinstance(path, str):  # pyright: ignore[reportUnnecessaryIsInstance]
        raise InputError.UNKNOWN_NAME(f"{path!r} is not the name of a value; {EXAMPLES}.")
    target = parse_path(path)
    numbers: set[object] = set()
    allowed: dict[str, None] = {}
    for one in tables_at(to_table(robot), target) if target.section != "name" else ():
        keys = fields_of(class_of(target.section, one))
        allowed |= dict.fromkeys(keys)
        if target.key in keys:
            numbers.add(one.get(target.key, keys[target.key].default))
    if not numbers:
        near = nearest(target.key, allowed)
        raise InputError.UNKNOWN_NAME(
            f"`{path}` is not the name of a number of this robot{near}; {EXAMPLES}."
        )
    if len(numbers) > 1:
        raise InputError.UNSUPPORTED(
            f"`{path}` has unlike values in this robot; name one, such as [1]."
        )
    value = numbers.pop()
    if not isinstance(value, float) or not math.isfinite(value):
        raise InputError.UNSUPPORTED(
            f"`{path}` is {value!r} in this robot, and no number that changes smoothly."
        )
    return value


def numbers_at(robot: Robot, path: str) -> dict[str, float]:
    """Return every number that a path refers to, each by its own name.

    Args:
        robot: The robot.
        path: As for `Robot.with_value`; `notch.depth` means that of every notch that has a depth.

    Raises:
        InputError: As for `number_at`.

    Example:
        >>> from notchflex.robot import load_robot
        >>> numbers_at(load_robot("pacheco2021-c"), "notch.depth")["notch[2].depth"]
        1.39
    """
    target = parse_path(path)
    counts = {"notch": robot.number_of_notches, "tendon": robot.number_of_tendons}
    if target.section not in counts or target.number is not None:
        return {path: number_at(robot, path)}
    numbers: dict[str, float] = {}
    for number in range(1, counts[target.section] + 1):
        name = f"{target.section}[{number}].{target.key}"
        try:
            numbers[name] = number_at(robot, name)
        except InputError:  # a notch of another kind
            continue
    return numbers or {path: number_at(robot, path)}


def described_at(robot: Robot, path: str) -> Described:
    """Return unit and limits of a number of a robot by its name.

    Args:
        robot: The robot.
        path: Its name, as for `Robot.with_value`.

    Raises:
        InputError: There is no such value.
    """
    target = parse_path(path)
    for one in tables_at(to_table(robot), target) if target.section != "name" else ():
        field = fields_of(class_of(target.section, one)).get(target.key)
        if field is not None:
            unit = str((field.json_schema_extra or {}).get("unit", ""))  # pyright: ignore
            lower = [
                getattr(one, key)
                for one in field.metadata
                for key in ("gt", "ge")
                if hasattr(one, key)
            ]
            upper = [
                getattr(one, key)
                for one in field.metadata
                for key in ("lt", "le")
                if hasattr(one, key)
            ]
            return Described(unit, max(lower, default=-math.inf), min(upper, default=math.inf))
    raise InputError.UNKNOWN_NAME(
        f"`{path}` is not the name of a number of this robot; {EXAMPLES}."
    )


def tolerance_problems(robot: Robot) -> Iterator[tuple[str, str]]:
    """Find tolerances of what the robot does not have, or in a wrong unit."""
    for one in robot.tolerance:
        try:
            numbers = numbers_at(robot, one.value)
        except InputError as error:
            yield f"tolerance.{one.value}", f"is about no number of this robot: {error}"
            continue
        unit = described_at(robot, one.value).unit
        if one.per_notch and not one.value.startswith("notch."):
            yield f"tolerance.{one.value}", "has `per_notch`, which is for values of all notches."
        smallest = min(abs(number) for number in numbers.values())
        for key in ("sd", "plus", "minus") if unit in ("mm", "MPa") and smallest else ():
            size = getattr(one, key)
            if size is not None and amount(size, smallest) >= smallest:
                yield (
                    f"tolerance.{one.value}",
                    f"has {key} = {size}, as much as the value itself, {smallest:g} {unit}; "
                    f"give it in {unit}, or in percent as text.",
                )
