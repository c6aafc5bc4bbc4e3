"""The constants that a fit may change, and the numbers of the drawing that may deviate."""

from __future__ import annotations

import math
from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from notchflex import InputError, Robot
from notchflex.support import described_at, number_at, numbers_at


@dataclass(frozen=True)
class Constant:
    """A constant to be fitted.

    Args:
        name: A value of the robot file (`material.elastic_modulus`, `notch[2].depth`), shared by
            all robots of the fit; with a label before it (`A:friction.coefficient`) of one robot;
            with `each:` one for every robot; with `notch[each].` one for every notch. One constant
            for unlike values: `offset:notch.depth` is added to each of them, `factor:notch.height`
            multiplies each of them, and `notch.precurvature_deg/height` is their ratio to another
            value of the same part. Of the measurement: `sensor.force_offset` (what the gauge shows
            at no force, N), `sensor.force_factor` (the tension that acts is this times the reading
            less the offset) and `sensor.stroke_slack` (stroke that only takes up slack, mm).
        lower: Least value allowed, in the unit of the robot file; by default that of the robot.
        upper: Greatest value allowed, likewise.
        prior: Mean and standard deviation of prior knowledge.

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


def _is_finite(value: object) -> bool:
    return isinstance(value, int | float | np.number) and math.isfinite(value)


_EACH_NOTCH = "[each]"
_EACH_ROBOT = "each"
_OFFSET, _TIMES = "offset", "factor"

# Where a search looks without limits of the user: lengths vary by a tolerance, angles by some
# degrees, all else by a factor.
_TOLERANCE, _TURN, _FACTOR = 0.2, 10.0, 4.0
# Unit, least value, value without it, and where a search looks, of numbers of the measurement.
_SENSOR = {
    "sensor.force_offset": ("N", -math.inf, 0.0, -0.1, 0.1),
    "sensor.force_factor": ("", 1e-3, 1.0, 0.5, 2.0),
    "sensor.stroke_slack": ("mm", 0.0, 0.0, 0.0, 0.5),
}


class RobotNumber(NamedTuple):
    """A number of the robot of a label that a constant sets: `base` + `slope` * its value."""

    label: str
    path: str
    base: float = 0.0
    slope: float = 1.0


@dataclass(frozen=True)
class Unknown:
    """A constant of a fit, and the robots' numbers that it sets.

    Attributes:
        name: Name that is shown.
        unit: Unit of its value, "" for a pure number.
        sets: The numbers that it sets.
        lower: Least value, -inf if there is none.
        upper: Greatest value.
        start: Its value in the robots as they are.
        first: Least value that a search starts from.
        last: Greatest value that a search starts from.
        prior: Mean and standard deviation, or None.
        path: Its name without the label of a robot.
        each: Whether every robot of the fit has one of its own.
    """

    name: str
    unit: str
    sets: tuple[RobotNumber, ...]
    lower: float
    upper: float
    start: float
    first: float
    last: float
    prior: tuple[float, float] | None = None
    path: str = ""
    each: bool = False

    @property
    def scale(self) -> float:
        """A typical size of its changes."""
        return self.last - self.first

    @property
    def shared(self) -> bool:
        """Whether all robots of the fit have it in common."""
        return self.name == self.path

    def among(self, labels: Collection[str]) -> Unknown | None:
        """Return the same constant of some of the robots.

        None if it belongs to another robot, and what is known of it without that one's data is a
        prior, or the values of robots that each have one.

        Raises:
            InputError: None of them has it, and nothing else is known of it.
        """
        sets = tuple(one for one in self.sets if one.label in labels)
        if sets:
            return replace(self, sets=sets)
        if self.prior is None and not (self.each and len(labels) > 1):
            raise InputError.TOO_FEW_DATA(
                f"`{self.name}` belongs to {self.sets[0].label} alone; without it there is nothing "
                f"to find it from. Give a prior (--prior), or measure more robots"
            )
        return None

    def of(self, label: str, robot: Robot) -> Unknown:
        """Return the same constant of a robot outside the fit; one of other robots sets nothing."""
        sets = tuple(one for one in self.sets if one.label == label)
        if not sets and self.shared:
            sets = _numbers(label, robot, self.path)
        return replace(self, sets=sets)


def unknowns(
    robots: Mapping[str, Robot], fit: Sequence[str | Constant] | str
) -> tuple[Unknown, ...]:
    """Return the constants of a fit of robots by label.

    Raises:
        InputError: A name is unknown, is given twice, or belongs to no robot.
    """
    for word in {_EACH_ROBOT, _OFFSET, _TIMES} & set(robots):
        raise InputError.CONFLICT(
            f"no robot can be called {word}: `{word}:` has a meaning in names of constants"
        )
    constants = (fit,) if isinstance(fit, str | Constant) else tuple(fit)
    if not constants:
        raise InputError.NO_DATA("fit names no constant; name one, such as friction.coefficient")
    every: list[Unknown] = []
    set_by: dict[tuple[str, str], str] = {}
    for constant in constants:
        constant = constant if isinstance(constant, Constant) else Constant(constant)
        for label, path, each in _expanded(robots, constant.name.strip()):
            name = f"{label}:{path}" if label else path
            owners = {label: robots[label]} if label else robots
            every.append(_unknown(owners, path, replace(constant, name=name), each))
            for one in every[-1].sets:
                if one[:2] in set_by:
                    raise InputError.CONFLICT(
                        f"`{one.path}` of {one.label} is set by `{set_by[one[:2]]}` and by "
                        f"`{name}`; fit it once"
                    )
                set_by[one[:2]] = name
    return tuple(every)


def _expanded(robots: Mapping[str, Robot], name: str) -> Iterator[tuple[str, str, bool]]:
    """Yield label ("" is all robots), number, and whether it is one of each robot."""
    before, colon, path = name.partition(":")
    if not colon or before in (_OFFSET, _TIMES):
        before, path = "", name
    each = before == _EACH_ROBOT or (not before and _EACH_NOTCH in path and len(robots) > 1)
    for label in robots if each else [before]:
        if label and label not in robots:
            raise InputError.UNKNOWN_NAME(
                f"`{name}`: no robot of this fit is called {label}; there are {', '.join(robots)}"
            )
        robot = robots[label or next(iter(robots))]
        for notch in range(robot.number_of_notches if _EACH_NOTCH in path else 1):
            yield label, path.replace(_EACH_NOTCH, f"[{notch + 1}]"), each


def _parsed(path: str) -> tuple[str, str, str]:
    """Rule ("", offset, factor or the key of a ratio), the number, and what the rule reads."""
    rule, _, number = path.rpartition(":")
    number, _, key = number.partition("/")
    if rule not in ("", _OFFSET, _TIMES) or (rule and key):
        raise InputError.UNKNOWN_NAME(
            f"`{path}` is not the name of a constant; write it like notch.depth, "
            "offset:notch.depth, factor:notch.depth or notch.precurvature_deg/height"
        )
    return (key or rule, number, f"{number.rpartition('.')[0]}.{key}" if key else number)


def _numbers(label: str, robot: Robot, path: str) -> tuple[RobotNumber, ...]:
    """The numbers of a robot that a constant sets."""
    rule, number, read = _parsed(path)
    if path in _SENSOR or not rule:
        return (RobotNumber(label, number),)
    key, end = number.rpartition(".")[2], len(read.rpartition(".")[2])
    numbers = numbers_at(robot, read)
    if len(set(numbers.values())) == 1:  # part by part only where they are unlike
        numbers = {read: next(iter(numbers.values()))}
    values = [(one[:-end] + key, value) for one, value in numbers.items()]
    if rule == _OFFSET:
        return tuple(RobotNumber(label, one, value, 1.0) for one, value in values)
    if not any(value for _, value in values):
        raise InputError.MISSING_VALUE(
            f"`{path}` multiplies `{read}`, which is 0 in {robot.name}; give it a value first"
        )
    return tuple(RobotNumber(label, one, 0.0, value) for one, value in values)


def _unknown(robots: Mapping[str, Robot], path: str, constant: Constant, each: bool) -> Unknown:
    sets = tuple(one for label, robot in robots.items() for one in _numbers(label, robot, path))
    if path in _SENSOR:
        unit, lower, start, first, last = _SENSOR[path]
        upper = math.inf
    else:
        rule, number, read = _parsed(path)
        # Without a rule robots have one value each, the same in all their parts.
        values = [
            value
            for label, one, *_ in sets
            for value in (
                numbers_at(robots[label], one).values() if rule else [number_at(robots[label], one)]
            )
        ]
        start = math.fsum(values) / len(values)
        robot = next(iter(robots.values()))
        unit, lower, upper = described_at(robot, number)
        first, last = _range(number, unit, start)
        if rule:
            lower, upper, size = -math.inf, math.inf, 1.0
            if rule not in (_OFFSET, _TIMES):
                unit = f"{unit}/{described_at(robot, read).unit}".removesuffix("/")
            elif rule == _TIMES:
                unit = ""
            if rule != _OFFSET:
                size = math.fsum(one.slope for one in sets) / len(sets)
                if not size:
                    raise InputError.MISSING_VALUE(f"the mean of `{read}` is 0; give limits")
            mean, start = start, 0.0 if rule == _OFFSET else start / size
            first, last = sorted(
                (end - mean if rule == _OFFSET else end / size) for end in (first, last)
            )
    lower = lower if constant.lower is None else constant.lower
    upper = upper if constant.upper is None else constant.upper
    first = max(first, lower) if constant.lower is None else lower
    last = min(last, upper) if constant.upper is None else upper
    if not first < last:  # a limit on the far side of where a search would look
        first, last = max(lower, first - 1.0), min(upper, first + 1.0)
    return Unknown(
        name=constant.name,
        unit=unit,
        sets=sets,
        lower=lower,
        upper=upper,
        start=min(max(start, lower), upper),
        first=first,
        last=last,
        prior=constant.prior,
        path=path,
        each=each,
    )


def _range(path: str, unit: str, value: float) -> tuple[float, float]:
    """Range of starting points around a present value."""
    if path.startswith("friction."):
        return 0.0, max(0.5, 2.0 * value)
    if unit == "deg":
        return value - _TURN, value + _TURN
    if value == 0.0:
        raise InputError.MISSING_VALUE(
            f"`{path}` is 0 in this robot, so its scale is unknown; give limits to search between"
        )
    if unit == "mm":
        return value - _TOLERANCE * abs(value), value + _TOLERANCE * abs(value)
    ends = (value / _FACTOR, value * _FACTOR)
    return min(ends), max(ends)
