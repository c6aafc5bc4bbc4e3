"""The constants that a fit may change, and the numbers of the drawing that may deviate."""

from __future__ import annotations

import math
from collections.abc import Collection, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from notchflex import InputError, Robot
from notchflex.support import (
    described_at,
    moments,
    number_at,
    numbers_at,
    sources_of,
    tolerances_of,
)


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
        limits = [limit for limit in (self.lower, self.upper) if limit is not None]
        if not all(map(_is_finite, limits)):
            raise InputError.NOT_FINITE(
                f"`{self.name}`: limits must be finite; got {' and '.join(map(str, limits))}"
            )
        if len(limits) == 2 and not limits[0] < limits[1]:
            raise InputError.OUT_OF_RANGE(
                f"`{self.name}`: the lower limit must be below the upper one; got {limits[0]:g} "
                f"and {limits[1]:g}"
            )
        pair = np.atleast_1d(np.asarray((0.0, 1.0) if self.prior is None else self.prior, object))
        if len(pair) != 2 or not all(map(_is_finite, pair)) or not pair[1] > 0.0:
            raise InputError.OUT_OF_RANGE(
                f"`{self.name}`: a prior is a mean and a standard deviation above 0; "
                f"got {' and '.join(map(str, pair))}"
            )


def _is_finite(value: object) -> bool:
    return isinstance(value, int | float | np.number) and math.isfinite(value)


class SensorNumber(NamedTuple):
    """A number of the measurement itself, and the command that it changes."""

    command: str
    unit: str
    lower: float
    neutral: float  # value of a measurement without it
    first: float  # where searches start
    last: float


SENSOR = {
    "sensor.force_offset": SensorNumber("tension", "N", -math.inf, 0.0, -0.1, 0.1),
    "sensor.force_factor": SensorNumber("tension", "", 1e-3, 1.0, 0.5, 2.0),
    "sensor.stroke_slack": SensorNumber("stroke", "mm", 0.0, 0.0, 0.0, 0.5),
}
"""What a force gauge shows at no force (N), the tension that acts over the reading less that, and
the stroke that only takes up slack (mm)."""

# Robots of one fit are of one tube and tendon: these deviate in all of them alike.
_DEVIATE_ALIKE = ("material.", "friction.")
# A factor on all notches is no other number than the moduli: fitted constants hold the error of
# the law by which they are found. That of the last notch shows in its angle.
_IN_THE_MODULI = "notch.stiffness_factor"


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

    def only_of(self, labels: Collection[str]) -> Unknown:
        """Return the same constant of some of the robots; it may set nothing."""
        return replace(self, sets=tuple(number for number in self.sets if number.label in labels))

    def of(self, label: str, robot: Robot) -> Unknown:
        """Return the same constant of a robot outside the fit; one of other robots sets nothing."""
        of_robot = self.only_of([label])
        if of_robot.sets or not self.shared:
            return of_robot
        return replace(self, sets=_numbers(label, robot, self.path))


def unknowns(
    robots: Mapping[str, Robot], fit: Sequence[str | Constant] | str
) -> tuple[Unknown, ...]:
    """Return the constants of a fit of robots by label.

    Raises:
        InputError: A name is unknown, is given twice, or belongs to no robot.
    """
    for word in {"each", "offset", "factor"} & set(robots):
        raise InputError.CONFLICT(
            f"no robot can be called {word}: `{word}:` has a meaning in names of constants"
        )
    constants = (fit,) if isinstance(fit, str | Constant) else fit
    if not constants:
        raise InputError.NO_DATA("fit names no constant; name one, such as friction.coefficient")
    found: list[Unknown] = []
    set_by: dict[tuple[str, str], str] = {}
    for constant in constants:
        constant = constant if isinstance(constant, Constant) else Constant(constant)
        for label, path, each in _expanded(robots, constant.name.strip()):
            name = f"{label}:{path}" if label else path
            owners = {label: robots[label]} if label else robots
            unknown = _unknown(owners, path, replace(constant, name=name), each)
            for number in unknown.sets:
                if number[:2] in set_by:
                    raise InputError.CONFLICT(
                        f"`{number.path}` of {number.label} is set by `{set_by[number[:2]]}` and "
                        f"by `{name}`; fit it once"
                    )
                set_by[number[:2]] = name
            found.append(unknown)
    return tuple(found)


def _expanded(robots: Mapping[str, Robot], name: str) -> Iterator[tuple[str, str, bool]]:
    """Yield label ("" is all robots), number, and whether it is one of each robot."""
    before, colon, path = name.partition(":")
    if not colon or before in ("offset", "factor"):
        before, path = "", name
    each = before == "each" or (not before and "[each]" in path and len(robots) > 1)
    for label in robots if each else [before]:
        if label and label not in robots:
            raise InputError.UNKNOWN_NAME(
                f"`{name}`: no robot of this fit is called {label}; there are {', '.join(robots)}"
            )
        robot = robots[label or next(iter(robots))]
        for notch in range(robot.number_of_notches if "[each]" in path else 1):
            yield label, path.replace("[each]", f"[{notch + 1}]"), each


def _parsed(path: str) -> tuple[str, str, str]:
    """Rule ("", "offset", "factor" or "ratio"), the number, and what the rule reads."""
    rule, _, number = path.rpartition(":")
    number, _, key = number.partition("/")
    if rule not in ("", "offset", "factor") or (rule and key):
        raise InputError.UNKNOWN_NAME(
            f"`{path}` is not the name of a constant; write it like notch.depth, "
            "offset:notch.depth, factor:notch.depth or notch.precurvature_deg/height"
        )
    return (
        ("ratio", number, f"{number.rpartition('.')[0]}.{key}") if key else (rule, number, number)
    )


def _numbers(label: str, robot: Robot, path: str) -> tuple[RobotNumber, ...]:
    """The numbers of a robot that a constant sets."""
    rule, number, read = _parsed(path)
    if path in SENSOR or not rule:
        return (RobotNumber(label, number),)
    numbers = numbers_at(robot, read)
    if len(set(numbers.values())) == 1:  # part by part only where they are unlike
        numbers = {read: next(iter(numbers.values()))}
    if rule != "offset" and not any(numbers.values()):
        raise InputError.MISSING_VALUE(
            f"`{path}` multiplies `{read}`, which is 0 in {robot.name}; give it a value first"
        )
    key = number.rpartition(".")[2]
    return tuple(
        RobotNumber(label, f"{part.rpartition('.')[0]}.{key}", *terms)
        for part, value in numbers.items()
        for terms in [(value, 1.0) if rule == "offset" else (0.0, value)]
    )


def _unknown(robots: Mapping[str, Robot], path: str, constant: Constant, each: bool) -> Unknown:
    sets = tuple(number for label in robots for number in _numbers(label, robots[label], path))
    if path in SENSOR:
        _, unit, lower, start, first, last = SENSOR[path]
        upper = math.inf
    else:
        unit, lower, upper, start, first, last = _described(robots, path, sets)
    lower = lower if constant.lower is None else constant.lower
    upper = upper if constant.upper is None else constant.upper
    first = max(first, lower) if constant.lower is None else lower
    last = min(last, upper) if constant.upper is None else upper
    if not first < last:  # a limit on the far side of where a search would look
        first, last = max(lower, first - 1.0), min(upper, first + 1.0)
    start = min(max(start, lower), upper)
    name, prior = constant.name, constant.prior
    return Unknown(name, unit, sets, lower, upper, start, first, last, prior, path, each)


def _described(
    robots: Mapping[str, Robot], path: str, sets: Sequence[RobotNumber]
) -> tuple[str, float, float, float, float, float]:
    """Unit, limits, value and range of starting points of a constant of robot files."""
    rule, number, read = _parsed(path)
    # Without a rule robots have one value each, the same in all their parts.
    values = [
        value
        for label, name, *_ in sets
        for value in (
            numbers_at(robots[label], name).values() if rule else [number_at(robots[label], name)]
        )
    ]
    mean = math.fsum(values) / len(values)
    robot = next(iter(robots.values()))
    unit, lower, upper = described_at(robot, number)
    first, last = _range(number, unit, mean)
    if not rule:
        return unit, lower, upper, mean, first, last
    if rule == "offset":
        return unit, -math.inf, math.inf, 0.0, first - mean, last - mean
    size = math.fsum(number.slope for number in sets) / len(sets)
    if not size:
        raise InputError.MISSING_VALUE(f"the mean of `{read}` is 0; give limits")
    per = f"{unit}/{described_at(robot, read).unit}".removesuffix("/")
    unit = "" if rule == "factor" else per
    low, high = sorted((first / size, last / size))
    return unit, -math.inf, math.inf, mean / size, low, high


def _range(path: str, unit: str, value: float) -> tuple[float, float]:
    """Range of starting points: lengths within 20 %, angles 10 deg, all else a factor of 4."""
    if path.startswith("friction."):
        return 0.0, max(0.5, 2.0 * value)
    if unit == "deg":
        return value - 10.0, value + 10.0
    if value == 0.0:
        raise InputError.MISSING_VALUE(
            f"`{path}` is 0 in this robot, so its scale is unknown; give limits to search between"
        )
    low, high = (0.8, 1.2) if unit == "mm" else (0.25, 4.0)
    return min(low * value, high * value), max(low * value, high * value)


def deviations_of(robots: Mapping[str, Robot], constants: Sequence[Unknown]) -> tuple[Unknown, ...]:
    """Return what may deviate from the drawings and is not fitted, in standard deviations.

    The tolerances are those of the robot files, or those that `uncertain` assumes. Dimensions
    belong to each robot, constants of material and friction to all.
    """
    fitted = numbers_set(robots, constants)
    deviations: dict[str, Unknown] = {}
    for label, robot in robots.items():
        exact = robot.replace(tolerance=None)
        tolerances = [
            tolerance for tolerance in tolerances_of(robot)[0] if tolerance.value != _IN_THE_MODULI
        ]
        for source in sources_of(exact, tolerances):
            sets: list[RobotNumber] = []
            means: list[float] = []
            for name, nominal in source.nominal.items():
                mean, deviation = moments(source.tolerance, nominal)
                numbers = numbers_at(exact, name)
                free = {
                    path: numbers[path] for path in sorted(numbers) if (label, path) not in fitted
                }
                if len(free) == len(numbers):
                    free = {name: nominal}
                if deviation > 0.0:
                    sets += [RobotNumber(label, *number, deviation) for number in free.items()]
                    means.append(mean / deviation)
            if sets:
                alike = source.name.startswith(_DEVIATE_ALIKE) or len(robots) == 1
                key = source.name if alike else f"{label}:{source.name}"
                sets = [*(deviations[key].sets if key in deviations else ()), *sets]
                prior = (math.fsum(means) / len(means), 1.0)
                deviations[key] = Unknown(
                    key, "", tuple(sets), -math.inf, math.inf, 0.0, -1.0, 1.0, prior, source.name
                )
    return tuple(deviations.values())


def values_set(
    label: str, constants: Iterable[Unknown], values: Iterable[float]
) -> dict[str, float]:
    """Return the numbers of a robot, and of its measurement, that values of constants set."""
    return {
        number.path: float(number.base + number.slope * value)
        for constant, value in zip(constants, values, strict=True)
        for number in constant.only_of([label]).sets
    }


def with_numbers(robot: Robot, numbers: Mapping[str, float]) -> Robot:
    """Return a robot with other numbers, of which those of the measurement are none of its own.

    Raises:
        InputError: The robot cannot have them.
    """
    numbers = {path: value for path, value in numbers.items() if path not in SENSOR}
    return robot.with_values(numbers) if numbers else robot


def numbers_set(robots: Mapping[str, Robot], constants: Sequence[Unknown]) -> set[tuple[str, str]]:
    """Return label and name of every single number that constants set."""
    return {
        (label, name)
        for constant in constants
        for label, path, *_ in constant.sets
        for name in ([path] if path in SENSOR else numbers_at(robots[label], path))
    }
