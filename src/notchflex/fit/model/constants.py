"""The constants that a fit may change: their names, limits, and where a search for them starts."""

from __future__ import annotations

import math
from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from notchflex.errors import InputError
from notchflex.robot import Robot
from notchflex.robot.value_names import described_at, number_at

_EACH_NOTCH = "[each]"
_EACH_ROBOT = "each"

# Where a search looks without limits of the user: lengths vary by a tolerance, angles by some
# degrees, all else by a factor.
_TOLERANCE, _TURN, _FACTOR = 0.2, 10.0, 4.0
# Unit, least value, and where a search looks, of the numbers of the measurement.
_SENSOR = {
    "sensor.force_offset": ("N", -math.inf, -0.1, 0.1),
    "sensor.stroke_slack": ("mm", 0.0, 0.0, 0.5),
}


@dataclass(frozen=True)
class Constant:
    """A constant to be fitted.

    Args:
        name: A value of the robot file (`material.elastic_modulus`, `notch[2].depth`), shared by
            all robots of the fit; with a label before it (`A:friction.coefficient`) of one robot;
            with `each:` one for every robot; with `notch[each].` one for every notch. Of the
            measurement: `sensor.force_offset` (what the gauge shows at no force, N) and
            `sensor.stroke_slack` (stroke that only takes up slack, mm).
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


@dataclass(frozen=True)
class Unknown:
    """A constant of a fit, and the robots' numbers that it sets.

    Attributes:
        name: Name that is shown.
        unit: Unit of its value, "" for a pure number.
        sets: Labels of robots and the names of their numbers.
        lower: Least value, -inf if there is none.
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
        """A typical size of its changes."""
        return self.last - self.first

    def among(self, labels: Collection[str]) -> Unknown:
        """Return the same constant of some of the robots.

        Raises:
            InputError: None of them has it.
        """
        sets = tuple(one for one in self.sets if one[0] in labels)
        if not sets:
            raise InputError.TOO_FEW_DATA(
                f"`{self.name}` belongs to {self.sets[0][0]} alone; without it there is nothing "
                "to find it from"
            )
        return replace(self, sets=sets)

    def shared_with(self, label: str) -> Unknown:
        """Return the same constant of a robot outside the fit; one of other robots sets nothing."""
        sets = tuple(one for one in self.sets if one[0] == label)
        if not sets and ":" not in self.name:
            sets = ((label, self.sets[0][1]),)
        return replace(self, sets=sets)


def unknowns(
    robots: Mapping[str, Robot], fit: Sequence[str | Constant] | str
) -> tuple[Unknown, ...]:
    """Return the constants of a fit of robots by label.

    Raises:
        InputError: A name is unknown, is given twice, or belongs to no robot.
    """
    if _EACH_ROBOT in robots:
        raise InputError.CONFLICT(
            "no robot can be called each: `each:` stands for every robot of the fit"
        )
    constants = (fit,) if isinstance(fit, str | Constant) else tuple(fit)
    if not constants:
        raise InputError.NO_DATA("fit names no constant; name one, such as friction.coefficient")
    every: list[Unknown] = []
    set_by: dict[tuple[str, str], str] = {}
    for constant in constants:
        constant = constant if isinstance(constant, Constant) else Constant(constant)
        for label, path in _expanded(robots, constant.name.strip()):
            name = f"{label}:{path}" if label else path
            owners = {label: robots[label]} if label else robots
            every.append(_unknown(owners, path, replace(constant, name=name)))
            for place in every[-1].sets:
                if place in set_by:
                    raise InputError.CONFLICT(
                        f"`{path}` of {place[0]} is set by `{set_by[place]}` and by `{name}`; "
                        "fit it once"
                    )
                set_by[place] = name
    return tuple(every)


def _expanded(robots: Mapping[str, Robot], name: str) -> Iterator[tuple[str, str]]:
    """Yield label and number of every constant that a name stands for; "" is all robots."""
    before, colon, path = name.partition(":")
    if not colon:
        before, path = "", name
    each = before == _EACH_ROBOT or (not before and _EACH_NOTCH in path and len(robots) > 1)
    for label in robots if each else [before]:
        if label and label not in robots:
            raise InputError.UNKNOWN_NAME(
                f"`{name}`: no robot of this fit is called {label}; there are {', '.join(robots)}"
            )
        robot = robots[label or next(iter(robots))]
        for notch in range(robot.number_of_notches if _EACH_NOTCH in path else 1):
            yield label, path.replace(_EACH_NOTCH, f"[{notch + 1}]")


def _unknown(robots: Mapping[str, Robot], path: str, constant: Constant) -> Unknown:
    if path in _SENSOR:
        unit, lower, first, last = _SENSOR[path]
        start, upper = 0.0, math.inf
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
    return Unknown(
        name=constant.name,
        unit=unit,
        sets=tuple((label, path) for label in robots),
        lower=lower,
        upper=upper,
        start=min(max(start, lower), upper),
        first=first,
        last=last,
        prior=constant.prior,
    )


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
