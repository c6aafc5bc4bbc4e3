"""The model of one reading: which force is looked for, and what the sensors read under it."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from jaxtyping import Float

from notchflex import BodyForce, EquilibriumPath, InputError, LoadPath, Robot, Settings
from notchflex._jax import constant
from notchflex.analysis.forward_model import ForwardModel
from notchflex.analysis.tangent import PathTangents
from notchflex.loads.command import make_commands
from notchflex.loads.load import NO_VECTOR
from notchflex.mechanics.chain import bending_normal
from notchflex.sensing.readings import Readings
from notchflex.solver.residual import SolverState
from notchflex.support import AXES, Change, ExternalLoad, check_integer, short_repr


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
    base_rotation: tuple[float, float, float] = NO_VECTOR
    body: int | None = None

    def load(self, components: Float[np.ndarray, " d"]) -> ExternalLoad:
        """Return the external loads with some components of the force, N."""
        force = components @ self.directions
        if self.body is None:
            at_tip = np.asarray(self.known.tip_force, float) + force
            return replace(self.known, tip_force=tuple(at_tip.tolist()))
        more = BodyForce(self.body, tuple(force.tolist()))
        return replace(self.known, body_forces=(*self.known.body_forces, more))

    def on(self, body: int | None) -> UnknownForce:
        """Return the same force on another body."""
        return replace(self, body=body)


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
    turn = getattr(known, "base_rotation", NO_VECTOR)
    return UnknownForce(tuple(letters), directions, loads, turn, _body(robot, place))


def _default_axes(robot: Robot) -> str:
    """Axes across the straight tube in the plane in which the robot bends, or both."""
    normal = bending_normal(robot)
    if normal is None:
        return "xy"
    across: Sequence[str] = [
        axis for axis, part in zip("yx", normal, strict=False) if abs(part) > 1e-9
    ]
    return "".join(sorted(across))


def _body(robot: Robot, place: int | str) -> int | None:
    if place in ("tip", "search"):
        return None
    if isinstance(place, str):
        raise InputError.UNKNOWN_NAME(
            f'place is "tip", "search" or the number of a body; got {short_repr(place)}'
        )
    body = check_integer(place, "place")
    if not 1 <= body <= robot.number_of_notches:
        raise InputError.OUT_OF_RANGE(
            f"place must be a body from 1 to {robot.number_of_notches}; got {body}"
        )
    return body


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
    measured: Float[np.ndarray, " m"]
    entries: np.ndarray
    variance: Float[np.ndarray, " m"]
    noise: Float[np.ndarray, " m"]
    resolution: Float[np.ndarray, " m"]
    driving: Float[np.ndarray, " t"]


@dataclass(frozen=True, eq=False)
class SensingModel:
    """A robot whose sensors are read while an unknown force acts on it.

    Attributes:
        robot: The robot.
        readings: What was read.
        unknown: The force that is looked for.
        largest: Largest component of it, N.
        settings: Tolerance and limits of the solver.
    """

    robot: Robot
    readings: Readings
    unknown: UnknownForce
    largest: float
    settings: Settings

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
        self, start: SolverState | None, number: int, forces: Float[np.ndarray, "k d"]
    ) -> EquilibriumPath:
        """Solve a reading with some forces, each from the same state; rest where it is None."""
        load = self.load([number] * len(forces), forces)
        return self._each.solve(self.robot, load, start)

    def between_readings(
        self, start: SolverState, number: int, forces: Float[np.ndarray, "2 d"]
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
            return np.zeros(self._width)
        at_once = self.load(rows, forces)
        middle = self.unknown.load(forces.mean(axis=0))
        halves = LoadPath.of_valid(
            np.stack([at_once.tension.mean(axis=0), at_once.tension[1]]),
            np.stack([at_once.stroke.mean(axis=0), at_once.stroke[1]]),
            at_once.base_rotation,
            (middle, at_once.external[1]),
        )
        ways = [self._along.solve(self.robot, halves, start), self.solve(start, number, forces[1:])]
        first, second = (self.values(way)[-1] for way in ways)
        return np.nan_to_num(first - second)

    @property
    def _width(self) -> int:
        read = self.readings.read
        return sum(read[name].shape[1] for name in self.outputs)

    def follow(self, forces: Float[np.ndarray, "s d"]) -> EquilibriumPath:
        """Follow the whole history with a force in every reading."""
        return self._along.solve(self.robot, self.load(range(len(forces)), forces))

    def values(self, path: EquilibriumPath) -> Float[np.ndarray, "k outputs"]:
        """Return what the sensors would read; NaN where it did not converge."""
        columns = [np.asarray(path.quantity(name)) for name in self.outputs]
        values = np.concatenate([one.reshape(len(path), -1) for one in columns], axis=1)
        return np.where(path.converged[:, None], values, np.nan)

    def slopes(
        self, path: EquilibriumPath, *, of_drives: bool = False
    ) -> Float[np.ndarray, "k outputs u"]:
        """Return the change of what is read by each component, or by each tendon's command."""
        every = self.drive_changes(path) if of_drives else self.force_changes(path)
        tangents = PathTangents(path, self.outputs, remembers=False)
        columns = []
        directions = [Change(np.tile(change, (len(path), 1)), None) for change in every]
        for along in tangents.along(directions):
            parts = [along[name].reshape(len(path), -1) for name in self.outputs]
            columns.append(np.concatenate(parts, axis=1))
        return np.stack(columns, axis=-1)

    def drive_slopes(
        self, start: SolverState | None, path: EquilibriumPath, number: int
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
        load, count = path.load, len(width)
        moves = np.concatenate([np.diag(width), -np.diag(width)])
        moved = LoadPath.of_valid(
            np.maximum(load.tension + moves, 0.0),  # NaN stays NaN: not commanded
            load.stroke + moves,
            load.base_rotation,
            load.external * len(moves),
        )
        values = self.values(self._each.solve(self.robot, moved, start))
        solved = np.asarray(np.isfinite(values).all(axis=1))
        values = np.where(solved[:, None], values, self.values(path))
        over = width * solved.reshape(2, count).sum(axis=0)
        apart = values[:count] - values[count:]
        return np.asarray(apart.T / np.where(over > 0.0, over, np.inf))

    def force_changes(self, path: EquilibriumPath) -> list[Float[np.ndarray, " command"]]:
        """Change of a packed load by a unit of each component; loads are linear in them."""
        load = path.load
        kind = tuple(np.isnan(load.stroke[0]).tolist())
        if kind not in self._changes:
            forces = np.concatenate([np.zeros((1, self.size)), np.eye(self.size)])
            external = tuple(map(self.unknown.load, forces))
            tension, stroke = (
                np.tile(one[:1], (len(forces), 1)) for one in (load.tension, load.stroke)
            )
            probe = LoadPath.of_valid(tension, stroke, load.base_rotation, external)
            packed = make_commands(probe, self.robot, path.chain).packed()
            self._changes[kind] = list(packed[1:] - packed[0])
        return self._changes[kind]

    @cached_property
    def _changes(self) -> dict[tuple[bool, ...], list[Float[np.ndarray, " command"]]]:
        return {}

    def drive_changes(self, path: EquilibriumPath) -> list[Float[np.ndarray, " command"]]:
        """Change of a packed load by a unit of what drives each tendon."""
        form = path.prepared.command_layout(path.commands)
        none = form.unpack(np.zeros(form.size))
        units = np.eye(path.chain.tendons)
        return [np.asarray(form.pack(none._replace(target=constant(row)))) for row in units]

    @cached_property
    def _each(self) -> ForwardModel:
        return self._model(True)

    @cached_property
    def _along(self) -> ForwardModel:
        return self._model(False)

    def _model(self, from_rest: bool) -> ForwardModel:
        probe = self.load([0], np.full((1, self.size), 1.0))
        return ForwardModel(self.robot, probe, self.settings, from_rest=from_rest)
