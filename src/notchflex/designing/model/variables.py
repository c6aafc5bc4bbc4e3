"""The variables of a design, and the robot, deviations and load path of a vector."""

from __future__ import annotations

import itertools
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from math import comb, isfinite, nan
from typing import Any

import numpy as np
from jaxtyping import Bool, Float

from notchflex import InputError, LoadPath, Robot
from notchflex.analysis.draws import moments, sources_of
from notchflex.designing.specification import DesignState, DesignVariable
from notchflex.specification import known, placed
from notchflex.support import ExternalLoad, Tolerance, described_at, numbers_at

_LOAD = re.compile(r"(?:load|state)\.([\w-]+)\.(tension|stroke)(?:\[([1-9]\d{0,3})\])?")
_UNITS = {"tension": "N", "stroke": "mm"}


@dataclass(frozen=True)
class LoadNumber:
    """A tension or stroke of a state: its kind, and the tendon from 0."""

    state: str
    kind: str
    tendon: int

    def commanded(self, states: Mapping[str, DesignState]) -> float:
        """Return its value in the specification, NaN where it has none."""
        values = getattr(states[self.state], self.kind) or ()
        return values[self.tendon] if self.tendon < len(values) else nan


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
        return _law(self.weights)


def _law(numbers: Mapping[str, float]) -> str | None:
    path = next(iter(numbers), "")
    return path if path.startswith(("material.", "friction.")) else None


@dataclass(frozen=True)
class Variables:
    """Variables of a design for one robot.

    Attributes:
        robot: The robot with its stock and number of notches.
        states: The loads by name.
        columns: The numbers of the vector.
        tolerances: Within what robots are made; derivatives by what deviates follow those by the
            vector.
        grid: Step of the lengths of the robots, mm; 0 for any length.
    """

    robot: Robot
    states: Mapping[str, DesignState]
    columns: tuple[Column, ...]
    tolerances: tuple[Tolerance, ...] = ()
    grid: float = 0.0

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
        loads = (one.load for one in self.columns)
        values = np.array([0.0 if one is None else one.commanded(self.states) for one in loads])
        paths = list(dict.fromkeys(path for one in self.columns for path in one.weights))
        if paths:
            present = [np.mean(list(numbers_at(self.robot, path).values())) for path in paths]
            parts = [[one.weights.get(path, 0.0) for one in self.columns] for path in paths]
            values += np.linalg.lstsq(np.array(parts), np.array(present))[0]
        return np.clip(values, self.lower, self.lower + self.span)

    def parts_of(self, path: str) -> Float[np.ndarray, " v"]:
        """Return how much of a single number of the robot file each variable makes."""
        return self._parts.get(path, np.zeros(len(self.columns)))

    @cached_property
    def _parts(self) -> dict[str, np.ndarray]:
        parts: dict[str, np.ndarray] = {}
        for number, column in enumerate(self.columns):
            for name, weight in column.weights.items():
                for path in numbers_at(self.robot, name):
                    parts.setdefault(path, np.zeros(len(self.columns)))[number] = weight
        return parts

    def values(self, x: Float[np.ndarray, " v"]) -> dict[str, float]:
        """Return the values of the robot file, by path."""
        values: dict[str, float] = {}
        for one, number in zip(self.columns, x.tolist(), strict=True):
            for path, weight in one.weights.items():
                values[path] = values.get(path, 0.0) + weight * number
        for one in itertools.compress(self.columns, self.lengths if self.grid else ()):
            values |= {path: float(self._placed(values[path])) for path in one.weights}
        return values

    @cached_property
    def lengths(self) -> Bool[np.ndarray, " v"]:
        """Which numbers are lengths of the robot."""
        return np.array([one.unit == "mm" and one.load is None for one in self.columns], bool)

    def on_grid(self, x: Float[np.ndarray, " v"]) -> Float[np.ndarray, " v"]:
        """Return a vector with its lengths on the grid."""
        return np.where(self.lengths, self._placed(x), x) if self.grid else x

    def _placed(self, value: Any) -> Any:
        return np.round(np.round(value / self.grid) * self.grid, 9)  # 1.405, not 1.4050000000000002

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
    chosen_by: dict[str, int] = {}
    for number, variable in enumerate(variables, start=1):
        with placed(f"`variable[{number}]`"):
            if variable.is_load:
                added, paths = [_load(variable, states)], [variable.value]
            else:
                added, paths = _columns(robot, variable), numbers_at(robot, variable.value)
            for path in paths:
                if path in chosen_by:
                    raise InputError.CONFLICT(
                        f"`{path}` is already chosen by `variable[{chosen_by[path]}]`; leave one "
                        "out."
                    )
                chosen_by[path] = number
            columns += added
    return Variables(robot, states, tuple(columns))


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
        return [Column(one, unit, *limits, {one: 1.0}) for one in numbers]
    degree = min(variable.degree or 1, len(numbers) - 1)
    place = np.linspace(0.0, 1.0, len(numbers))
    columns: list[Column] = []
    for k in range(degree + 1):
        # Bernstein's polynomials: where their factors are within the limits, so is the sum.
        shape = comb(degree, k) * place**k * (1.0 - place) ** (degree - k)
        weights = {one: w for one, w in zip(numbers, shape.tolist(), strict=True) if w}
        where = {0: "at the base", degree: "at the tip"}.get(k, f"coefficient {k + 1}")
        columns.append(Column(f"{path} ({where})", unit, *limits, weights))
    return columns


def _load(variable: DesignVariable, states: Mapping[str, DesignState]) -> Column:
    match = _LOAD.fullmatch(variable.value)
    if match is None:
        raise InputError.UNKNOWN_NAME(
            f"`{variable.value}` is no number of a load; write load.NAME.tension, or "
            "load.NAME.stroke[2] for the second tendon."
        )
    name, kind, tendon = match[1], match[2], int(match[3] or 1)
    known(name, states, "load")
    number = LoadNumber(name, kind, tendon - 1)
    if not isfinite(number.commanded(states)):
        raise InputError.MISSING_VALUE(
            f"the load {name} gives no {kind} of tendon {tendon} to begin with; give one."
        )
    if kind == "tension" and variable.lower < 0.0:
        raise InputError.OUT_OF_RANGE(
            f"`lower` is {variable.lower:g} N; a tendon only pulls, so give 0 N or more."
        )
    return Column(variable.value, _UNITS[kind], variable.lower, variable.upper, {}, number)


@dataclass(frozen=True)
class Deviation:
    """A number that is drawn, and the values that follow it.

    Attributes:
        nominal: Values of the drawing, by path.
        sd: Their standard deviations.
        mean: Mean of the deviation, in standard deviations.
    """

    nominal: Mapping[str, float]
    sd: Mapping[str, float]
    mean: float

    @property
    def law(self) -> str | None:
        """The path of a constant of material or friction, where this is one."""
        return _law(self.nominal)

    def moved(self, robot: Robot, part: float) -> Robot:
        """Return a robot that deviates by a number of standard deviations.

        Raises:
            InputError: No robot can have these values.
        """
        return robot.with_values({p: one + part * self.sd[p] for p, one in self.nominal.items()})


def deviations_of(robot: Robot, tolerances: Sequence[Tolerance]) -> list[Deviation]:
    """Return what deviates; as many, in the same order, for all robots of one form.

    Args:
        robot: The robot with the values of the drawing.
        tolerances: The tolerances.
    """
    deviations: list[Deviation] = []
    for source in sources_of(robot, tolerances):
        both = {path: moments(source.tolerance, value) for path, value in source.nominal.items()}
        mean, sd = next(iter(both.values()))
        sds = {path: one for path, (_, one) in both.items()}
        deviations.append(Deviation(source.nominal, sds, mean / sd if sd > 0.0 else 0.0))
    return deviations


PROBE = 1e-3
"""Force by which a compliance is found, to both sides, N."""

Direction = tuple[float, float, float]


@dataclass(frozen=True)
class Probe:
    """A small force at the tip after a state."""

    state: str
    direction: Direction
    side: int


@dataclass(frozen=True)
class StatePaths:
    """The states of a design, in pieces that each begin at rest.

    Attributes:
        states: The states by name.
        tendons: Number of tendons of the robot.
        pieces: What each piece goes through, in order: names of states, and at the end a probe.
    """

    states: Mapping[str, DesignState]
    tendons: int
    pieces: tuple[tuple[str | Probe, ...], ...]

    @property
    def _sizes(self) -> list[list[int]]:
        """Number of steps of every part of every piece."""
        return [
            [1 if isinstance(part, Probe) else self.states[part].steps for part in piece]
            for piece in self.pieces
        ]

    @property
    def step(self) -> dict[str | Probe, int]:
        """The step of every load and probe, from 0; of one in several pieces the first."""
        parts = list(itertools.chain(*self.pieces))
        last = itertools.accumulate(itertools.chain(*self._sizes), initial=-1)
        return dict(list(zip(parts, itertools.islice(last, 1, None), strict=True))[::-1])

    @property
    def lengths(self) -> list[int]:
        """Number of steps of every piece."""
        return list(map(sum, self._sizes))

    @property
    def from_rest(self) -> Bool[np.ndarray, " s"]:
        """Which steps begin at rest."""
        return np.concatenate([np.arange(length) == 0 for length in self.lengths])

    def path(self, numbers: Mapping[LoadNumber, float]) -> LoadPath:
        """Return the whole path.

        Args:
            numbers: Tensions and strokes that are variables.
        """
        commands: list[np.ndarray] = []
        external: list[ExternalLoad] = []
        for piece in self.pieces:
            before = np.zeros((2, self.tendons))
            for part in piece:
                if isinstance(part, Probe):
                    state, force = (
                        self.states[part.state],
                        part.side * PROBE * np.array(part.direction),
                    )
                    commands.append(before[None])
                    external.append(_external(state, force))
                    continue
                state = self.states[part]
                after = self._commanded(state, numbers)
                # A slack tendon is pulled from 0 N; what changes from stroke to tension jumps.
                slack = np.isnan(before).all(axis=0) & np.array([[True], [False]])
                first = np.where(slack, 0.0, np.where(np.isnan(before), after, before))
                done = np.arange(1, state.steps + 1)[:, None, None] / state.steps
                commands.append(first + done * (after - first))
                external += [_external(state)] * state.steps
                before = after
        tension, stroke = np.concatenate(commands).swapaxes(0, 1)
        return LoadPath(tension, stroke, external=tuple(external))

    def _commanded(
        self, state: DesignState, numbers: Mapping[LoadNumber, float]
    ) -> Float[np.ndarray, "2 t"]:
        """Tensions and strokes of a state, NaN where not commanded."""
        table = np.full((2, self.tendons), np.nan)
        for row, kind in enumerate(("tension", "stroke")):
            given = getattr(state, kind) or ()
            if len(given) > self.tendons:
                raise InputError.WRONG_SHAPE(
                    f"it gives a {kind} of {len(given)} tendons, but the robot has {self.tendons}."
                )
            table[row, : len(given)] = given
        for one, value in numbers.items():
            if one.state == state.name:
                table[("tension", "stroke").index(one.kind), one.tendon] = value
        return table


def _external(state: DesignState, more: float | np.ndarray = 0.0) -> ExternalLoad:
    """Return the external loads of a state, with more force at the tip."""
    force = tuple((np.array(state.tip_force) + more).tolist())
    return ExternalLoad(tip_force=force, tip_moment=state.tip_moment, tip_mass=state.tip_mass)


def state_paths(
    states: Sequence[DesignState],
    tendons: int,
    used: Sequence[str],
    probes: Sequence[tuple[str, Direction]],
) -> StatePaths:
    """Lay out the states of a design.

    Args:
        states: The states.
        tendons: Number of tendons of the robot.
        used: Names of the states that anything is asked of.
        probes: States and directions of tip compliances.

    Raises:
        InputError: States of one name, an unknown state before another, or a circle of states.
    """
    table = {one.name: one for one in states}
    pieces: list[tuple[str | Probe, ...]] = []
    for state, direction in dict.fromkeys(probes):
        pieces += [(*history(table, state), Probe(state, direction, side)) for side in (1, -1)]
    for name in used:
        way = history(table, name)
        if not any(piece[: len(way)] == way for piece in pieces):
            # A longer piece serves the states on its way too.
            pieces = [piece for piece in pieces if piece != way[: len(piece)]]
            pieces.append(way)
    return StatePaths(table, tendons, tuple(pieces))


def check_states(states: Sequence[DesignState], tendons: int) -> None:
    """Raise if loads contradict each other or the robot, or no path can have them.

    Raises:
        InputError: It is so.
    """
    table = {one.name: one for one in states}
    for state in states:
        with placed(f"`load.{state.name}`"):
            if table[state.name] is not state:
                raise InputError.CONFLICT("another load has this name; rename one of them.")
            history(table, state.name)
            StatePaths({state.name: state}, tendons, ((state.name,),)).path({})


def history(states: Mapping[str, DesignState], name: str) -> tuple[str, ...]:
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
        before = known(before, states, "load").after
    return tuple(way)
