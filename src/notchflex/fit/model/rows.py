"""What a robot is predicted to do at every measured row, and how that changes with its numbers.

Rows are steps of the forward model: each from rest, or those of each pull as one path.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import NamedTuple

import numpy as np
from jaxtyping import Float, Int

from notchflex._jax import constant
from notchflex.analysis.axis_points import AxisPlaces, points_on_axis
from notchflex.analysis.derivatives.forward_model import Change, ForwardModel
from notchflex.analysis.derivatives.numbers import slope
from notchflex.fit.measurements.measurements import rows_of
from notchflex.loads.load_path import LoadPath
from notchflex.results.path import EquilibriumPath
from notchflex.robot import Robot
from notchflex.solver.newton import DEFAULT, Settings

SENSOR = ("sensor.force_offset", "sensor.stroke_slack")
"""Numbers of the measurement itself: what a force gauge shows at no force (N), and the stroke that
only takes up slack (mm)."""
_BODIES = ("body_position", "body_rotation")


class Predicted(NamedTuple):
    """Outputs at every row, in the world.

    Attributes:
        values: By name, rows as leading axis.
        converged: Whether the row was solved, (P,).
        slopes: By name, numbers and then rows as leading axes.
    """

    values: dict[str, np.ndarray]
    converged: np.ndarray
    slopes: dict[str, np.ndarray]


@dataclass(frozen=True, eq=False)
class Rows:
    """A robot under the loads of a measurement, as a function of some of its numbers.

    Attributes:
        robot: The robot as it is.
        load: Loads of all rows.
        paths: Rows of every path, in order, each path from rest.
        names: Numbers that vary: of the robot by name, or of `SENSOR`.
        outputs: What is predicted, by names of `EquilibriumPath`; "axis_points" for
            those at `places`.
        measured: Tension (N) or stroke (mm) as measured, rows by tendons; tensions may be those of
            a gauge with an offset, below 0 too.
        places: Points of the tube axis; None where none are asked.
        settings: How hard the solver tries.
    """

    robot: Robot
    load: LoadPath
    paths: tuple[tuple[int, ...], ...]
    names: tuple[str, ...]
    outputs: tuple[str, ...]
    measured: Float[np.ndarray, "p t"]
    places: AxisPlaces | None = None
    settings: Settings = DEFAULT

    @cached_property
    def own(self) -> tuple[str, ...]:
        """Names of the robot's numbers among those that vary."""
        return tuple(name for name in self.names if name not in SENSOR)

    @cached_property
    def model(self) -> ForwardModel:
        """The model of these rows."""
        starts = np.cumsum([0, *map(len, self.paths)])[:-1]
        from_rest = np.isin(np.arange(len(self._order)), starts)
        load = rows_of(self.load, self._order)
        return ForwardModel(self.robot, load, self.settings, from_rest=from_rest)

    def robot_with(self, numbers: Sequence[float] | np.ndarray) -> Robot:
        """The robot with other numbers, in the order of `names`.

        Raises:
            InputError: No robot can have them.
        """
        values = dict(zip(self.names, map(float, numbers), strict=True))
        own = {name: values[name] for name in self.own}
        return self.robot.with_values(own) if own else self.robot

    def at(self, numbers: Float[np.ndarray, " k"]) -> Predicted:
        """Outputs at every row, and their derivatives by all numbers.

        Args:
            numbers: In the order of `names`.

        Raises:
            InputError: No robot can have these numbers.
        """
        robot, load = self.robot_with(numbers), self._load(numbers)
        path = self.model.solve(robot, load)
        names = tuple(name for name in self.outputs if name != "axis_points")
        if self.places is not None:
            names = tuple(dict.fromkeys((*names, *_BODIES)))
        values = {name: np.asarray(path.quantity(name)) for name in names}
        slopes: dict[str, np.ndarray] = {}
        if self.names and path.converged.all():
            changes = [self._change(path, load, name) for name in self.names]
            slopes = self.model.derivatives(path, changes, names)
        if self.places is not None:
            places, bodies = self.places, [values[name] for name in _BODIES]
            values["axis_points"] = _points(places, bodies)
            if slopes:
                moves = zip(*(slopes[name] for name in _BODIES), strict=True)
                every = [_points_slope(places, bodies, move) for move in moves]
                slopes["axis_points"] = np.stack(every)
        back = np.argsort(self._order)
        return Predicted(
            {name: values[name][back] for name in self.outputs},
            path.converged[back],
            {name: slopes[name][:, back] for name in self.outputs if name in slopes},
        )

    @cached_property
    def _order(self) -> Int[np.ndarray, " p"]:
        """Rows in the order in which they are solved, path by path."""
        return np.concatenate([np.array(path) for path in self.paths])

    def _load(self, numbers: Float[np.ndarray, " k"]) -> LoadPath:
        """The loads that the robot had: the measured ones less what the sensor adds."""
        load = self.model.load
        given = dict(zip(self.names, numbers, strict=True))
        for name, field in zip(SENSOR, ("tension", "stroke"), strict=True):
            if name in given:
                true = np.maximum(self._shown - given[name], 0.0)
                load = replace(
                    load, **{field: np.where(np.isnan(getattr(load, field)), np.nan, true)}
                )
        return load

    @cached_property
    def _shown(self) -> Float[np.ndarray, "p t"]:
        return self.measured[self._order]

    def _change(self, path: EquilibriumPath, load: LoadPath, name: str) -> Change:
        if name not in SENSOR:
            return self.model.change(path.robot, load, name)
        field = "tension" if name == SENSOR[0] else "stroke"
        value = getattr(load, field)
        # Loads are linear in tension and stroke; below 0 N the robot has none.
        more = replace(load, **{field: np.where(value > 0.0, value + 1.0, value)})
        return Change(-self.model.load_change(path, more), None)


def _points(places: AxisPlaces, bodies: Sequence[np.ndarray]) -> Float[np.ndarray, "p m 3"]:
    position, rotation = map(constant, bodies)
    return np.asarray(points_on_axis(places, position, rotation))


def _points_slope(
    places: AxisPlaces, bodies: Sequence[np.ndarray], move: Sequence[np.ndarray]
) -> Float[np.ndarray, "p m 3"]:
    """Derivative of the points on the axis along a change of the poses of the bodies."""
    size = max(float(np.max(np.abs(one))) for one in move) or 1.0

    def points(part: float) -> np.ndarray:
        moved = [at + part / size * by for at, by in zip(bodies, move, strict=True)]
        return _points(places, moved)

    return size * slope(points, 0.0)


__all__ = ["SENSOR", "Predicted", "Rows"]
