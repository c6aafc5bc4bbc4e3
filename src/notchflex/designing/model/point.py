"""One robot of a design, solved under its states: readings with exact derivatives."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property, partial
from typing import Any

import numpy as np
from jaxtyping import Float

from notchflex import Closing, EquilibriumPath, InputError, LoadPath, Robot, closing
from notchflex.analysis.forward_model import ForwardModel, slope
from notchflex.analysis.slopes import change_along
from notchflex.designing.model.quantities import (
    OF_ROBOTS,
    Bodies,
    Reading,
    distances,
    edge_unit,
    offsets,
    target_points,
)
from notchflex.designing.model.variables import (
    PROBE,
    Deviation,
    Direction,
    Probe,
    StatePaths,
    Variables,
    deviations_of,
)
from notchflex.designing.specification import TargetCurve
from notchflex.support import (
    REGISTERED,
    Change,
    changes,
    derivatives,
    load_change,
    numbers_at,
)

CLOSINGS = "closing tensions"
"""Under what a `Point` keeps closing tensions (N) that are known without it, for values only."""


@dataclass(frozen=True, eq=False)
class Point:
    """A vector of variables, its robot, and what was solved of it.

    Attributes:
        variables: The variables.
        x: The vector.
        robot: Its robot.
        paths: The layout of the states.
        arrays: Quantities of every step of all states, in the units of Python.
        slopes_of: Gives the derivatives of quantities of all steps, variables as leading axis;
            None for values only.
        kept: What was worked out already.
    """

    variables: Variables
    x: Float[np.ndarray, " v"]
    robot: Robot
    paths: StatePaths
    arrays: Mapping[str, np.ndarray]
    slopes_of: Callable[[str], np.ndarray] | None = None
    kept: dict[Any, Any] = field(default_factory=dict[Any, Any])

    @property
    def plain(self) -> Point:
        """The same for values only."""
        return replace(self, slopes_of=None)

    def of_state(self, name: str, state: str) -> Reading:
        """Return a quantity of a state, flat, in the unit of the edges."""
        return self._at(name, self.paths.step[state]).scaled(edge_unit(name)[1])

    def _at(self, name: str, step: int) -> Reading:
        values = np.ravel(self.arrays[name][step])
        if self.slopes_of is None:
            return Reading(values, None)
        slopes = self.slopes_of(name)[:, step]
        return Reading(values, slopes.reshape(len(slopes), -1).T)

    def closings(self) -> Reading:
        """Return closing tensions, N; NaN for a notch that does not close."""
        if CLOSINGS in self.kept:
            return Reading(self.kept[CLOSINGS], None)
        table: Closing = self.once("closing", lambda: closing(self.robot))
        if self.slopes_of is None or not np.isfinite(table.tension).all():
            return Reading(table.tension, None)

        def slopes() -> np.ndarray:
            return table.along(self.directions)[0]

        return Reading(table.tension, self.once("closing slopes", slopes))

    def once(self, key: Any, compute: Callable[[], Any]) -> Any:
        """Return what was worked out before under a key, or work it out."""
        if key not in self.kept:
            self.kept[key] = compute()
        return self.kept[key]

    def of_robot(self, name: str) -> Reading:
        """Return a quantity of the robot alone."""
        return self._of_robot(OF_ROBOTS[name].formula)

    def value(self, path: str) -> Reading:
        """Return the values of the robot file."""
        numbers = numbers_at(self.robot, path)
        values = np.array(list(numbers.values()))
        if self.slopes_of is None:
            return Reading(values, None)
        slopes = np.stack([self.variables.parts_of(one) for one in numbers])
        by = [[self._deviates(one, path) for one in self.deviations] for path in numbers]
        return Reading(values, np.hstack([slopes, np.reshape(by, (len(values), -1))]))

    def _deviates(self, deviation: Deviation, path: str) -> float:
        sds = (sd for name, sd in deviation.sd.items() if path in numbers_at(self.robot, name))
        return next(sds, 0.0)

    def _of_robot(self, formula: Callable[[Robot], np.ndarray]) -> Reading:
        values = formula(self.robot)
        if self.slopes_of is None:
            return Reading(values, None)
        slopes = [
            np.zeros(len(values))
            if column.load is not None
            else slope(lambda t, n=number: formula(self.moved(n, t)), 0.0, order=2) / column.span
            for number, column in enumerate(self.variables.columns)
        ]
        slopes += [
            slope(lambda t, one=one: formula(one.moved(self.robot, t)), 0.0, order=2)
            for one in self.deviations
        ]
        return Reading(values, np.stack(slopes, axis=1))

    @property
    def deviations(self) -> Sequence[Deviation]:
        """Deviations of robots within the tolerances."""
        tolerances = self.variables.tolerances
        return self.once("deviations", lambda: deviations_of(self.robot, tolerances))

    def compliance(self, state: str, direction: Direction) -> Reading:
        """Return tip compliance along a direction, mm/N: a force to either side, and its travel."""
        plus, minus = (
            self._at("tip_position", self.paths.step[Probe(state, direction, side)])
            for side in (1, -1)
        )
        row = np.array([direction]) / (2.0 * PROBE)
        return plus.minus(minus).map(row)

    def curve(self, curve: TargetCurve) -> Reading:
        """Return the distances of the points of a curve, mm."""
        return distances(self.offsets(curve))

    def offsets(self, curve: TargetCurve) -> Reading:
        """Return the vectors from the points of a curve to the axis, mm."""
        step, points = self.paths.step[curve.state], target_points(curve)
        poses = [self.arrays[name][step] for name in ("body_position", "body_rotation")]
        if self.slopes_of is None:
            return offsets(self.robot, Bodies(*poses), points, None)
        lengths = self._of_robot(lambda one: one.geometry.body_length).slopes
        assert lengths is not None
        changes = [self.slopes_of(name)[:, step] for name in ("body_position", "body_rotation")]
        return offsets(self.robot, Bodies(*poses, *changes), points, lengths.T)

    def moved(self, number: int, part: float) -> Robot:
        """Return the robot with a variable moved by a part of its span."""
        x = self.x.copy()
        x[number] += part * self.variables.columns[number].span
        return self.once(("robot", number, part), lambda: self.variables.robot_at(x))

    def directions(self, path: EquilibriumPath) -> list[Change]:
        """Return directions of all variables, then of one standard deviation of every deviation.

        Args:
            path: States of the robot, whose loads are taken not to depend on the variables.
        """
        every = [self._change(path, number) for number in range(len(self.x))]
        for one in self.deviations:
            if one.law is not None:
                every += changes(path, [one.law], np.array([[one.sd[one.law]]]))
            else:
                every.append(change_along(path, partial(one.moved, self.robot), 0.0, order=2))
        return every

    def _change(self, path: EquilibriumPath, number: int) -> Change:
        """Return the direction of a variable of the robot; nothing for a load."""
        column = self.variables.columns[number]
        if column.load is not None:
            return Change(None, None)
        if column.law is not None:
            return changes(path, [column.law])[0]
        loaded = any(not one.is_nothing for one in path.load.external)
        key = ("change", number, id(path.prepared.chain_layout))
        if not loaded and key in self.kept:  # the arrays of the robot, without its weight
            return Change(None, self.kept[key])
        by = change_along(path, lambda part: self.moved(number, part), 0.0, order=2)
        assert by.chain is not None
        self.kept[key] = by.chain / column.span
        loads = None if by.loads is None else by.loads / column.span
        return Change(loads, self.kept[key])


@dataclass(frozen=True, eq=False)
class Solver:
    """Solves robots of one form under the states of a design.

    Attributes:
        variables: The variables.
        paths: The layout of the states.
        outputs: Quantities of states that are needed.
        counts: How many robots were solved, and how many differentiated.
    """

    variables: Variables
    paths: StatePaths
    outputs: tuple[str, ...]
    counts: dict[str, int] = field(default_factory=lambda: {"solves": 0, "gradients": 0})

    @cached_property
    def _models(self) -> dict[str, ForwardModel]:
        return {}

    def _model(self, robot: Robot, load: LoadPath) -> ForwardModel:
        if "one" not in self._models:
            from_rest = self.paths.from_rest
            self._models["one"] = ForwardModel(robot, load, from_rest=from_rest)
        return self._models["one"]

    def point(self, x: Float[np.ndarray, " v"]) -> Point:
        """Solve the robot of a vector.

        Raises:
            InputError: No robot can have these values, or a state does not converge.
        """
        x = self.variables.on_grid(x)
        robot = self.variables.robot_at(x)
        self.counts["solves"] += 1
        if not self.paths.pieces:
            return self._without_states(robot, x)
        load = self.path_at(x)
        path = self._model(robot, load).solve(robot, load)
        if not path.converged.all():
            step = int(np.argmin(path.converged))
            raise InputError.NOT_CONVERGED(path.failures[step][1])
        arrays = {name: np.asarray(path.quantity(name)) for name in self.outputs}
        slopes: dict[str, np.ndarray] = {}

        def slopes_of(name: str) -> np.ndarray:
            if not slopes:
                self.counts["gradients"] += 1
                slopes.update(self._slopes(point, path))
            return slopes[name]

        point = Point(self.variables, x, robot, self.paths, arrays, slopes_of)
        return point

    def path_at(self, x: Float[np.ndarray, " v"]) -> LoadPath:
        """Return the loads of a vector."""
        return self.paths.path(self.variables.loads_at(x))

    def path(self, x: Float[np.ndarray, " v"]) -> EquilibriumPath | None:
        """Return the states of the robot of a vector; None if there are none."""
        if not self.paths.pieces:
            return None
        robot = self.variables.robot_at(x)
        load = self.path_at(x)
        return self._model(robot, load).solve(robot, load)

    def _without_states(self, robot: Robot, x: np.ndarray) -> Point:
        def slopes_of(name: str) -> np.ndarray:
            raise KeyError(name)

        return Point(self.variables, x, robot, self.paths, {}, slopes_of)

    def _slopes(self, point: Point, path: EquilibriumPath) -> dict[str, np.ndarray]:
        directions = point.directions(path)
        numbers = self.variables.loads_at(point.x)
        for number, column in enumerate(self.variables.columns):
            if column.load is not None:
                more = self.paths.path(numbers | {column.load: numbers[column.load] + 1.0})
                directions[number] = Change(load_change(path, more), None)
        slopes = derivatives(path, directions, self.outputs)
        wrong = [name for name, one in slopes.items() if not _known(name, one, path)]
        if wrong:
            raise InputError.NOT_CONVERGED(
                f"a step was so hard that the derivatives of {wrong[0]} are not known; "
                "give the state more `steps`"
            )
        return slopes


def _known(name: str, slopes: np.ndarray, path: EquilibriumPath) -> bool:
    """Whether derivatives are known wherever the quantity itself is a number."""
    is_finite = np.isfinite(np.asarray(path.quantity(name)))
    return REGISTERED[name].kind is not float or bool(np.isfinite(slopes[:, is_finite]).all())
