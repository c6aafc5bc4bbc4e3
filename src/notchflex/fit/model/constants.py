"""The constants that a fit may change: their names, limits, and where a search for them starts."""

from __future__ import annotations

import math
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from notchflex.errors import InputError
from notchflex.fit.model.rows import SENSOR
from notchflex.robot import Robot
from notchflex.robot.value_names import described_at, number_at

_EACH_NOTCH = "[each]"
_EACH_ROBOT = "each:"

# Where a search looks for what the user gives no limits for: lengths are known to a tolerance,
# angles to some degrees, friction lies between none and its load, all else within a factor.
_TOLERANCE, _TURN, _FACTOR = 0.2, 10.0, 4.0


@dataclass(frozen=True)
class Constant:
    """A number to be found.

    Args:
        name: A value of the robot file (`material.elastic_modulus`, `notch[2].depth`), shared by
            all robots of the fit; with a robot's label before it (`A:friction.coefficient`) of one
            robot; with `each:` one for every robot; with `notch[each].` one for every notch. Of the
            measurement: `sensor.force_offset` (what the gauge shows at no force, N) and
            `sensor.stroke_slack` (stroke that only takes up slack, mm).
        lower: Least value allowed, in the unit of the robot file; what a robot allows where not
            given.
        upper: Greatest value allowed.
        prior: Mean and standard deviation of what is known beforehand.

    Raises:
        InputError: The limits are in the wrong order, or the prior has no width.

    Example:
        >>> Constant("friction.coefficient", lower=0.0, upper=0.5).upper
        0.5
    """

    name: str
    lower: float | None = None
    upper: float | None = None
    prior: tuple[float, float] | None = None

    def __post_init__(self) -> None:
        """Check the numbers."""
        if not isinstance(self.name, str) or not self.name.strip():  # pyright: ignore
            raise InputError.WRONG_TYPE(f"a constant needs the name of a value; got {self.name!r}")
        for limit in (self.lower, self.upper):
            if limit is not None and not _is_finite(limit):
                raise InputError.NOT_FINITE(f"`{self.name}`: limits must be finite; got {limit}")
        if None not in (self.lower, self.upper) and not self.lower < self.upper:  # pyright: ignore
            raise InputError.OUT_OF_RANGE(
                f"`{self.name}`: the lower limit must be below the upper one; got {self.lower:g} "
                f"and {self.upper:g}"
            )
        if self.prior is not None:
            pair = np.atleast_1d(np.asarray(self.prior, object))
            if len(pair) != 2 or not all(map(_is_finite, pair)) or not pair[1] > 0.0:
                raise InputError.OUT_OF_RANGE(
                    f"`{self.name}`: a prior is a mean and a standard deviation above 0; "
                    f"got {' and '.join(map(str, pair))}"
                )


@dataclass(frozen=True)
class Unknown:
    """A constant of a fit, and the robots' numbers that it sets.

    Attributes:
        name: As told to the user.
        unit: Unit of its value, "" for a pure number.
        sets: Labels of robots and the names of their numbers.
        lower: Least value, -inf where there is none.
        upper: Greatest value.
        start: Its value in the robots as they are.
        first: Least value that a search starts from.
        last: Greatest value that a search starts from.
        prior: Mean and standard deviation, or None.
    """

    name: str
    unit: str
    sets: tuple[tuple[str, str], ...]
    lower: float
    upper: float
    start: float
    first: float
    last: float
    prior: tuple[float, float] | None = None

    @property
    def scale(self) -> float:
        """A size that its changes are compared with."""
        return self.last - self.first

    def among(self, labels: Collection[str]) -> Unknown:
        """The same constant of only some of the robots.

        Raises:
            InputError: None of them has it.
        """
        own = tuple(place for place in self.sets if place[0] in labels)
        if not own:
            raise InputError.TOO_FEW_DATA(
                f"`{self.name}` belongs to {self.sets[0][0]} alone; without it there is nothing "
                "to find it from"
            )
        return replace(self, sets=own)

    def shared_with(self, label: str) -> Unknown:
        """The same constant for a robot that was not in the fit; one of other robots sets none."""
        own = tuple(place for place in self.sets if place[0] == label)
        if not own and ":" not in self.name:
            own = ((label, self.sets[0][1]),)
        return replace(self, sets=own)


def unknowns(
    robots: Mapping[str, Robot], fit: Sequence[str | Constant] | str
) -> tuple[Unknown, ...]:
    """The constants of a fit.

    Args:
        robots: The robots by label.
        fit: Names or constants.

    Raises:
        InputError: A name is none, is given twice, or belongs to no robot.
    """
    if "each" in robots:
        raise InputError.CONFLICT(
            "no robot can be called each: `each:` stands for every robot of the fit"
        )
    given = (fit,) if isinstance(fit, str | Constant) else tuple(fit)
    if not given:
        raise InputError.NO_DATA("fit names no constant; name one, such as friction.coefficient")
    found: list[Unknown] = []
    for one in given:
        found += _expanded(robots, one if isinstance(one, Constant) else Constant(one))
    taken: dict[tuple[str, str], str] = {}
    for one in found:
        for place in one.sets:
            if place in taken:
                raise InputError.CONFLICT(
                    f"`{place[1]}` of {place[0]} is set by `{taken[place]}` and by `{one.name}`; "
                    "fit it once"
                )
            taken[place] = one.name
    return tuple(found)


def _expanded(robots: Mapping[str, Robot], constant: Constant) -> list[Unknown]:
    """One constant as written, or the several that it stands for."""
    name = constant.name.strip()
    label, colon, path = name.partition(":")
    if not colon:
        label, path = "", name
    if name.startswith(_EACH_ROBOT):
        own = (replace(constant, name=f"{one}:{path}") for one in robots)
        return [unknown for one in own for unknown in _expanded(robots, one)]
    if label and label not in robots:
        raise InputError.UNKNOWN_NAME(
            f"`{name}`: no robot of this fit is called {label}; there are {', '.join(robots)}"
        )
    if _EACH_NOTCH in path:
        if not label and len(robots) > 1:
            return _expanded(robots, replace(constant, name=_EACH_ROBOT + path))
        one = robots[label or next(iter(robots))]
        before = f"{label}:" if label else ""
        notches = range(1, one.number_of_notches + 1)
        paths = (path.replace(_EACH_NOTCH, f"[{notch}]") for notch in notches)
        own = (replace(constant, name=before + each) for each in paths)
        return [unknown for one in own for unknown in _expanded(robots, one)]
    return [_unknown({label: robots[label]} if label else robots, path, constant)]


def _unknown(robots: Mapping[str, Robot], path: str, constant: Constant) -> Unknown:
    lower, upper = -math.inf, math.inf
    if path in SENSOR:
        unit, start = ("N", 0.0) if path == SENSOR[0] else ("mm", 0.0)
        first, last = (-0.1, 0.1) if path == SENSOR[0] else (0.0, 0.5)
        lower = lower if path == SENSOR[0] else 0.0
    else:
        start = math.fsum(number_at(robot, path) for robot in robots.values()) / len(robots)
        number = described_at(next(iter(robots.values())), path)
        unit, lower, upper = number.unit, number.lower, number.upper
        first, last = _range(path, unit, start)
    lower = lower if constant.lower is None else constant.lower
    upper = upper if constant.upper is None else constant.upper
    first = max(first, lower) if constant.lower is None else lower
    last = min(last, upper) if constant.upper is None else upper
    if not first < last:  # a limit on the far side of where a search would look
        first, last = max(lower, first - 1.0), min(upper, first + 1.0)
    start = min(max(start, lower), upper)
    sets = tuple((label, path) for label in robots)
    name = constant.name.strip()
    return Unknown(name, unit, sets, lower, upper, start, first, last, constant.prior)


def _is_finite(value: object) -> bool:
    return isinstance(value, int | float | np.number) and math.isfinite(value)


def _range(path: str, unit: str, value: float) -> tuple[float, float]:
    """Where a search starts from, around a present value."""
    if path.startswith("friction."):
        return 0.0, max(0.5, 2.0 * value)
    if unit == "deg":
        return value - _TURN, value + _TURN
    if value == 0.0:
        raise InputError.MISSING_VALUE(
            f"`{path}` is 0 in this robot, which tells nothing of its size; give limits to search "
            "between"
        )
    if unit == "mm":
        return value - _TOLERANCE * abs(value), value + _TOLERANCE * abs(value)
    ends = (value / _FACTOR, value * _FACTOR)
    return min(ends), max(ends)


__all__ = ["Constant", "Unknown", "unknowns"]
