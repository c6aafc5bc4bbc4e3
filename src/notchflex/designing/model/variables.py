"""The variables of a design as a vector, and the robot and the loads of a vector."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from math import comb, isfinite

import numpy as np
from jaxtyping import Float

from notchflex.designing.specification.chosen import DesignVariable
from notchflex.designing.specification.spec import DesignState
from notchflex.errors import InputError
from notchflex.robot import Robot
from notchflex.robot.error_messages import nearest
from notchflex.robot.tolerance import Tolerance
from notchflex.robot.value_names import described_at, numbers_at

_LOAD = re.compile(r"state\.([\w-]+)\.(tension|stroke)(?:\[([1-9]\d{0,3})\])?")
_UNITS = {"tension": "N", "stroke": "mm"}


@dataclass(frozen=True)
class LoadNumber:
    """A tension or stroke of a state: its kind, and the tendon from 0."""

    state: str
    kind: str
    tendon: int


@dataclass(frozen=True)
class Column:
    """One number of the vector.

    Attributes:
        name: What it is called: a path, with "at the base" or so for a polynomial.
        unit: Its unit.
        lower: Least value.
        upper: Greatest value.
        weights: By path of the robot file, how much of it this number makes.
        load: The tension or stroke that it is instead.
    """

    name: str
    unit: str
    lower: float
    upper: float
    weights: Mapping[str, float]
    load: LoadNumber | None = None

    @property
    def span(self) -> float:
        """Greatest less least value."""
        return self.upper - self.lower

    @property
    def law(self) -> str | None:
        """The path of a constant of material or friction, where this is one."""
        path = next(iter(self.weights), "")
        return path if path.startswith(("material.", "friction.")) else None


@dataclass(frozen=True)
class Variables:
    """Variables of a design for one robot.

    Attributes:
        robot: The robot with its stock and number of notches.
        states: The states by name.
        columns: The numbers of the vector.
        tolerances: Within what robots are made; derivatives by what deviates follow those by the
            vector.
    """

    robot: Robot
    states: Mapping[str, DesignState]
    columns: tuple[Column, ...]
    tolerances: tuple[Tolerance, ...] = ()

    @cached_property
    def lower(self) -> Float[np.ndarray, " v"]:
        """Least values."""
        return np.array([one.lower for one in self.columns])

    @cached_property
    def span(self) -> Float[np.ndarray, " v"]:
        """Greatest less least values."""
        return np.array([one.span for one in self.columns])

    @cached_property
    def start(self) -> Float[np.ndarray, " v"]:
        """The robot as it is, within the limits."""
        values = np.zeros(len(self.columns))
        paths = list(dict.fromkeys(path for one in self.columns for path in one.weights))
        if paths:
            present = np.array([np.mean(list(numbers_at(self.robot, p).values())) for p in paths])
            parts = [[one.weights.get(path, 0.0) for one in self.columns] for path in paths]
            values = np.linalg.lstsq(np.array(parts), present)[0]
        for number, one in enumerate(self.columns):
            if one.load is not None:
                state = self.states[one.load.state]
                values[number] = getattr(state, one.load.kind)[one.load.tendon]
        return np.clip(values, self.lower, self.lower + self.span)

    def parts_of(self, path: str) -> Float[np.ndarray, " v"]:
        """Return how much of a single number of the robot file each variable makes."""
        if path not in self._parts:
            self._parts[path] = np.array([self._part(one, path) for one in self.columns])
        return self._parts[path]

    def _part(self, column: Column, path: str) -> float:
        for name, weight in column.weights.items():
            if path in numbers_at(self.robot, name):
                return weight
        return 0.0

    @cached_property
    def _parts(self) -> dict[str, np.ndarray]:
        return {}

    def values(self, x: Float[np.ndarray, " v"]) -> dict[str, float]:
        """Return the values of the robot file, by path."""
        values: dict[str, float] = {}
        for one, number in zip(self.columns, x.tolist(), strict=True):
            for path, weight in one.weights.items():
                values[path] = values.get(path, 0.0) + weight * number
        return values

    def robot_at(self, x: Float[np.ndarray, " v"]) -> Robot:
        """Return the robot of a vector.

        Raises:
            InputError: No robot can have these values.
        """
        values = self.values(x)
        return self.robot.with_values(values) if values else self.robot

    def loads_at(self, x: Float[np.ndarray, " v"]) -> dict[LoadNumber, float]:
        """Return the tensions and strokes that are variables."""
        pairs = zip(self.columns, x.tolist(), strict=True)
        return {one.load: number for one, number in pairs if one.load is not None}


# Limits beyond this factor of the value of the robot are in another unit.
_OTHER_UNIT = 100.0


def variables_of(
    robot: Robot, variables: Sequence[DesignVariable], states: Mapping[str, DesignState]
) -> Variables:
    """Make the vector of the variables of a design.

    Raises:
        InputError: A path is not known, given twice or no number, or limits are out of range.
    """
    columns: list[Column] = []
    numbers: dict[str, int] = {}
    for number, one in enumerate(variables, start=1):
        shown = f"`variable[{number}]`: "
        try:
            added = _columns(robot, one, states)
        except InputError as error:
            raise InputError(f"{shown}{error}", error.code) from None
        for path in dict.fromkeys(path for column in added for path in _every(robot, column)):
            if path in numbers:
                raise InputError.CONFLICT(
                    f"{shown}`{path}` is already chosen by `variable[{numbers[path]}]`; "
                    "leave one out."
                )
            numbers[path] = number
        columns += added
    return Variables(robot, states, tuple(columns))


def _every(robot: Robot, column: Column) -> list[str]:
    """Every single number that a column sets."""
    if column.load is not None:
        return [column.name]
    return [path for name in column.weights for path in numbers_at(robot, name)]


def _columns(
    robot: Robot, variable: DesignVariable, states: Mapping[str, DesignState]
) -> list[Column]:
    limits = (variable.lower, variable.upper)
    if variable.value.startswith("state."):
        load = _load_number(robot, variable, states)
        return [Column(variable.value, _UNITS[load.kind], *limits, {}, load)]
    numbers = numbers_at(robot, variable.value)
    described = described_at(robot, variable.value)
    for key, limit in zip(("lower", "upper"), limits, strict=True):
        if not described.lower <= limit <= described.upper:
            raise InputError.OUT_OF_RANGE(
                f"`{key}` is {limit:g}; `{variable.value}` must lie between {described.lower:g} "
                f"and {described.upper:g} {described.unit}".rstrip()
                + ". Give it in that unit."
            )
    unit = described.unit
    for value in numbers.values():
        if value > _OTHER_UNIT * variable.upper > 0.0 or 0.0 < _OTHER_UNIT * value < variable.lower:
            raise InputError.OUT_OF_RANGE(
                f"`{variable.value}` is {value:g} {unit}".rstrip()
                + f" in the robot, and may lie between {variable.lower:g} and {variable.upper:g}: "
                f"give the limits in {unit or 'the unit of the robot file'}, or change the robot."
            )
    if variable.along == "all":
        return [Column(variable.value, unit, *limits, {variable.value: 1.0})]
    if not variable.value.startswith("notch") or len(numbers) < 2:
        raise InputError.UNSUPPORTED(
            f'along = "{variable.along}" is for values of several notches, such as notch.depth; '
            f"`{variable.value}` is a single number."
        )
    if variable.along == "each":
        return [Column(path, unit, *limits, {path: 1.0}) for path in numbers]
    degree = min(variable.degree or 1, len(numbers) - 1)
    at = np.linspace(0.0, 1.0, len(numbers))
    columns: list[Column] = []
    for k in range(degree + 1):
        # Bernstein's polynomials: where their factors are within the limits, so is the sum.
        shape = comb(degree, k) * at**k * (1.0 - at) ** (degree - k)
        weights = {p: w for p, w in zip(numbers, shape.tolist(), strict=True) if w}
        columns.append(Column(f"{variable.value} ({_place(k, degree)})", unit, *limits, weights))
    return columns


def _place(k: int, degree: int) -> str:
    if k in (0, degree):
        return "at the tip" if k else "at the base"
    return f"coefficient {k + 1}"


def _load_number(
    robot: Robot, variable: DesignVariable, states: Mapping[str, DesignState]
) -> LoadNumber:
    match = _LOAD.fullmatch(variable.value)
    if match is None:
        raise InputError.UNKNOWN_NAME(
            f"`{variable.value}` is not the name of a load; write it like state.NAME.tension, or "
            "state.NAME.stroke[2] for the second tendon."
        )
    name, kind, tendon = match[1], match[2], int(match[3] or 1)
    if name not in states:
        raise InputError.UNKNOWN_NAME(
            f"`{variable.value}`: there is no state `{name}`{nearest(name, states)}."
        )
    commanded = getattr(states[name], kind) or ()
    if tendon > len(commanded) or not isfinite(commanded[tendon - 1]):
        raise InputError.MISSING_VALUE(
            f"`{variable.value}`: the state gives no {kind} of tendon {tendon} to begin with; "
            "give one."
        )
    if kind == "tension" and variable.lower < 0.0:
        raise InputError.OUT_OF_RANGE(
            f"`lower` is {variable.lower:g} N; a tendon only pulls, so give 0 N or more."
        )
    if tendon > robot.number_of_tendons:
        raise InputError.OUT_OF_RANGE(
            f"`{variable.value}`: the robot has {robot.number_of_tendons} tendons."
        )
    return LoadNumber(name, kind, tendon - 1)
