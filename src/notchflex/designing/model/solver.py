"""Solving robots of one form under the states of a design."""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property

import numpy as np
from jaxtyping import Float

from notchflex._quantity import REGISTERED
from notchflex.analysis.derivatives.forward_model import ForwardModel
from notchflex.analysis.derivatives.tangent import Change
from notchflex.designing.model.load_states import StatePaths
from notchflex.designing.model.point import Point
from notchflex.designing.model.variables import LoadNumber, Variables
from notchflex.errors import InputError
from notchflex.loads import LoadPath
from notchflex.results.path import EquilibriumPath
from notchflex.robot import Robot


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
        robot = self.variables.robot_at(x)
        self.counts["solves"] += 1
        if not self.paths.pieces:
            return self._without_states(robot, x)
        load = self.path_at(x)
        model = self._model(robot, load)
        path = model.solve(robot, load)
        if not path.converged.all():
            step = int(np.argmin(path.converged))
            raise InputError.NOT_CONVERGED(path.failures[step][1])
        arrays = {name: np.asarray(path.quantity(name)) for name in self.outputs}
        slopes: dict[str, np.ndarray] = {}

        def slopes_of(name: str) -> np.ndarray:
            if not slopes:
                self.counts["gradients"] += 1
                slopes.update(self._slopes(point, model, path))
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

    def _slopes(
        self, point: Point, model: ForwardModel, path: EquilibriumPath
    ) -> dict[str, np.ndarray]:
        changes: list[Change] = []
        for number, column in enumerate(self.variables.columns):
            change = point.change(model, path.load, number)
            if column.load is not None:
                change = Change(self._load_change(model, path, point.x, column.load), change.chain)
            changes.append(change)
        changes += point.changes_of_deviations(model, path.load)
        derivatives = model.derivatives(path, changes, self.outputs)
        wrong = [name for name, one in derivatives.items() if not _known(name, one, path)]
        if wrong:
            raise InputError.NOT_CONVERGED(
                f"a step was so hard that the derivatives of {wrong[0]} are not known; "
                "give the state more `steps`"
            )
        return derivatives

    def _load_change(
        self, model: ForwardModel, path: EquilibriumPath, x: np.ndarray, number: LoadNumber
    ) -> np.ndarray:
        numbers = self.variables.loads_at(x)
        more = self.paths.path(numbers | {number: numbers[number] + 1.0})
        return model.load_change(path, more)


def _known(name: str, slopes: np.ndarray, path: EquilibriumPath) -> bool:
    """Whether derivatives are known wherever the quantity itself is a number."""
    is_finite = np.isfinite(np.asarray(path.quantity(name)))
    return REGISTERED[name].kind is not float or bool(np.isfinite(slopes[:, is_finite]).all())
