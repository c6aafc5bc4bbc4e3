"""Model less measurement at every measured row, with derivatives."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np
from jaxtyping import Float, Int
from scipy.spatial.transform import Rotation
from scipy.stats import mannwhitneyu
from scipy.stats import t as student

from notchflex import EquilibriumPath, LoadPath, Robot, Settings
from notchflex._jax import constant
from notchflex.analysis.forward_model import ForwardModel
from notchflex.analysis.kinematics import (
    AxisPlaces,
    axis_places,
    axis_point_changes,
    points_on_axis,
)
from notchflex.fit.measurements.measurements import OBSERVED, Measurements
from notchflex.fit.model.constants import RobotNumber
from notchflex.mechanics.motion import left_slope
from notchflex.support import DEGREES, Change, changes, derivatives, load_change

# Probability below which means of branches differ by more than chance; the least rows of a branch.
_UNLIKELY, _ROWS = 0.01, 3
# A scatter below this part of the difference is rounding; a difference below this part of all
# residuals is not what the model misses.
_EXACT, _SHARE = 1e-9, 0.5


def branch_difference(
    off: Float[np.ndarray, " p"], branch: Int[np.ndarray, " p"]
) -> tuple[float, float] | None:
    """Compare measurement less model on loading rows (1) and unloading rows (-1).

    The means differ if neighbouring rows scatter by much less (Student's t with the scatter of
    second differences, von Neumann 1941), or by ranks (Mann and Whitney 1947) if the hysteresis is
    large in some rows only; and by no less than half of what the model misses in all. Return both
    means; None if they do not differ, or a branch has too few rows.

    Example:
        >>> off = np.array([-1.0, -1.1, -0.9, -1.0, -1.1, 1.0, 1.2, 0.9, 1.0, 1.1])
        >>> round(branch_difference(off, np.repeat([1, -1], 5))[1], 2)
        1.04
    """
    up, down = (off[(branch == sign) & np.isfinite(off)] for sign in (1, -1))
    if min(len(up), len(down)) < _ROWS:
        return None
    loading, unloading = float(np.mean(up)), float(np.mean(down))
    difference = abs(unloading - loading)
    both = np.concatenate([up, down])
    if difference <= _SHARE * float(np.sqrt(np.mean(both**2))):
        return None
    error = np.sqrt(sum(np.mean(np.diff(one, 2) ** 2) / 6.0 / len(one) for one in (up, down)))
    if error <= _EXACT * difference:
        return loading, unloading
    chance = 2.0 * float(student.sf(difference / error, max(0.5 * len(both) - 2.0, 1.0)))
    ranks: Any = mannwhitneyu(up, down)
    return (loading, unloading) if min(chance, float(ranks.pvalue)) < _UNLIKELY else None


def branch_words(
    off: Float[np.ndarray, " p"], quantity: str, measured: Measurements
) -> tuple[str, ...]:
    """Say how measurement less model (rad) differs between the branches, and what to do."""
    means = branch_difference(off, measured.branches)
    if means is None:
        return ()
    loading, unloading = (
        f"{abs(mean) * DEGREES:.2g} deg {'above' if mean > 0.0 else 'below'}" for mean in means
    )
    what = "" if quantity == "total_angle" else " (mean of the notches)"
    advice = (
        "they were taken as loaded from rest. If the rows are one loading path, say so: --path, or "
        "a column from_rest of 0."
        if measured.from_rest
        else "the hysteresis of the model is not that of the data."
    )
    return (
        f"Unloading rows of {measured.source} are {unloading} the model and loading rows "
        f"{loading} it{what}: {advice}",
    )


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
            slopes = derivatives(path, self._changes(path, load, values), solved)
        if self._places is not None:
            bodies = [outputs[name] for name in _BODIES]
            outputs["axis_points"] = np.asarray(
                points_on_axis(self._places, *map(constant, bodies))
            )
            if slopes:
                moves = [slopes[name] for name in _BODIES]
                slopes["axis_points"] = axis_point_changes(self._places, bodies, moves)
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
        load = self.measured.load[self._order]
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

    def _changes(
        self, path: EquilibriumPath, load: LoadPath, values: Float[np.ndarray, " k"]
    ) -> list[Change]:
        """Changes of the robot and of its loads with every constant: sums over what it sets."""
        columns = {column: row for row, column in enumerate(self.columns)}
        along = np.zeros((len(columns), len(self.numbers)))
        for number, (one, setter) in enumerate(zip(self.numbers, self.setters, strict=True)):
            if setter in columns:
                along[columns[setter], number] = one.slope
        paths = [one.path for one in self.numbers]
        of_robot = [number for number, name in enumerate(paths) if name not in SENSOR]
        made = changes(path, [paths[number] for number in of_robot], along[:, of_robot])
        for number, name in enumerate(paths):
            rows = np.flatnonzero(along[:, number]) if name in SENSOR else ()
            for row in rows:
                more = along[row, number] * self._load_change(path, load, values, name)
                loads = made[row].loads
                made[row] = replace(made[row], loads=more if loads is None else loads + more)
        return made

    def _load_change(
        self, path: EquilibriumPath, load: LoadPath, values: Float[np.ndarray, " k"], name: str
    ) -> Float[np.ndarray, "p command"]:
        command = SENSOR[name]
        value, factor = getattr(load, command), self._set(values).get("sensor.force_factor", 1.0)
        # Loads are linear in tension and stroke; below 0 N the robot has none.
        size = {"sensor.force_offset": factor, "sensor.stroke_slack": 1.0}.get(name)
        more = value / factor if size is None else np.where(value > 0.0, size, 0.0)
        varied = load_change(path, replace(load, **{command: value + more}))
        return varied if size is None else -varied


ANGLES = ("notch_angle", "total_angle", "edge_angle", "total_edge_angle")
LENGTHS = ("tip_position", "axis_points")


@dataclass(frozen=True, eq=False)
class Residuals:
    """Model less measurement, R numbers, and what each belongs to.

    Attributes:
        values: Model less measurement (rad, mm, N), (R,).
        slopes: Their derivatives by the constants, (R, k).
        sample: Number of the measurements that each belongs to.
        robot: Number of the robot.
        row: Row of the measurements.
        quantity: Number in `OBSERVED`.
        part: Component of the quantity (a notch, a coordinate).
        pull: Pull, counted over all measurements.
        point: Point in space, for coordinates; of its own for each other number.
        rows: Number of rows measured of that robot.
        given: Standard deviation given with the measurement; NaN if there is none.
        spread: Derivatives by deviations from the drawing, in standard deviations of their
            tolerances, (R, m).
        expected: The mean of these deviations times `spread`, (R,) or 0.
    """

    values: Float[np.ndarray, " r"]
    slopes: Float[np.ndarray, "r k"]
    sample: Int[np.ndarray, " r"]
    robot: Int[np.ndarray, " r"]
    row: Int[np.ndarray, " r"]
    quantity: Int[np.ndarray, " r"]
    part: Int[np.ndarray, " r"]
    pull: Int[np.ndarray, " r"]
    point: Int[np.ndarray, " r"]
    rows: Int[np.ndarray, " r"]
    given: Float[np.ndarray, " r"]
    spread: Float[np.ndarray, "r m"]
    expected: Float[np.ndarray, " r"] | float = 0.0

    def __len__(self) -> int:
        """Number of measured numbers."""
        return len(self.values)

    def of(self, sample: int, quantity: str) -> np.ndarray:
        """Return whether each number belongs to a quantity of some measurements, (R,)."""
        return (self.sample == sample) & (self.quantity == OBSERVED.index(quantity))

    def root_mean_squares(self) -> dict[str, float]:
        """Return the root mean square by quantity (rad, mm, N)."""
        return {
            OBSERVED[number]: float(np.sqrt(np.mean(self.values[self.quantity == number] ** 2)))
            for number in np.unique(self.quantity)
        }


def misfit(
    name: str, measured: Measurements, predicted: Predicted
) -> tuple[Float[np.ndarray, "p c"], Float[np.ndarray, "k p c"]]:
    """Return model less measurement of a quantity, rows by components, and its derivatives.

    Both are NaN where nothing was measured.
    """
    observed, output = measured.observed[name], OUTPUTS.get(name, name)
    values = predicted.values[output]
    slopes = predicted.slopes.get(output, np.zeros((0, *values.shape)))
    if name == "tip_rotation":
        return _turned(observed, values, slopes)
    if name == "tip_tension":
        last = np.isfinite(values[0]).sum(axis=-1) - 1
        tendons = np.arange(len(last))
        values, slopes = values[:, tendons, last], slopes[:, :, tendons, last]
    if name == "total_edge_angle":
        values, slopes = values.sum(axis=-1), slopes.sum(axis=-1)
    values = (values - observed).reshape(len(observed), -1)
    return values, slopes.reshape(len(slopes), *values.shape)


def _turned(
    observed: Float[np.ndarray, "p 3"],
    rotation: Float[np.ndarray, "p 3 3"],
    slopes: Float[np.ndarray, "k p 3 3"],
) -> tuple[Float[np.ndarray, "p 3"], Float[np.ndarray, "k p 3"]]:
    """Rotation vectors from the measured to the model's orientation, and their derivatives."""
    turned = Rotation.from_matrix(rotation) * Rotation.from_rotvec(np.nan_to_num(observed)).inv()
    vector = turned.as_rotvec()
    spin = slopes @ np.swapaxes(rotation, -1, -2)
    turn = np.stack([spin[..., 2, 1], spin[..., 0, 2], spin[..., 1, 0]], axis=-1)
    by_turn = np.linalg.inv(np.asarray(left_slope(constant(vector))))
    values = np.where(np.isnan(observed), np.nan, vector)
    return values, np.einsum("pij,kpj->kpi", by_turn, turn)
