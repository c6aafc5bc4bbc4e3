"""The variables of a design, and what a vector of them makes: a robot, deviations, a load path."""

from __future__ import annotations

import itertools
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from math import comb
from typing import Any, NamedTuple

import numpy as np
from jaxtyping import Bool, Float

from notchflex import InputError, LoadPath, Robot
from notchflex.designing.specification import DesignState, DesignVariable
from notchflex.specification import known, placed
from notchflex.support import (
    ExternalLoad,
    Tolerance,
    described_at,
    moments,
    numbers_at,
    sources_of,
)

Vector = Float[np.ndarray, " v"]
"""A number for each variable."""

Drives = Mapping[str, Float[np.ndarray, "2 t"]]
"""By load the tensions (N) and strokes (mm) of its tendons, NaN where not commanded."""

_DRIVES, _UNITS = ("tension", "stroke"), ("N", "mm")
_LOAD = re.compile(r"(?:load|state)\.([\w-]+)\.(tension|stroke)(?:\[([1-9]\d{0,3})\])?")
# Limits beyond this factor of the value of the robot are in another unit.
_OTHER_UNIT = 100.0


@dataclass(frozen=True)
class Column:
    """One number of the vector.

    Attributes:
        title: What it is called: a path, with "at the base" or so for a polynomial.
        unit: Its unit.
        lower: Least value.
        upper: Greatest value.
        weights: By path of the robot file, how much of it this number makes.
        drive: The load, the row of its drives and the tendon that it is instead.
    """

    title: str
    unit: str
    lower: float
    upper: float
    weights: Mapping[str, float]
    drive: tuple[str, int, int] | None = None


class Deviation(NamedTuple):
    """A number that is drawn within its tolerance."""

    sd: Mapping[str, float]  # standard deviations of the values that follow it, by path
    mean: float  # of the deviation, in standard deviations


@dataclass(frozen=True)
class Variables:
    """Variables of a design for one robot.

    Attributes:
        robot: The robot with its stock and number of notches.
        drives: What the loads command.
        columns: The numbers of the vector.
        tolerances: Within what robots are made; derivatives by what deviates follow those by the
            vector.
        grid: Step of the lengths of the robots, mm; 0 for any length.
    """

    robot: Robot
    drives: Drives
    columns: tuple[Column, ...]
    tolerances: tuple[Tolerance, ...] = ()
    grid: float = 0.0

    @cached_property
    def lower(self) -> Vector:
        """Least values."""
        return np.array([column.lower for column in self.columns])

    @cached_property
    def span(self) -> Vector:
        """Greatest less least values."""
        return np.array([column.upper for column in self.columns]) - self.lower

    @cached_property
    def start(self) -> Vector:
        """The robot as it is, within the limits."""
        values = np.zeros(len(self.columns))
        for number, column in enumerate(self.columns):
            if column.drive is not None:
                name, *place = column.drive
                values[number] = self.drives[name][tuple(place)]
        paths = list(dict.fromkeys(path for column in self.columns for path in column.weights))
        if paths:
            present = [np.mean(list(numbers_at(self.robot, path).values())) for path in paths]
            parts = [[column.weights.get(path, 0.0) for column in self.columns] for path in paths]
            values += np.linalg.lstsq(np.array(parts), np.array(present))[0]
        return np.clip(values, self.lower, self.lower + self.span)

    @cached_property
    def lengths(self) -> Bool[np.ndarray, " v"]:
        """Which numbers are lengths of the robot."""
        return np.array([column.unit == "mm" and not column.drive for column in self.columns], bool)

    def on_grid(self, x: Vector) -> Vector:
        """Return a vector with its lengths on the grid."""
        return np.where(self.lengths, self._placed(x), x) if self.grid else x

    def _placed(self, value: Any) -> Any:
        return np.round(np.round(value / self.grid) * self.grid, 9)  # 1.405, not 1.4050000000000002

    def robot_at(self, x: Vector) -> Robot:
        """Return the robot of a vector.

        Raises:
            InputError: No robot can have these values.
        """
        values: dict[str, float] = {}
        for column, number in zip(self.columns, x.tolist(), strict=True):
            for path, weight in column.weights.items():
                values[path] = values.get(path, 0.0) + weight * number
        for column in itertools.compress(self.columns, self.lengths if self.grid else ()):
            values |= {path: float(self._placed(values[path])) for path in column.weights}
        return self.robot.with_values(values) if values else self.robot

    def drives_at(self, x: Vector) -> Drives:
        """Return what the loads command at a vector."""
        drives = {name: table.copy() for name, table in self.drives.items()}
        for column, number in zip(self.columns, x.tolist(), strict=True):
            if column.drive is not None:
                name, *place = column.drive
                drives[name][tuple(place)] = number
        return drives

    def deviations(self, robot: Robot) -> list[Deviation]:
        """Return what deviates; as many, in the same order, for all robots of one form."""
        deviations: list[Deviation] = []
        for source in sources_of(robot, self.tolerances):
            both = {path: moments(source.tolerance, at) for path, at in source.nominal.items()}
            mean, sd = next(iter(both.values()))
            sds = {path: sd for path, (_, sd) in both.items()}
            deviations.append(Deviation(sds, mean / sd if sd > 0.0 else 0.0))
        return deviations

    def varied(self, robot: Robot) -> tuple[tuple[str, ...], Float[np.ndarray, "k names"]]:
        """Return the single numbers that vary, and by how much.

        They vary along the range of each variable, then by each standard deviation.
        """
        changes = [
            {path: weight * size for path, weight in column.weights.items()}
            for column, size in zip(self.columns, self.span.tolist(), strict=True)
        ]
        rows = [
            {name: size for path, size in change.items() for name in numbers_at(robot, path)}
            for change in (*changes, *(deviation.sd for deviation in self.deviations(robot)))
        ]
        names = tuple(dict.fromkeys(itertools.chain(*rows)))
        along = [[row.get(name, 0.0) for name in names] for row in rows]
        return names, np.reshape(along, (len(rows), len(names)))


def variables_of(robot: Robot, variables: Sequence[DesignVariable], drives: Drives) -> Variables:
    """Make the vector of the variables of a design.

    Raises:
        InputError: A path is not known or no number, or limits are out of range.
    """
    columns: list[Column] = []
    for number, variable in enumerate(variables, start=1):
        with placed(f"`variable[{number}]`"):
            columns += _drive(variable, drives) if variable.is_load else _columns(robot, variable)
    return Variables(robot, drives, tuple(columns))


def _columns(robot: Robot, variable: DesignVariable) -> list[Column]:
    limits, path, along = (variable.lower, variable.upper), variable.value, variable.along
    numbers, (unit, least, most) = numbers_at(robot, path), described_at(robot, path)
    for key, limit in zip(("lower", "upper"), limits, strict=True):
        if not least <= limit <= most:
            between = f"{least:g} and {most:g} {unit}".rstrip()
            raise InputError.OUT_OF_RANGE(
                f"`{key}` is {limit:g}; `{path}` must lie between {between}. Give it in that unit."
            )
    for value in numbers.values():
        if value > _OTHER_UNIT * variable.upper > 0.0 or 0.0 < _OTHER_UNIT * value < variable.lower:
            raise InputError.OUT_OF_RANGE(
                f"`{path}` is {value:g} in the robot, and may lie between {limits[0]:g} and "
                f"{limits[1]:g}: give the limits in {unit or 'the unit of the robot file'}, or "
                "change the robot."
            )
    if along == "all":
        return [Column(path, unit, *limits, {path: 1.0})]
    if not path.startswith("notch") or len(numbers) < 2:
        raise InputError.UNSUPPORTED(
            f'along = "{along}" is for values of several notches, such as notch.depth; `{path}` is '
            "a single number."
        )
    if along == "each":
        return [Column(name, unit, *limits, {name: 1.0}) for name in numbers]
    degree = min(variable.degree or 1, len(numbers) - 1)
    place = np.linspace(0.0, 1.0, len(numbers))
    columns: list[Column] = []
    for k in range(degree + 1):
        # Bernstein's polynomials: where their factors are within the limits, so is the sum.
        shape = comb(degree, k) * place**k * (1.0 - place) ** (degree - k)
        weights = {name: w for name, w in zip(numbers, shape.tolist(), strict=True) if w}
        where = {0: "at the base", degree: "at the tip"}.get(k, f"coefficient {k + 1}")
        columns.append(Column(f"{path} ({where})", unit, *limits, weights))
    return columns


def _drive(variable: DesignVariable, drives: Drives) -> list[Column]:
    match = _LOAD.fullmatch(variable.value)
    if match is None:
        raise InputError.UNKNOWN_NAME(
            f"`{variable.value}` is no number of a load; write load.NAME.tension, or "
            "load.NAME.stroke[2] for the second tendon."
        )
    name, kind, tendon = match[1], match[2], int(match[3] or 1)
    row = _DRIVES.index(kind)
    if not np.isfinite(known(name, drives, "load")[row, tendon - 1 : tendon]).any():
        raise InputError.MISSING_VALUE(
            f"the load {name} gives no {kind} of tendon {tendon} to begin with; give one."
        )
    if kind == "tension" and variable.lower < 0.0:
        raise InputError.OUT_OF_RANGE(
            f"`lower` is {variable.lower:g} N; a tendon only pulls, so give 0 N or more."
        )
    limits = variable.lower, variable.upper
    return [Column(variable.value, _UNITS[row], *limits, {}, (name, row, tendon - 1))]


PROBE = 1e-3
"""Force by which a compliance is found, to both sides, N."""

Direction = tuple[float, float, float]
Probe = tuple[str, Direction, int]
"""A small force at the tip after a load: along a direction, or (side -1) against it."""


class LoadStep(NamedTuple):
    """A step of the path of a design."""

    load: str
    before: str  # load whose drives it comes from; "" from rest
    part: float  # of the way from there
    external: ExternalLoad


@dataclass(frozen=True)
class LoadSteps:
    """The loads of a design, step by step, in pieces that each begin at rest.

    Attributes:
        steps: The steps.
        lengths: Number of steps of every piece.
        last: The step at which each load and probe is reached; of one in several pieces the first.
    """

    steps: tuple[LoadStep, ...]
    lengths: tuple[int, ...]
    last: Mapping[str | Probe, int]

    @property
    def from_rest(self) -> Bool[np.ndarray, " s"]:
        """Which steps begin at rest."""
        return np.concatenate([np.arange(length) == 0 for length in self.lengths])

    def path(self, drives: Drives) -> LoadPath:
        """Return the whole path."""
        after = np.stack([drives[step.load] for step in self.steps])
        rest = np.zeros_like(after[0])
        before = np.stack([drives.get(step.before, rest) for step in self.steps])
        # A slack tendon is pulled from 0 N; what changes from stroke to tension jumps.
        slack = np.isnan(before).all(axis=1, keepdims=True) & np.array([[True], [False]])
        first = np.where(slack, 0.0, np.where(np.isnan(before), after, before))
        part = np.reshape([step.part for step in self.steps], (-1, 1, 1))
        tension, stroke = (first + part * (after - first)).swapaxes(0, 1)
        return LoadPath(tension, stroke, external=tuple(step.external for step in self.steps))


def _external(load: DesignState, more: float | np.ndarray = 0.0) -> ExternalLoad:
    """Return the external loads of a load, with more force at the tip."""
    names = "tip_moment", "tip_mass", "temperature", "sheath_bend_deg"
    force = tuple((np.array(load.tip_force) + more).tolist())
    return ExternalLoad(tip_force=force, **{name: getattr(load, name) for name in names})


def load_steps(
    loads: Sequence[DesignState], used: Sequence[str], probes: Sequence[Probe]
) -> LoadSteps:
    """Lay out the loads that anything is asked of, and the probes of tip compliances."""
    named = {load.name: load for load in loads}
    pieces: list[tuple[str | Probe, ...]] = [
        (*_history(named, probe[0]), probe) for probe in dict.fromkeys(probes)
    ]
    for way in (_history(named, name) for name in dict.fromkeys(used)):
        if not any(piece[: len(way)] == way for piece in pieces):
            # A longer piece serves the loads on its way too.
            pieces = [piece for piece in pieces if piece != way[: len(piece)]]
            pieces.append(way)
    steps: list[LoadStep] = []
    last: dict[str | Probe, int] = {}
    lengths: list[int] = []
    for piece in pieces:
        first, before = len(steps), ""
        for part in piece:
            if isinstance(part, str):
                load = named[part]
                parts = (number / load.steps for number in range(1, load.steps + 1))
                steps += [LoadStep(part, before, each, _external(load)) for each in parts]
                before = part
            else:
                name, direction, side = part
                external = _external(named[name], side * PROBE * np.array(direction))
                steps.append(LoadStep(name, name, 1.0, external))
            last.setdefault(part, len(steps) - 1)
        lengths.append(len(steps) - first)
    return LoadSteps(tuple(steps), tuple(lengths), last)


def drives_of(loads: Sequence[DesignState], tendons: int) -> Drives:
    """Return what loads command.

    Args:
        loads: The loads.
        tendons: Number of tendons of the robot.

    Raises:
        InputError: Loads contradict each other or the robot, or no path can have them.
    """
    named, drives = {load.name: load for load in loads}, dict[str, np.ndarray]()
    for load in loads:
        with placed(f"`load.{load.name}`"):
            if named[load.name] is not load:
                raise InputError.CONFLICT("another load has this name; rename one of them.")
            table = drives[load.name] = np.full((2, tendons), np.nan)
            for row, kind in zip(table, _DRIVES, strict=True):
                commanded = getattr(load, kind) or ()
                if len(commanded) > tendons:
                    raise InputError.WRONG_SHAPE(
                        f"it gives a {kind} of {len(commanded)} tendons, but the robot has "
                        f"{tendons}."
                    )
                row[: len(commanded)] = commanded
            _history(named, load.name)
            LoadPath(*table[:, None], external=(_external(load),))
    return drives


def _history(loads: Mapping[str, DesignState], name: str) -> tuple[str, ...]:
    """Return the loads from rest up to one.

    Raises:
        InputError: One of them does not exist, or they run in a circle.
    """
    way: list[str] = []
    before: str | None = name
    while before is not None:
        if before in way:
            raise InputError.CONFLICT(
                f"the loads {' and '.join(way)} come after each other in a circle; one of them "
                "must begin at rest, without `after`."
            )
        way.insert(0, before)
        before = known(before, loads, "load").after
    return tuple(way)
