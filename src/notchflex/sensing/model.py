"""The model of one reading: which force is looked for, and what the sensors read under it."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np
from jaxtyping import Float

from notchflex import BodyForce, EquilibriumPath, InputError, LoadPath, Robot
from notchflex.analysis.forward_model import ForwardModel
from notchflex.mechanics.chain import bending_normal
from notchflex.sensing.readings import Readings
from notchflex.support import (
    AXES,
    Change,
    ExternalLoad,
    check_integer,
    derivatives,
    load_change,
    short_repr,
)

SolvedState = Any
"""A state to go on from, as the solver has it; None for rest."""

Force = Float[np.ndarray, " d"]
"""Components of a force, N."""
Numbers = Float[np.ndarray, " m"]
"""What is read at once."""

_NO_TURN = (0.0, 0.0, 0.0)


@dataclass(frozen=True, eq=False)
class UnknownForce:
    """A force of d unknown components, dead in the world, beside known external loads.

    Attributes:
        names: Names of the components.
        directions: Their unit vectors in the world, (d, 3).
        known: The other external loads.
        base_rotation: Rotation vector of the base in the world, rad.
        body: Body at whose origin it acts; None for the tip.
    """

    names: tuple[str, ...]
    directions: Float[np.ndarray, "d 3"]
    known: ExternalLoad
    base_rotation: tuple[float, float, float] = _NO_TURN
    body: int | None = None

    def load(self, components: Force) -> ExternalLoad:
        """Return the external loads with some components of the force, N."""
        return added_force(self.known, components @ self.directions, self.body)


def added_force(
    loads: ExternalLoad, force: Float[np.ndarray, " 3"], body: int | None
) -> ExternalLoad:
    """Return external loads and a force, N, on a body, or at the tip where it is None."""
    if body is None:
        at_tip = np.asarray(loads.tip_force, float) + force
        return replace(loads, tip_force=tuple(at_tip.tolist()))
    more = BodyForce(body, tuple(force.tolist()))
    return replace(loads, body_forces=(*loads.body_forces, more))


def unknown_force(
    robot: Robot, components: str | None, place: int | str, known: ExternalLoad | None
) -> UnknownForce:
    """Check which force is looked for.

    Raises:
        InputError: Axes other than x, y and z, one given twice, no such body, known loads of
            another kind.
    """
    if known is not None and not isinstance(known, ExternalLoad):  # pyright: ignore
        raise InputError.WRONG_TYPE(
            f"known must be a notchflex.Load with the other loads; got {short_repr(known)}"
        )
    letters = _default_axes(robot) if components is None else components
    wrong = not isinstance(letters, str) or not letters or len(set(letters)) < len(letters)  # pyright: ignore
    if wrong or set(letters) - set(AXES):
        raise InputError.UNKNOWN_NAME(
            f"components names the axes along which the force is looked for, such as x, xz or xyz; "
            f"got {short_repr(letters)}"
        )
    letters = "".join(axis for axis in AXES if axis in letters)
    directions = np.eye(3)[[AXES.index(axis) for axis in letters]]
    loads = ExternalLoad() if known is None else known.external
    turn = getattr(known, "base_rotation", _NO_TURN)
    body = None
    if place not in ("tip", "search"):
        if isinstance(place, str):
            raise InputError.UNKNOWN_NAME(
                f'place is "tip", "search" or the number of a body; got {short_repr(place)}'
            )
        body = check_integer(place, "place")
        if not 1 <= body <= robot.number_of_notches:
            raise InputError.OUT_OF_RANGE(
                f"place must be a body from 1 to {robot.number_of_notches}; got {body}"
            )
    return UnknownForce(tuple(letters), directions, loads, turn, body)


def _default_axes(robot: Robot) -> str:
    """Axes across the straight tube in the plane in which the robot bends, or both."""
    normal = bending_normal(robot)
    if normal is None:
        return "xy"
    across: Sequence[str] = [
        axis for axis, part in zip("yx", normal, strict=False) if abs(part) > 1e-9
    ]
    return "".join(sorted(across))


# What readings can't resolve in the model, mm and rad: a stuck tendon of the model is not quite
# rigid, and a solve is met to its tolerance.
_RESOLUTION = {"stroke": 1e-5, "tip_position": 1e-5, "notch_angle": 1e-6}


@dataclass(frozen=True, eq=False)
class SensingStep:
    """One reading: which numbers were measured, and how exactly.

    Attributes:
        number: Which reading, from 0.
        measured: The numbers, (m,).
        entries: Which columns of the outputs these are, (m,).
        variance: Of their noise, and of what may have happened since the reading before, (m,).
        noise: Variance of the noise of one reading, where this is a mean of several, (m,).
        resolution: Variance of what readings can't resolve in the model, (m,).
        driving: Variance of what drives the model, (t,).
    """

    number: int
    measured: Numbers
    entries: np.ndarray
    variance: Numbers
    noise: Numbers
    resolution: Numbers
    driving: Float[np.ndarray, " t"]


@dataclass(frozen=True, eq=False)
class SensingModel:
    """A robot whose sensors are read while an unknown force acts on it.

    Attributes:
        robot: The robot.
        readings: What was read.
        unknown: The force that is looked for.
        largest: Largest component of it, N.
    """

    robot: Robot
    readings: Readings
    unknown: UnknownForce
    largest: float

    @property
    def size(self) -> int:
        """Number of unknown components."""
        return len(self.unknown.names)

    @cached_property
    def outputs(self) -> tuple[str, ...]:
        """Quantities that were measured in any reading."""
        read = self.readings.read
        return tuple(name for name, values in read.items() if np.isfinite(values).any())

    def step(self, number: int) -> SensingStep:
        """Return what was measured in a reading, counted from 0."""
        read, deviation = self.readings.read, self.readings.deviation
        count = self.readings.count[number]
        values = np.concatenate([read[name][number] for name in self.outputs])
        widths = [read[name].shape[1] for name in self.outputs]
        entries = np.flatnonzero(np.isfinite(values))
        noise, resolution = (
            np.repeat([one[name] ** 2 for name in self.outputs], widths)[entries]
            for one in (deviation, _RESOLUTION)
        )
        driving = self.readings.driving_deviation[number] ** 2 / count
        variance = noise / count + resolution
        return SensingStep(number, values[entries], entries, variance, noise, resolution, driving)

    def load(self, steps: Iterable[int], forces: Float[np.ndarray, "k d"]) -> LoadPath:
        """Return loads: what drives the model in some readings, each with a force."""
        tension, stroke = self.readings.commands
        rows = np.fromiter(steps, int)
        external = tuple(self.unknown.load(force) for force in forces)
        turn = np.array(self.unknown.base_rotation)
        commands = np.where(np.isnan(stroke[rows]), tension[rows], np.nan)
        return LoadPath.of_valid(commands, stroke[rows], turn, external)

    def solve(
        self, start: SolvedState, number: int, forces: Float[np.ndarray, "k d"]
    ) -> EquilibriumPath:
        """Solve a reading with some forces, each from the same state; rest where it is None."""
        load = self.load([number] * len(forces), forces)
        return self._each.solve(self.robot, load, start)

    def between_readings(
        self, start: SolvedState, number: int, forces: Float[np.ndarray, "2 d"]
    ) -> Float[np.ndarray, " outputs"]:
        """Return by how much what is read depends on the way from the reading before.

        The difference of a change in two halves from one at once, where the force and what drives
        the model change in proportion; 0 where they can't, as from slack tendons.

        Args:
            start: The state at the reading before.
            number: The reading.
            forces: The force before and at it.
        """
        rows = [number - 1, number]
        tension, stroke = (one[rows] for one in self.readings.commands)
        driven = np.isnan(stroke)
        if (driven[0] != driven[1]).any() or not np.nanmax(tension[0], initial=0.0) > 0.0:
            return np.zeros(len(self.values(self.solve(start, number, forces[1:]))[0]))
        at_once = self.load(rows, forces)
        middle = self.unknown.load(forces.mean(axis=0))
        halves = LoadPath.of_valid(
            *(np.stack([way.mean(axis=0), way[1]]) for way in (at_once.tension, at_once.stroke)),
            base_rotation=at_once.base_rotation,
            external=(middle, at_once.external[1]),
        )
        ways = [self._along.solve(self.robot, halves, start), self.solve(start, number, forces[1:])]
        first, second = (self.values(way)[-1] for way in ways)
        return np.nan_to_num(first - second)

    def follow(self, forces: Float[np.ndarray, "s d"]) -> EquilibriumPath:
        """Follow the whole history with a force in every reading."""
        return self._along.solve(self.robot, self.load(range(len(forces)), forces))

    def values(self, path: EquilibriumPath) -> Float[np.ndarray, "k outputs"]:
        """Return what the sensors would read; NaN where it did not converge."""
        columns = [np.asarray(path.quantity(name)) for name in self.outputs]
        values = np.concatenate([one.reshape(len(path), -1) for one in columns], axis=1)
        return np.where(path.converged[:, None], values, np.nan)

    def slopes(
        self, path: EquilibriumPath, step: int = 0, *, of_drives: bool = False
    ) -> Float[np.ndarray, "s outputs u"]:
        """Return the change of what is read by each component of the force in a step of a path.

        Or by each tendon's command in it; NaN where derivatives are not known.
        """
        loads = self._moved_by_drives(path) if of_drives else self._moved_by_force(path)
        rows = (np.arange(len(path)) == step)[:, None]
        changes = [Change(rows * load_change(path, load), None) for load in loads]
        by = derivatives(path, changes, self.outputs)
        parts = [by[name].reshape(*by[name].shape[:2], -1) for name in self.outputs]
        return np.moveaxis(np.concatenate(parts, axis=-1), 0, -1)

    def drive_slopes(
        self, start: SolvedState, path: EquilibriumPath, number: int
    ) -> Float[np.ndarray, "outputs t"]:
        """Return the change of what is read by each tendon's command, in one reading.

        Where a state was so hard to reach that its derivatives are not known, by differences over
        the deviation of the command; without noise that is 0.

        Args:
            start: The state at the reading before.
            path: The reading, solved.
            number: Which reading.
        """
        change = self.slopes(path, of_drives=True)[0]
        width = self.readings.driving_deviation[number]
        if np.isfinite(change).all() or not width.any():
            return np.nan_to_num(change)
        load, here = path.load, self.values(path)
        apart, over = np.zeros_like(change), np.zeros(len(width))
        for side in (1.0, -1.0):
            moves = side * np.diag(width)
            moved = LoadPath.of_valid(
                np.maximum(load.tension + moves, 0.0),  # NaN stays NaN: not commanded
                load.stroke + moves,
                load.base_rotation,
                load.external * len(moves),
            )
            values = self.values(self._each.solve(self.robot, moved, start))
            solved = np.asarray(np.isfinite(values).all(axis=1))
            apart += side * np.where(solved[:, None], values, here).T
            over += width * solved
        return apart / np.where(over > 0.0, over, np.inf)

    def _moved_by_force(self, path: EquilibriumPath) -> list[LoadPath]:
        """The loads of a path with a unit more of each component in every step."""
        load, body = path.load, self.unknown.body
        return [
            replace(load, external=tuple(added_force(one, unit, body) for one in load.external))
            for unit in self.unknown.directions
        ]

    def _moved_by_drives(self, path: EquilibriumPath) -> list[LoadPath]:
        """The loads of a path with a unit more of what drives each tendon in every step."""
        load = path.load
        return [
            replace(load, tension=load.tension + unit, stroke=load.stroke + unit)
            for unit in np.eye(load.tension.shape[1])
        ]

    @cached_property
    def _each(self) -> ForwardModel:
        return self._model(True)

    @cached_property
    def _along(self) -> ForwardModel:
        return self._model(False)

    def _model(self, from_rest: bool) -> ForwardModel:
        probe = self.load([0], np.full((1, self.size), 1.0))
        return ForwardModel(self.robot, probe, from_rest=from_rest)
