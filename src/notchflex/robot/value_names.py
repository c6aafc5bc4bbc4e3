"""Names of values, such as `notch[2].depth`: where they sit, reading and setting them."""

import math
import re
import tomllib
from bisect import bisect_left
from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import suppress
from itertools import accumulate
from operator import attrgetter
from typing import TYPE_CHECKING, Any, NamedTuple, cast

from notchflex.errors import InputError
from notchflex.robot.fatigue import Fatigue
from notchflex.robot.kinds import Drawing, Drive, Friction, Material, Notch, Tendon, Tube, kinds_of
from notchflex.robot.part import fields_in, fields_of, nearest, unit_of, unknown_key

if TYPE_CHECKING:
    from notchflex.robot.robot import Robot

# Where values sit: sections of a robot, and their parts counted as in every output.

SECTIONS: dict[str, type] = {
    "tube": Tube,
    "notch": Notch,
    "tendon": Tendon,
    "drive": Drive,
    "material": Material,
    "friction": Friction,
    "fatigue": Fatigue,
    "drawing": Drawing,
}
EXAMPLES = "write it like material.elastic_modulus, notch[2].depth or notch[*].depth"

PLURAL = {"notch": "notches", "tendon": "tendons", "drive": "drives"}
_PATH = re.compile(r"(?P<section>\w+)(?:\[(?P<index>\*|\d+)\])?(?:\.(?P<key>\w+(?:\.\w+)?))?")
# More digits than the number of any notch has.
_DIGITS = 10


class NamedPart(NamedTuple):
    """A part of a robot, which may stand for several equal notches.

    Attributes:
        section: Its section.
        first: The number of its first notch or of its tendon, from 1; 0 for other parts.
        part: The part.
    """

    section: str
    first: int
    part: Any

    @property
    def name(self) -> str:
        """Its name, with the number of its first notch."""
        return f"{self.section}[{self.first}]" if self.first else self.section

    def is_meant(self, target: "ValuePath") -> bool:
        """Return whether a path means this part, or some of the notches that it stands for."""
        behind = self.first + getattr(self.part, "repeat", 1)
        in_it = target.number is None or self.first <= target.number < behind
        return target.section == self.section and in_it


def named_parts(robot: "Robot") -> Iterator[NamedPart]:
    """Yield the parts of a robot in the order of its file."""
    for section in SECTIONS:
        if section not in PLURAL:
            yield NamedPart(section, 0, getattr(robot, section))
            continue
        first = 1
        for part in getattr(robot, section):
            yield NamedPart(section, first, part)
            first += getattr(part, "repeat", 1)


def group_of(number: int, repeats: Sequence[int]) -> tuple[int, int]:
    """Return the group of equal parts that holds one of a number, and how many precede it there."""
    ends = list(accumulate(repeats))
    group = bisect_left(ends, number)
    return group, number - 1 - (ends[group] - repeats[group])


class ValuePath(NamedTuple):
    """A parsed path: `number` is None for the whole list and for sections that are no list."""

    path: str
    section: str
    number: int | None
    key: str

    def check_number(self, count: int) -> None:
        """Refuse a number that a robot with so many notches or tendons does not have."""
        if self.number is not None and not 1 <= self.number <= count:
            raise InputError.OUT_OF_RANGE(
                f"`{self.path}`: the robot has {count} "
                f"{self.section if count == 1 else PLURAL[self.section]}; "
                f"give a number from 1 to {count}."
            )


def parse_path(path: str) -> ValuePath:
    """Split a path and check its section and whether a number may stand there."""
    if not isinstance(path, str) or not (match := _PATH.fullmatch(path.strip())):  # pyright: ignore
        shown = path if isinstance(path, str) else repr(path)  # pyright: ignore
        raise InputError.UNKNOWN_NAME(f"`{shown}` is not the name of a value; {EXAMPLES}.")
    section, index, key = match["section"], match["index"], match["key"]
    if section == "name" and index is None and key is None:
        return ValuePath(path, "name", None, "")
    if section not in SECTIONS:
        allowed = ["name", *SECTIONS]
        near = nearest(section, allowed)
        if key is not None:
            raise InputError.UNKNOWN_NAME(
                f"`{path}` begins with `{section}`, which no robot has{near}. "
                f"Allowed: {', '.join(allowed)}."
            )
        owners = [f"`{name}.{section}`" for name in SECTIONS if section in _keys_of(name)]
        meant = f" (did you mean {' or '.join(owners)}?)" if owners else near
        raise InputError.UNKNOWN_NAME(f"`{path}` is not the name of a value{meant}; {EXAMPLES}.")
    if key is None:
        raise InputError.UNKNOWN_NAME(f"`{path}` names no single value; {EXAMPLES}.")
    if index is not None and section not in PLURAL:
        raise InputError.UNKNOWN_NAME(
            f"`{path}` has a number, but there is one {section}: `{section}.{key}`."
        )
    return ValuePath(path, section, None if index in (None, "*") else int(index[:_DIGITS]), key)


def class_of(section: str, table: Mapping[str, Any]) -> type:
    """Return the class of a part, given as the table of a file."""
    base = SECTIONS[section]
    return kinds_of(base)[table["kind"]] if "kind" in table else base


def _keys_of(section: str) -> set[str]:
    """Return the keys that any kind of a part has."""
    base = SECTIONS[section]
    classes = kinds_of(base).values() if "kind" in fields_of(base) else [base]
    return {key for cls in classes for key in fields_of(cls)}


# Setting values in the tables of a robot file by their names (`--set`).

# Begins the name of a tolerance, such as `tolerance.notch.depth`.
_TOLERANCE = "tolerance."


def change_table(
    table: dict[str, Any], values: Mapping[str, object] | Iterable[tuple[str, object]]
) -> tuple[str, ...]:
    """Set values in the plain table of a robot; return the paths that a change of kind dropped."""
    # Kinds first, then values of all notches or tendons, then of single ones: in any order alike.
    targets: list[tuple[ValuePath, object]] = []
    for name, value in cast("Any", values.items() if isinstance(values, Mapping) else values):
        path = str(name)
        if path.strip().startswith(_TOLERANCE):
            table.setdefault("tolerance", {})[path.strip().removeprefix(_TOLERANCE)] = value
        else:
            targets.append((parse_path(path), value))
    targets.sort(key=lambda item: (not item[0].key.endswith("kind"), item[0].number is not None))
    dropped: dict[str, None] = {}
    seen: set[tuple[Any, ...]] = set()
    for target, value in targets:
        if target[1:] in seen:
            raise InputError.CONFLICT(f"`{target.path}` is set twice; set it once.")
        seen.add(target[1:])
        if target.section == "name":
            table["name"] = value
        elif target.key.endswith("kind"):
            dropped |= dict.fromkeys(_set_kind(table, target, value))
        else:
            _set_key(table, target, value)
    for path in dropped:
        table.get("tolerance", {}).pop(path, None)
    return tuple(dropped)


def _owners_at(table: dict[str, Any], target: ValuePath) -> tuple[str, str, list[dict[str, Any]]]:
    """Find the section of the tables that have the key of a path, the key there, the tables."""
    tables, (*own, key) = _tables_at(table, target), target.key.split(".")
    for name in own:
        tables = [part for part in tables if name in part or key == "kind"]
        for part in tables:  # those of a row that was split share it
            part[name] = {**part.get(name, {})}
        tables = [part[name] for part in tables]
    return [target.section, *own][-1], key, tables


def _tables_at(table: dict[str, Any], target: ValuePath) -> list[dict[str, Any]]:
    """Find the tables that a path means; a single notch is first split from its group."""
    tables = table.setdefault(target.section, {})
    if isinstance(tables, dict):
        return [tables]
    if target.number is None:
        return tables
    repeats = [part.get("repeat", 1) for part in tables]
    target.check_number(sum(repeats))
    group, before = group_of(target.number, repeats)
    if repeats[group] > 1:
        row = tables[group]
        kind = cast("type[Notch]", class_of("notch", row))  # nothing else is repeated
        pieces = ((0, before), (before, 1), (before + 1, repeats[group] - before - 1))
        tables[group : group + 1] = [
            kind.further_on(row, start) | {"repeat": count} for start, count in pieces if count
        ]
        group += 1 if before else 0
    return [tables[group]]


def _set_key(table: dict[str, Any], target: ValuePath, value: object) -> None:
    """Set a key wherever the kind of part has it."""
    if (target.section, target.key) == ("notch", "repeat"):
        raise InputError.UNSUPPORTED(
            f"`{target.path}` would change the number of notches; change `repeat` in the robot "
            "file instead."
        )
    allowed: dict[str, None] = {}
    section, key, parts = _owners_at(table, target)
    if not parts and "." in target.key:
        raise InputError.UNKNOWN_NAME(
            f"`{target.path}`: no {target.section} that is meant has a {section} of its own; give "
            f"it a table [{target.section}.{section}] in the robot file, or set {section}.{key}."
        )
    for part in parts:
        keys = fields_of(class_of(section, part))
        allowed |= dict.fromkeys(keys)
        if key in keys:
            part[key] = value
    if key not in allowed:
        allowed = allowed or dict.fromkeys(fields_of(SECTIONS[section]))
        raise InputError.UNKNOWN_NAME(unknown_key(target.path, key, allowed))


def _set_kind(table: dict[str, Any], target: ValuePath, value: object) -> Iterator[str]:
    """Replace a kind: keep the keys that both kinds share, and yield the paths of the others."""
    section, _, parts = _owners_at(table, target)
    base = SECTIONS[section]
    if "kind" not in fields_of(base):
        raise InputError.UNKNOWN_NAME(unknown_key(target.path, "kind", fields_of(base)))
    kinds = kinds_of(base)
    if value not in kinds:
        allowed = ", ".join(f'"{kind}"' for kind in kinds)
        raise InputError.UNKNOWN_NAME(
            f'`{target.path}` is "{value}"; allowed: {allowed}{nearest(str(value), kinds)}.'
        )
    for part in parts:
        for key in [key for key in part if key not in fields_of(kinds[str(value)])]:
            yield target.path.removesuffix("kind") + key
            del part[key]
        part["kind"] = value


def parse_assignment(text: str) -> tuple[str, object]:
    """Read `PATH=VALUE` of the command line; the value is a number, or else text.

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
    for read in (int, float, lambda word: tomllib.loads(f"x = {word}")["x"]):
        try:
            return read(text)
        except (ValueError, RecursionError):
            continue
    return text


# Reading values of a robot by their names: number, unit and limits.


class Described(NamedTuple):
    """A number of a robot: its unit ("" for none) and its limits."""

    unit: str
    lower: float
    upper: float


def _owners(robot: "Robot", path: str) -> tuple[str, list[Any]]:
    """Return the key of a path, and those that have it of the parts that the path means."""
    target = parse_path(path)
    of_list = robot.notches if target.section == "notch" else robot.drive
    target.check_number(len(robot.tendon if target.section == "tendon" else of_list))
    parts = [named.part for named in named_parts(robot) if named.is_meant(target)]
    owners = [part for part in parts if target.key in fields_in(part)]
    if not owners:
        allowed = dict.fromkeys(name for part in parts for name in fields_in(part))
        raise InputError.UNKNOWN_NAME(
            f"`{path}` is not the name of a number of this robot{nearest(target.key, allowed)}; "
            f"{EXAMPLES}."
        )
    return target.key, owners


def number_at(robot: "Robot", path: str) -> float:
    """Return a number of a robot by its name (see `Robot.with_value`), in the units of its file."""
    key, owners = _owners(robot, path)
    numbers = set(map(attrgetter(key), owners))
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


def numbers_at(robot: "Robot", path: str) -> dict[str, float]:
    """Return every number that a path refers to, each by its own name.

    Example:
        >>> from notchflex.robot import load_robot
        >>> numbers_at(load_robot("pacheco2021-c"), "notch.depth")["notch[2].depth"]
        1.39
    """
    target = parse_path(path)
    numbers: dict[str, float] = {}
    counts = {"notch": robot.number_of_notches, "tendon": robot.number_of_tendons}
    for number in range(counts.get(target.section, 0) if target.number is None else 0):
        name = f"{target.section}[{number + 1}].{target.key}"
        with suppress(InputError):  # a notch of another kind
            numbers[name] = number_at(robot, name)
    return numbers or {path: number_at(robot, path)}


def described_at(robot: "Robot", path: str) -> Described:
    """Return unit and limits of a number of a robot by its name."""
    key, owners = _owners(robot, path)
    field = fields_in(owners[0])[key]
    below = (getattr(rule, name, -math.inf) for rule in field.metadata for name in ("gt", "ge"))
    above = (getattr(rule, name, math.inf) for rule in field.metadata for name in ("lt", "le"))
    return Described(unit_of(field), max(below, default=-math.inf), min(above, default=math.inf))
