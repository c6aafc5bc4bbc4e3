"""One robot of a design, solved under its states: readings with exact slopes."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, field
from functools import cached_property, partial
from itertools import compress

import numpy as np
from jaxtyping import Bool, Float

from notchflex import EquilibriumPath, InputError, LoadPath, Robot, batch, closing
from notchflex.analysis.forward_model import ForwardModel, slope
from notchflex.designing.model.quantities import (
    OF_ROBOTS,
    OF_STATES,
    Bodies,
    Reading,
    distances,
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
    number_at,
    numbers_at,
)

BODIES = ("body_position", "body_rotation")


@dataclass(frozen=True, eq=False)
class Point:
    """A robot, and what was solved of it.

    Slopes are by the ranges of the variables, then by the standard deviations of what deviates.

    Attributes:
        x: The vector of variables.
        robot: Its robot.
        paths: The layout of the states.
        arrays: Quantities of every step of all states, in the units of Python.
        slopes: Their slopes, what varies as leading axis; empty for values only.
        names: Single numbers of the robot that vary.
        along: By how much each of them does; no rows for values only.
        closing_tensions: Closing tensions, N, where they are known without the robot.
    """

    x: Float[np.ndarray, " v"]
    robot: Robot
    paths: StatePaths
    arrays: Mapping[str, np.ndarray]
    slopes: Mapping[str, np.ndarray] = field(default_factory=dict[str, np.ndarray])
    names: tuple[str, ...] = ()
    along: Float[np.ndarray, "v names"] = field(default_factory=lambda: np.zeros((0, 0)))
    closing_tensions: Float[np.ndarray, " n"] | None = None

    def of_state(self, name: str, state: str) -> Reading:
        """Return a quantity of a state, flat, in the unit of the edges."""
        return self._at(name, self.paths.step[state]).scaled(OF_STATES[name].scale)

    def _at(self, name: str, step: int) -> Reading:
        return Reading.of(
            self.arrays[name][step], self.slopes[name][:, step] if self.slopes else ()
        )

    def closings(self) -> Reading:
        """Return closing tensions, N; NaN for a notch that does not close."""
        return self._closings

    @cached_property
    def _closings(self) -> Reading:
        if self.closing_tensions is not None:
            return Reading.of(self.closing_tensions)
        table = closing(self.robot)
        if not len(self.along):
            return Reading.of(table.tension)
        return Reading.of(table.tension, self.along @ table.jacobian(self.names)["tension"].T)

    def of_robot(self, name: str) -> Reading:
        """Return a quantity of the robot alone."""
        return self._of_robot(OF_ROBOTS[name].formula)

    def _of_robot(self, formula: Callable[[Robot], np.ndarray]) -> Reading:
        numbers = np.array([number_at(self.robot, name) for name in self.names])

        def moved(part: float, row: np.ndarray) -> np.ndarray:
            values = dict(zip(self.names, (numbers + part * row).tolist(), strict=True))
            changed = {name: values[name] for name in compress(self.names, row)}
            return formula(self.robot.with_values(changed) if changed else self.robot)

        slopes = [slope(partial(moved, row=row), 0.0, order=2) for row in self.along]
        return Reading.of(formula(self.robot), slopes)

    def value(self, path: str) -> Reading:
        """Return the values of the robot file."""
        numbers = numbers_at(self.robot, path)
        by = [self.along @ np.array([one == name for one in self.names], float) for name in numbers]
        return Reading(np.column_stack([[*numbers.values()], by]))

    def compliance(self, state: str, direction: Direction) -> Reading:
        """Return tip compliance along a direction, mm/N: a force to either side, and its travel."""
        plus, minus = (
            self._at("tip_position", self.paths.step[Probe(state, direction, side)])
            for side in (1, -1)
        )
        return plus.minus(minus).map(np.array([direction]) / (2.0 * PROBE))

    def curve(self, curve: TargetCurve) -> Reading:
        """Return the distances of the points of a curve, mm."""
        return distances(self.offsets(curve))

    def offsets(self, curve: TargetCurve) -> Reading:
        """Return the vectors from the points of a curve to the axis, mm."""
        step = self.paths.step[curve.state]
        bodies = Bodies(*(self.arrays[name][step] for name in BODIES))
        slopes = Bodies(*(self.slopes[name][:, step] for name in BODIES)) if self.slopes else None
        lengths = self._of_robot(lambda robot: robot.geometry.body_length).slopes.T
        return offsets(self.robot, bodies, target_points(curve), slopes, lengths)


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

    def path(self, x: Float[np.ndarray, " v"]) -> EquilibriumPath | None:
        """Return the states of the robot of a vector; None if there are none."""
        if not self.paths.pieces:
            return None
        robot, load = self.variables.robot_at(x), self._loads(x)
        return ForwardModel(robot, load, from_rest=self.paths.from_rest).solve(robot, load)

    def _loads(self, x: Float[np.ndarray, " v"]) -> LoadPath:
        return self.paths.path(self.variables.loads_at(x))

    def deviations(self, robot: Robot) -> Sequence[Deviation]:
        """Return what deviates of a robot within the tolerances."""
        return deviations_of(robot, self.variables.tolerances)

    def point(self, x: Float[np.ndarray, " v"]) -> Point:
        """Solve the robot of a vector, and differentiate it.

        Raises:
            InputError: No robot can have these values, or a state does not converge.
        """
        x = self.variables.on_grid(x)
        robot = self.variables.robot_at(x)
        self.counts["solves"] += 1
        names, along = self._varied(robot)
        path = self.path(x)
        if path is None:
            return Point(x, robot, self.paths, {}, {}, names, along)
        if not path.converged.all():
            raise InputError.NOT_CONVERGED(path.failures[int(np.argmin(path.converged))][1])
        self.counts["gradients"] += 1
        arrays = {name: np.asarray(path.quantity(name)) for name in self.outputs}
        slopes = derivatives(path, self._changes(path, x, names, along), self.outputs)
        for name, by in slopes.items():
            if (
                REGISTERED[name].kind is float
                and not np.isfinite(by[:, np.isfinite(arrays[name])]).all()
            ):
                raise InputError.NOT_CONVERGED(
                    f"a step was so hard that the derivatives of {name} are not known; "
                    "give the state more `steps`"
                )
        return Point(x, robot, self.paths, arrays, slopes, names, along)

    def _varied(self, robot: Robot) -> tuple[tuple[str, ...], Float[np.ndarray, "v names"]]:
        """Return the single numbers that vary, and by how much with everything that varies."""
        variables, deviations = self.variables, self.deviations(robot)
        paths = [path for column in variables.columns for path in column.weights]
        paths += [path for one in deviations for path in one.sd]
        names = tuple(dict.fromkeys(name for path in paths for name in numbers_at(robot, path)))
        along = [variables.parts_of(name) * variables.span for name in names]
        by_variable = np.reshape(along, (len(names), len(variables.columns))).T
        by_deviation = [[one.sd.get(name, 0.0) for name in names] for one in deviations]
        return names, np.concatenate(
            [by_variable, np.reshape(by_deviation, (len(deviations), len(names)))]
        )

    def _changes(
        self, path: EquilibriumPath, x: np.ndarray, names: Sequence[str], along: np.ndarray
    ) -> list[Change]:
        directions = changes(path, names, along)
        for number, column in enumerate(self.variables.columns):
            if column.load is not None:  # loads are linear in it
                more = x + np.eye(len(x))[number] * column.span
                directions[number] = Change(load_change(path, self._loads(more)), None)
        return directions

    def points(self, vectors: Sequence[np.ndarray]) -> list[Callable[[], Point]]:
        """Solve the robots of several vectors at once, for values only.

        Returns:
            Functions that return a point, or raise why there is none.
        """
        robots: dict[int, Robot] = {}
        for number, x in enumerate(vectors):
            with suppress(InputError):
                robots[number] = self.variables.robot_at(x)
        self.counts["solves"] += len(robots)
        arrays, converged = self.rows([*robots.values()], [vectors[k] for k in robots], {})
        rows = {number: row for row, number in enumerate(robots)}

        def point(number: int) -> Point:
            if number not in robots:
                self.variables.robot_at(vectors[number])
            row = rows[number]
            if not converged[row]:
                raise InputError.NOT_CONVERGED("a state does not converge")
            states = {name: values[row] for name, values in arrays.items()}
            return Point(vectors[number], robots[number], self.paths, states)

        return [partial(point, number) for number in range(len(vectors))]

    def rows(
        self,
        robots: Robot | Sequence[Robot],
        vectors: Sequence[np.ndarray],
        numbers: Mapping[str, np.ndarray],
    ) -> tuple[dict[str, np.ndarray], Bool[np.ndarray, " robots"]]:
        """Solve robots by batches.

        Args:
            robots: The robots.
            vectors: The vector of each, or one for all, of which the loads are.
            numbers: Numbers of each by name, where they are not those of `robots`.

        Returns:
            Quantities of every step of all robots, and whether all their steps converged.
        """
        if robots == [] or not self.paths.pieces:
            return {}, np.ones(len(next(iter(numbers.values()), vectors)), bool)
        loads = [self._loads(x) for x in vectors]
        ends = np.cumsum(self.paths.lengths)
        pieces = [
            batch(robots, numbers, [path[start:end] for path in loads], outputs=self.outputs)
            for start, end in zip(ends - self.paths.lengths, ends, strict=True)
        ]
        arrays = {name: np.concatenate([one[name] for one in pieces], axis=1) for name in pieces[0]}
        return arrays, np.asarray(arrays["converged"].all(axis=1))
