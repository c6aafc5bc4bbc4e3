"""The numbers of a robot, apart from all that decides the form of its arrays."""

from __future__ import annotations

import dataclasses
import itertools
import math
import re
from collections.abc import Collection, Iterable, Iterator, Mapping, Sequence
from functools import cached_property, lru_cache
from typing import Any, overload

import numpy as np
from jaxtyping import Bool, Float, Int
from numpy.typing import ArrayLike

from notchflex.errors import InputError
from notchflex.robot.part import unchecked
from notchflex.robot.robot import Robot
from notchflex.robot.value_names import (
    SECTIONS,
    NamedPart,
    named_parts,
    number_at,
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
                if type(value) is float and math.isfinite(value) and varies:
                    places.append(place)
                else:
                    words[key] = value
            content.append((type(part).__name__, words))
        return cls(repr((content, places)), (*parts,), places)

    def numbers_of(self, parts: Sequence[Any]) -> Float[np.ndarray, " numbers"]:
        """Return the numbers of parts of this form."""
        return np.array([getattr(parts[number], key) for number, key in self.places])

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
    return [named for named in named_parts(robot) if named.section != "drawing"]


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
    """Return where the values of a name stand among the parts of a robot."""
    target = parse_path(name)
    parts = enumerate(_parts_of_arrays(robot))
    return [(number, target.key) for number, named in parts if named.is_meant(target)]


def differing(parts: Sequence[Any], others: Sequence[Any]) -> list[Place] | None:
    """Return the places where two robots have other numbers; None where more differs."""
    places = list[Place]()
    if list(map(type, parts)) != list(map(type, others)):
        return None
    for number, (part, other) in enumerate(zip(parts, others, strict=True)):
        keys = (field.name for field in dataclasses.fields(part))
        places += [(number, key) for key in keys if getattr(part, key) != getattr(other, key)]
    return places if set(places) <= set(PartsForm.of(parts, places).places) else None


def apart(robot: Robot, names: Iterable[str]) -> Robot:
    """Return the robot with notches of their own if any name is of one, as `notch[2].depth` is."""
    targets = map(parse_path, names)
    single = any(target.section == "notch" and target.number for target in targets)
    is_repeated = len(robot.notch) < robot.number_of_notches
    return robot.replace(notch=robot.notches) if single and is_repeated else robot


# Many robots that differ from one by a few numbers, held as arrays of these numbers.

_OF_NOTCH = re.compile(r"notch\[(\d+)\]")
_MAX_CORNERS = 1024


class VariedRobots(Sequence[Robot]):
    """Robots made of one robot and numbers of its own for each: a robot is made when asked for.

    Batches take the numbers as arrays and make no robot for each row; results are equal to those
    of the single robots to rounding.

    Example:
        >>> from notchflex.robot import load_robot
        >>> several = VariedRobots(load_robot("pacheco2021-a"), {"notch.depth": [1.39, 1.41]})
        >>> len(several), several[1].notch[0].depth
        (2, 1.41)
    """

    def __init__(
        self,
        robot: Robot,
        values: Mapping[str, ArrayLike],
        ranges: Mapping[str, tuple[float, float]] | None = None,
    ) -> None:
        """Hold a robot and, by name, the numbers of every robot.

        Args:
            robot: The robot that the others are made of.
            values: Numbers by name (see `Robot.with_value`), equally many for each name.
            ranges: By name, between what the numbers of these robots and of others that follow
                lie: what is prepared for these then serves for those. None where none follow.

        Raises:
            InputError: There is no such number, or there are not equally many for each name.
        """
        self.robot, self.ranges = robot, ranges
        self.values: dict[str, Float[np.ndarray, " robots"]] = {
            name: np.asarray(each, float) for name, each in values.items()
        }
        for name in self.values:
            number_at(robot, name)
        if len({each.shape for each in self.values.values()}) != 1 or self.table.ndim != 2:
            raise InputError.WRONG_SHAPE(
                "varied robots need one number for each robot of every name, equally many."
            )

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the numbers."""
        return tuple(self.values)

    @property
    def table(self) -> Float[np.ndarray, "robots d"]:
        """The numbers, names as columns."""
        return np.stack(list(self.values.values()), axis=-1)

    @property
    def box(self) -> tuple[Float[np.ndarray, " d"], Float[np.ndarray, " d"]]:
        """Lower and upper ends of the numbers, or of their ranges if all lie inside."""
        low, high = self.table.min(axis=0), self.table.max(axis=0)
        if self.ranges is None:
            return low, high
        ends = np.array([self.ranges[name] for name in self.values]).T
        inside = (ends[0] <= low).all() and (high <= ends[1]).all()
        return (ends[0], ends[1]) if inside else (low, high)

    @property
    def notch_of(self) -> list[int | None]:
        """For each name the notch that it is about, from 1; None for what is not of one notch."""
        matches = [_OF_NOTCH.match(name) for name in self.values]
        return [None if one is None else int(one[1]) for one in matches]

    def __len__(self) -> int:
        """Return the number of robots."""
        return len(next(iter(self.values.values())))

    @overload
    def __getitem__(self, index: int) -> Robot: ...
    @overload
    def __getitem__(self, index: slice) -> VariedRobots: ...
    def __getitem__(self, index: int | slice) -> Robot | VariedRobots:
        """Make one of the robots, or take some of them.

        Raises:
            InputError: The numbers make no valid robot.
        """
        if isinstance(index, slice):
            return self.take(np.arange(len(self))[index])
        return self.at({name: each[index] for name, each in self.values.items()})

    def take(self, rows: Int[np.ndarray, " k"] | Bool[np.ndarray, " robots"]) -> VariedRobots:
        """Take some of the robots, by number from 0 or by a mask."""
        values = {name: each[rows] for name, each in self.values.items()}
        taken = VariedRobots(self.robot, values, self.ranges)
        if "_valid" in vars(self):
            vars(taken)["_valid"] = self._valid[rows]
        return taken

    def at(self, numbers: Mapping[str, float]) -> Robot:
        """Make the robot with other numbers."""
        return self.robot.with_values({name: float(one) for name, one in numbers.items()})

    def valid(self) -> Bool[np.ndarray, " robots"]:
        """Tell which numbers make a valid robot.

        Rules tie a number to its limits, to the tube, a tendon or another number of the same notch,
        each of them monotonic: if all corners of the ranges are valid, so is all between them.
        """
        return self._valid

    @cached_property
    def _valid(self) -> Bool[np.ndarray, " robots"]:
        if not self.values:
            return np.ones(len(self), bool)
        if np.isfinite(self.table).all():
            boxes = (self.box, (self.table.min(axis=0), self.table.max(axis=0)))
            for low, high in boxes:
                key = tuple(map(tuple, self.cliques())), tuple(low.tolist()), tuple(high.tolist())
                if _corners_are_valid(self.robot, self.names, *key):
                    return np.ones(len(self), bool)
        return np.array([_is_valid(self.robot, self.names, row) for row in self.table])

    def cliques(self) -> Iterator[list[int]]:
        """Yield places of numbers that belong together: of one notch, and of none in particular."""
        of, positions = self.notch_of, range(len(self.values))
        for notch in dict.fromkeys(one for one in of if one is not None) or {None: None}:
            yield [position for position in positions if of[position] in (None, notch)]


@lru_cache(maxsize=16)
def _corners_are_valid(
    robot: Robot,
    names: tuple[str, ...],
    cliques: tuple[tuple[int, ...], ...],
    low: tuple[float, ...],
    high: tuple[float, ...],
) -> bool:
    """Tell whether all corners of ranges make a valid robot; False for too many corners."""
    ends = np.array([low, high])
    middle = 0.5 * (ends[0] + ends[1])
    for clique in cliques:
        if 2 ** len(clique) > _MAX_CORNERS:
            return False
        for corner in itertools.product(*ends[:, list(clique)].T):
            numbers = middle.copy()
            numbers[list(clique)] = corner
            if not _is_valid(robot, names, numbers):
                return False
    return True


def _is_valid(robot: Robot, names: tuple[str, ...], numbers: Float[np.ndarray, " d"]) -> bool:
    try:
        robot.with_values(dict(zip(names, numbers.tolist(), strict=True)))
    except InputError:
        return False
    return True
