"""The numbers of a robot, apart from all that decides the form of its arrays."""

from __future__ import annotations

import dataclasses
import functools
import itertools
import math
import operator
from collections.abc import Callable, Collection, Sequence
from typing import Any

import numpy as np
from jaxtyping import Float

from notchflex.robot.part import own_parts, unchecked
from notchflex.robot.robot import Robot
from notchflex.robot.value_names import PLURAL, SECTIONS, NamedPart, named_parts, parse_path

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
            for key, value in _values(part):
                is_number = type(value) is float and math.isfinite(value)
                # Directions decide which notches and tendons share a plane.
                is_number = is_number and key != "direction_deg"
                if is_number and (value != 0.0 or (number, key) in varied):
                    places.append((number, key))
                elif value is not None:
                    words[key] = value
            content.append((type(part).__name__, words))
        return cls(repr((content, places)), (*parts,), places)

    @functools.cached_property  # for each robot of a batch
    def _getters(self) -> list[tuple[int, Callable[[Any], Any]]]:
        return [(number, operator.attrgetter(key)) for number, key in self.places]

    def numbers_of(self, parts: Sequence[Any]) -> Float[np.ndarray, " numbers"]:
        """Return the numbers of parts of this form."""
        return np.array([number_of(parts[place]) for place, number_of in self._getters])

    def with_numbers(self, numbers: Any) -> tuple[Any, ...]:
        """Return parts with other numbers, which nothing checks: plain or traced ones."""
        changed: list[dict[str, Any]] = [{} for _ in self.parts]
        for (number, key), value in zip(self.places, numbers, strict=True):
            name, _, inner = key.partition(".")
            if inner:
                own = changed[number].get(name, getattr(self.parts[number], name))
                value = unchecked(own, **{inner: value})
            changed[number][name] = value
        pairs = zip(self.parts, changed, strict=True)
        return tuple(unchecked(part, **values) for part, values in pairs)


@functools.cache  # asked for each robot of a batch
def _keys(cls: type) -> tuple[tuple[str, bool], ...]:
    """Return the keys of a part, and whether each may hold a part of its own."""
    return tuple((field.name, field.name in own_parts(cls)) for field in dataclasses.fields(cls))


def _values(part: Any) -> list[tuple[str, Any]]:
    """Return the values of a part by their keys, and behind its own parts theirs."""
    values: list[tuple[str, Any]] = []
    for key, may_be_part in _keys(type(part)):
        value = getattr(part, key)
        if may_be_part and value is not None:
            values.append((key, type(value)))
            values += [(f"{key}.{inner}", each) for inner, each in _values(value)]
        else:
            values.append((key, value))
    return values


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
        same, listed = tuple(part for part in parts if isinstance(part, base)), section in PLURAL
        values[section] = same if listed else next(iter(same), None)
    vars(robot).update(values)
    return robot


def places_by_name(robot: Robot, names: Sequence[str]) -> tuple[Robot, list[list[Place]]]:
    """Return where named values stand in a robot, with its notches apart where a name is of one."""
    if not names:
        return robot, []  # most robots of a batch, which are listed one by one
    targets = [parse_path(name) for name in names]
    single = any(target.section == "notch" and target.number is not None for target in targets)
    if single and len(robot.notch) < robot.number_of_notches:
        robot = robot.replace(notch=robot.notches)
    parts = list(enumerate(_parts_of_arrays(robot)))
    places = [
        [(number, target.key) for number, named in parts if named.is_meant(target)]
        for target in targets
    ]
    of_one = [target.number is not None for target in targets]
    taken = {place for of_target in itertools.compress(places, of_one) for place in of_target}
    return robot, [
        [place for place in of_target if alone or place not in taken]
        for of_target, alone in zip(places, of_one, strict=True)
    ]


def differing(parts: Sequence[Any], others: Sequence[Any]) -> list[Place] | None:
    """Return the places where two robots have other numbers; None where more differs."""
    places = list[Place]()
    if list(map(type, parts)) != list(map(type, others)):
        return None
    for number, (part, other) in enumerate(zip(parts, others, strict=True)):
        values = dict(_values(other))
        places += [(number, key) for key, value in _values(part) if value != values.get(key)]
    return places if set(places) <= set(PartsForm.of(parts, places).places) else None
