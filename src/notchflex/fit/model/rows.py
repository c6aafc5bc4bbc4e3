"""A robot at every measured row, as a function of some of its numbers, with derivatives."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property
from typing import NamedTuple

import numpy as np
from jaxtyping import Float, Int

from notchflex._jax import constant
from notchflex.analysis.axis_points import (
    AxisPlaces,
    axis_places,
    axis_point_changes,
    points_on_axis,
)
from notchflex.analysis.derivatives.forward_model import Change, ForwardModel
from notchflex.fit.measurements.measurements import Measurements, rows_of
from notchflex.fit.model.constants import RobotNumber
from notchflex.loads.load_path import LoadPath
from notchflex.results.path import EquilibriumPath
from notchflex.robot import Robot
from notchflex.solver.newton import Settings

SENSOR = {
    "sensor.force_offset": "tension",
    "sensor.force_factor": "tension",
    "sensor.stroke_slack": "stroke",
}
"""Numbers of the measurement itself, and the command that each changes: what a force gauge shows at
no force (N), the tension that acts over the reading less that, and the stroke that only takes up
slack (mm)."""

_NO_SENSOR = {"sensor.force_offset": 0.0, "sensor.force_factor": 1.0, "sensor.stroke_slack": 0.0}

# Outputs of the model that measured quantities are compared with, if of another name.
OUTPUTS = {"tip_tension": "span_tension", "total_edge_angle": "edge_angle"}
_BODIES = ("body_position", "body_rotation")


class Predicted(NamedTuple):
    """Outputs at every row, in the world, by name; rows are the leading axis.

    `slopes` are derivatives, with the numbers in front; empty if a row was not solved.
    """

    values: dict[str, np.ndarray]
    converged: np.ndarray
    slopes: dict[str, np.ndarray]


@dataclass(frozen=True, eq=False)
class Sample:
    """Measurements of one robot, and the model of their rows.

    Attributes:
        label: Label of the robot.
        robot: The robot as it is.
        measured: The measurements.
        numbers: What varies: of the robot by name, or of `SENSOR`.
        setters: Number of the constant that sets each of them.
        pulls: Pull of every row, counted over all measurements.
        settings: Settings of the solver.
    """

    label: str
    robot: Robot
    measured: Measurements
    numbers: tuple[RobotNumber, ...]
    setters: tuple[int, ...]
    pulls: Int[np.ndarray, " p"]
    settings: Settings

    @property
    def columns(self) -> tuple[int, ...]:
        """Numbers of the constants that set something here."""
        return tuple(dict.fromkeys(self.setters))

    def robot_with(self, values: Float[np.ndarray, " k"]) -> Robot:
        """Return the robot with other values of all constants.

        Raises:
            InputError: The robot cannot have them.
        """
        of_robot = {path: value for path, value in self._set(values).items() if path not in SENSOR}
        return self.robot.with_values(of_robot) if of_robot else self.robot

    def predict(self, values: Float[np.ndarray, " k"]) -> Predicted:
        """Return outputs at every row for values of all constants.

        Raises:
            InputError: The robot cannot have them.
        """
        robot, load = self.robot_with(values), self._load(values)
        path = self._model.solve(robot, load)
        names = [OUTPUTS.get(name, name) for name in self.measured.observed]
        solved = tuple(dict.fromkeys(name for name in names if name != "axis_points"))
        if self._places is not None:
            solved = tuple(dict.fromkeys((*solved, *_BODIES)))
        outputs = {name: np.asarray(path.quantity(name)) for name in solved}
        slopes: dict[str, np.ndarray] = {}
        if self.numbers and path.converged.all():
            changes = [self._change(path, load, values, column) for column in self.columns]
            slopes = self._model.derivatives(path, changes, solved)
        if self._places is not None:
            bodies = [outputs[name] for name in _BODIES]
            outputs["axis_points"] = np.asarray(
                points_on_axis(self._places, *map(constant, bodies))
            )
            if slopes:
                changes = [slopes[name] for name in _BODIES]
                slopes["axis_points"] = axis_point_changes(self._places, bodies, changes)
        back = np.argsort(self._order)
        return Predicted(
            {name: outputs[name][back] for name in names},
            path.converged[back],
            {name: slopes[name][:, back] for name in names if name in slopes},
        )

    @cached_property
    def _order(self) -> Int[np.ndarray, " p"]:
        """Rows in the order in which they are solved, pull by pull."""
        number = [self.measured.pulls.index(label) for label in self.measured.pull]
        return np.argsort(number, kind="stable")

    @cached_property
    def _model(self) -> ForwardModel:
        labels = np.array(self.measured.pull)[self._order]
        from_rest = np.append(True, labels[1:] != labels[:-1]) | self.measured.from_rest
        load = rows_of(self.measured.load, self._order)
        return ForwardModel(self.robot, load, self.settings, from_rest=from_rest)

    @cached_property
    def _places(self) -> AxisPlaces | None:
        if "axis_points" not in self.measured.observed:
            return None
        return axis_places(self.robot, self.measured.axis_at)

    def _set(self, values: Float[np.ndarray, " k"]) -> dict[str, float]:
        """The numbers that values of all constants set."""
        numbers = zip(self.numbers, values[list(self.setters)].tolist(), strict=True)
        return {one.path: one.base + one.slope * value for one, value in numbers}

    def _load(self, values: Float[np.ndarray, " k"]) -> LoadPath:
        """The loads of the robot: the measured ones, corrected for the sensor."""
        load, measured, numbers = self._model.load, self.measured, self._set(values)
        if not SENSOR.keys() & numbers.keys():
            return load
        offset, factor, slack = (numbers.get(name, none) for name, none in _NO_SENSOR.items())
        tension = factor * (measured.measured_tension[self._order] - offset)
        acting = {"tension": tension, "stroke": measured.load.stroke[self._order] - slack}
        given = {
            command: np.where(np.isnan(getattr(load, command)), np.nan, np.maximum(true, 0.0))
            for command, true in acting.items()
        }
        return replace(load, **given)

    def _change(
        self, path: EquilibriumPath, load: LoadPath, values: Float[np.ndarray, " k"], column: int
    ) -> Change:
        """Change of the robot and of its loads with a constant: the sum over what it sets."""
        loads, chain = np.zeros(1), np.zeros(1)
        for one, setter in zip(self.numbers, self.setters, strict=True):
            if setter != column or not one.slope:
                continue
            if one.path in SENSOR:
                loads = loads + one.slope * self._load_change(path, load, values, one.path)
                continue
            change = self._model.change(path.robot, load, one.path)
            loads = loads if change.loads is None else loads + one.slope * change.loads
            chain = chain if change.chain is None else chain + one.slope * change.chain
        return Change(*(one if one.any() else None for one in (loads, chain)))

    def _load_change(
        self, path: EquilibriumPath, load: LoadPath, values: Float[np.ndarray, " k"], name: str
    ) -> Float[np.ndarray, "p command"]:
        command = SENSOR[name]
        value, factor = getattr(load, command), self._set(values).get("sensor.force_factor", 1.0)
        # Loads are linear in tension and stroke; below 0 N the robot has none.
        size = {"sensor.force_offset": factor, "sensor.stroke_slack": 1.0}.get(name)
        more = value / factor if size is None else np.where(value > 0.0, size, 0.0)
        varied = self._model.load_change(path, replace(load, **{command: value + more}))
        return varied if size is None else -varied
