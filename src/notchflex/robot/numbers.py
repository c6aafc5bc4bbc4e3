"""The numbers of a robot, apart from all that decides the form of its arrays."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Collection, Iterable, Sequence
from typing import Any

import numpy as np
from jaxtyping import Float

from notchflex.robot.part import unchecked
from notchflex.robot.robot import Robot
from notchflex.robot.value_names import (
    SECTIONS,
    NamedPart,
    named_parts,
    parse_path,
)

Place = tuple[int, str]
"""Where a number stands: its part, counted from 0, and its key."""


@dataclasses.dataclass(frozen=True)
class PartsForm:
    """Parts of robots without their numbers: kinds, words, counts, directions, and what is 0.

    Attributes:
        content: All that is no number, as text; forms are equal where it is.
        parts: Parts of this form.
        places: Places of all numbers, in the order of the parts and their keys.
    """

    content: str
    parts: tuple[Any, ...] = dataclasses.field(compare=False, repr=False)
    places: list[Place] = dataclasses.field(compare=False, repr=False)

    @classmethod
    def of(cls, parts: Sequence[Any], varied: Collection[Place] = ()) -> PartsForm:
        """Return the form of parts; places that are varied have numbers even if these are 0."""
        content, places = list[Any](), list[Place]()
        for number, part in enumerate(parts):
            words = dict[str, Any]()
            for key in (field.name for field in dataclasses.fields(part)):
                value, place = getattr(part, key), (number, key)
                # Directions decide which notches and tendons share a plane.
                varies = (value != 0.0 or place in varied) and key != "direction_deg"
                if is_number(value) and varies:
                    places.append(place)
                else:
                    words[key] = value
            content.append((type(part).__name__, words))
        return cls(repr((content, places)), (*parts,), places)

    def numbers_of(self, parts: Sequence[Any]) -> Float[np.ndarray, " numbers"]:
        """Return the numbers of parts of this form."""
        return np.array([getattr(parts[number], key) for number, key in self.places])

    def matched(
        self, parts: Sequence[Any], varied: Collection[Place]
    ) -> Float[np.ndarray, " numbers"] | None:
        """Return the numbers of parts of as many and the same kinds; None where the form differs.

        Args:
            parts: The parts.
            varied: Places that must have numbers; others that are 0 are of another form.
        """
        if not set(varied) <= set(self.places):
            return None
        numbers = np.empty(len(self.places))
        for number, (keys, part, other) in enumerate(
            zip(self._keys, self.parts, parts, strict=True)
        ):
            for key, column in keys:
                value = getattr(other, key)
                if column is None:
                    if value != getattr(part, key):
                        return None
                elif type(value) is float and (value != 0.0 or (number, key) in varied):
                    numbers[column] = value
                else:
                    return None
        return numbers if np.isfinite(numbers).all() else None

    @cached_property
    def _keys(self) -> list[list[tuple[str, int | None]]]:
        """Of each part the keys, and which number each is; None for what is no number."""
        columns = {place: column for column, place in enumerate(self.places)}
        return [
            [(field.name, columns.get((number, field.name))) for field in dataclasses.fields(part)]
            for number, part in enumerate(self.parts)
        ]

    def with_numbers(self, numbers: Any) -> tuple[Any, ...]:
        """Return parts with other numbers, which nothing checks: plain or traced ones."""
        changed: list[dict[str, Any]] = [{} for _ in self.parts]
        for (number, key), value in zip(self.places, numbers, strict=True):
            changed[number][key] = value
        pairs = zip(self.parts, changed, strict=True)
        return tuple(unchecked(part, **values) for part, values in pairs)


def parts_of(robot: Robot) -> tuple[Any, ...]:
    """Return the parts of a robot that its arrays are made of."""
    return tuple(named.part for named in _parts_of_arrays(robot))


def _parts_of_arrays(robot: Robot) -> list[NamedPart]:
    """List those parts, single ones first: notches have the numbers that come after these."""
    named = sorted(named_parts(robot), key=lambda each: each.first > 0)
    return [each for each in named if each.section != "drawing"]


def robot_of(parts: Sequence[Any]) -> Robot:
    """Return a robot of parts, as `parts_of` returns them; nothing checks it."""
    robot = object.__new__(Robot)
    values: dict[str, Any] = dict.fromkeys(field.name for field in dataclasses.fields(Robot))
    for section, base in SECTIONS.items():
        same = tuple(part for part in parts if isinstance(part, base))
        values[section] = same if section in ("notch", "tendon") else next(iter(same), None)
    vars(robot).update(values)
    return robot


def places_of(robot: Robot, name: str) -> list[Place]:
    """Return where a value stands among the parts of a robot.

    Args:
        robot: The robot; a notch that is named alone is not repeated.
        name: Such as `notch[2].depth`; see `Robot.with_value`. Several notches or tendons may have
            the value, where the name means them all.
    """
    return _places_of(tuple(notch.repeat for notch in robot.notch), len(robot.tendon), name)


def _places_of(repeats: tuple[int, ...], tendons: int, name: str) -> list[Place]:
    path = parse_path(name)
    first = {"tube": 0, "material": 1, "friction": 2, "notch": 3, "tendon": 3 + len(repeats)}
    if path.section not in first:  # no part of the arrays
        return []
    counts = {"notch": repeats, "tendon": (1,) * tendons}.get(path.section, (1,))
    numbers = range(len(counts))
    if path.number is not None:
        numbers = [int(np.searchsorted(np.cumsum(counts), path.number))]
    return [(first[path.section] + number, path.key) for number in numbers]


def places_by_name(robot: Robot, names: Sequence[str]) -> tuple[Robot, list[list[Place]]]:
    """Return the places of values by their names; a number of one notch is not that of all.

    Args:
        robot: The robot.
        names: As for `places_of`; what has a name of its own does not belong to others.

    Returns:
        The robot, with notches of their own where a name is of one, and the places in it.
    """
    robot = apart(robot, names)
    repeats = tuple(notch.repeat for notch in robot.notch)
    parts = parts_of(robot)
    return robot, [  # parts of some kinds have no such number
        [(part, key) for part, key in own if hasattr(parts[part], key)]
        for own in _places(repeats, len(robot.tendon), tuple(names))
    ]


@lru_cache(maxsize=64)
def _places(repeats: tuple[int, ...], tendons: int, names: tuple[str, ...]) -> list[list[Place]]:
    places = {name: _places_of(repeats, tendons, name) for name in names}
    taken = {place for name in filter(is_of_one, names) for place in places[name]}
    return [
        [place for place in places[name] if is_of_one(name) or place not in taken] for name in names
    ]


def is_of_one(name: str) -> bool:
    """Return whether a number is of one notch or tendon."""
    return parse_path(name).number is not None


def differing(parts: Sequence[Any], others: Sequence[Any]) -> list[Place] | None:
    """Return the places where two robots have other numbers; None where more differs."""
    places = list[Place]()
    if list(map(type, parts)) != list(map(type, others)):
        return None
    for number, (part, other) in enumerate(zip(parts, others, strict=True)):
        if part is other:
            continue
        for key in (field.name for field in dataclasses.fields(part)):
            values = getattr(part, key), getattr(other, key)
            if values[0] == values[1]:
                continue
            if key == "direction_deg" or not all(map(is_number, values)):
                return None
            places.append((number, key))
    return places


def is_number(value: Any) -> bool:
    """Return whether a value is a number that programs take, if it is no direction."""
    return type(value) is float and math.isfinite(value)


def apart(robot: Robot, names: Iterable[str]) -> Robot:
    """Return the robot with notches of their own if any name is of one, as `notch[2].depth` is."""
    targets = map(parse_path, names)
    single = any(target.section == "notch" and target.number for target in targets)
    is_repeated = len(robot.notch) < robot.number_of_notches
    return robot.replace(notch=robot.notches) if single and is_repeated else robot
