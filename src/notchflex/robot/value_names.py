"""Names of values, such as `notch[2].depth`: reading and setting values by them."""

import math
import re
import tomllib
from collections.abc import Iterable, Iterator, Mapping
from typing import Any, NamedTuple, cast

from notchflex.errors import InputError
from notchflex.robot.kinds import (
    Friction,
    Material,
    Notch,
    Tendon,
    Tube,
    kinds_of,
)
from notchflex.robot.part import (
    fields_of,
    nearest,
    unknown_key,
)
from notchflex.robot.problems import amount
from notchflex.robot.robot import (
    Drawing,
    Robot,
    from_table,
    remember_source,
    source_of,
    to_table,
)

# Paths of values, such as `notch[2].depth`: their parts, and the tables that they mean.

SECTIONS: dict[str, type] = {
    "tube": Tube,
    "notch": Notch,
    "tendon": Tendon,
    "material": Material,
    "friction": Friction,
    "drawing": Drawing,
}
EXAMPLES = "write it like material.elastic_modulus, notch[2].depth or notch[*].depth"

_PATH = re.compile(r"(?P<section>\w+)(?:\[(?P<index>\*|\d+)\])?(?:\.(?P<key>\w+))?")
# More digits than the number of any notch has.
_DIGITS = 9


class ValuePath(NamedTuple):
    """A parsed path: `number` is None for the whole list and for sections that are no list."""

    path: str
    section: str
    number: int | None
    key: str


def parse_path(path: str) -> ValuePath:
    """Split a path and check its section and whether a number may stand there."""
    match = _PATH.fullmatch(path.strip())
    if not match:
        raise InputError.UNKNOWN_NAME(f"`{path}` is not the name of a value; {EXAMPLES}.")
    section, index, key = match["section"], match["index"], match["key"]
    if section == "name" and index is None and key is None:
        return ValuePath(path, "name", None, "")
    if section not in SECTIONS and key is None:
        owners = [f"`{one}.{section}`" for one in SECTIONS if section in keys_of(one)]
        near = nearest(section, ["name", *SECTIONS])
        meant = f" (did you mean {' or '.join(owners)}?)" if owners else near
        raise InputError.UNKNOWN_NAME(f"`{path}` is not the name of a value{meant}; {EXAMPLES}.")
    if section not in SECTIONS:
        allowed = ["name", *SECTIONS]
        raise InputError.UNKNOWN_NAME(
            f"`{path}` begins with `{section}`, which no robot has{nearest(section, allowed)}. "
            f"Allowed: {', '.join(allowed)}."
        )
    if key is None:
        raise InputError.UNKNOWN_NAME(f"`{path}` names no single value; {EXAMPLES}.")
    if index is not None and section not in ("notch", "tendon"):
        raise InputError.UNKNOWN_NAME(
            f"`{path}` has a number, but there is one {section}: `{section}.{key}`."
        )
    if index is not None and len(index) > _DIGITS:
        raise InputError.OUT_OF_RANGE(f"there is no {section} of that number; {EXAMPLES}.")
    return ValuePath(path, section, None if index in (None, "*") else int(index), key)


def tables_at(table: dict[str, Any], target: ValuePath) -> list[dict[str, Any]]:
    """Find the tables that a path means; a single notch is first split from its group."""
    tables = table.setdefault(target.section, {})
    if isinstance(tables, dict):
        return [tables]
    if target.number is None:
        return tables
    number = sum(one.get("repeat", 1) for one in tables)
    if not 1 <= target.number <= number:
        plural = {"notch": "notches", "tendon": "tendons"}[target.section]
        raise InputError.OUT_OF_RANGE(
            f"`{target.path}`: the robot has {number} {target.section if number == 1 else plural}; "
            f"give a number from 1 to {number}."
        )
    before = target.number - 1  # how many stand before the chosen one, within its group in the end
    group = 0
    while before >= (count := tables[group].get("repeat", 1)):
        before -= count
        group += 1
    if count > 1:
        one = tables[group]
        kind = cast("type[Notch]", class_of("notch", one))  # nothing else is repeated
        pieces = ((0, before), (before, 1), (before + 1, count - before - 1))
        tables[group : group + 1] = [
            kind.further_on(one, start) | {"repeat": number} for start, number in pieces if number
        ]
        group += 1 if before else 0
    return [tables[group]]


def defaults_of(section: str, table: Mapping[str, Any]) -> dict[str, Any]:
    """Return the defaults of the keys of a part, which a file may leave out; not of its kind."""
    keys = fields_of(class_of(section, table))
    return {
        name: field.default
        for name, field in keys.items()
        if name != "kind" and not field.is_required()
    }


def keys_of(section: str) -> set[str]:
    """Return the keys that any kind of a part has."""
    base = SECTIONS[section]
    classes = kinds_of(base).values() if issubclass(base, Notch | Material | Friction) else [base]
    return {key for one in classes for key in fields_of(one)}


def class_of(section: str, table: Mapping[str, Any]) -> type:
    """Return the class of a part, given as the table of a file."""
    base = SECTIONS[section]
    return kinds_of(base)[table["kind"]] if "kind" in table else base


# Setting values of a robot by their names (`--set`).

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


# Reading values of a robot by their names: number, unit and limits.


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
