"""Model less measurement at every measured row, with derivatives by the constants."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np
from jaxtyping import Float
from scipy.spatial.transform import Rotation

from notchflex import EquilibriumPath, InputError, LoadPath, Robot, Settings
from notchflex.analysis import axis_places, axis_points
from notchflex.analysis.kinematics import axis_point_changes
from notchflex.fit.constants import SENSOR, Unknown, values_set, with_numbers
from notchflex.fit.measurements.measurements import (
    MEASURED,
    OBSERVED,
    Flags,
    Integers,
    MeasuredRows,
    Measurements,
    Numbers,
    reading,
)
from notchflex.mechanics.motion import left_slope
from notchflex.support import Change, changes, derivatives, load_change

_BODIES = ("body_position", "body_rotation")


@dataclass(frozen=True, eq=False)
class Sample:
    """Measurements of one robot, and the model of their rows.

    Attributes:
        label: Label of the robot.
        robot: The robot as it is.
        measured: The measurements.
        unknowns: All constants of the fit.
        settings: Settings of the solver.
    """

    label: str
    robot: Robot
    measured: Measurements
    unknowns: tuple[Unknown, ...]
    settings: Settings

    @cached_property
    def own_unknowns(self) -> dict[int, Unknown]:
        """The constants that set something here, by their number."""
        own = enumerate(unknown.only_of([self.label]) for unknown in self.unknowns)
        return {number: unknown for number, unknown in own if unknown.sets}

    @cached_property
    def _rows(self) -> MeasuredRows:
        measured = self.measured
        return MeasuredRows(
            self.robot, measured.load, measured.pull, measured.from_rest, self.settings
        )

    def misfits(self, values: Numbers) -> tuple[Flags, dict[str, tuple[Numbers, Numbers]]]:
        """Return which rows were solved, and by quantity model less measurement with derivatives.

        These are by the constants of `own_unknowns`, as by `misfit`.

        Raises:
            InputError: The robot cannot have such values of all constants.
        """
        numbers = values_set(self.label, self.unknowns, values)
        load, observed = self._load(numbers), self.measured.observed
        path = self._rows.model.solve(with_numbers(self.robot, numbers), load)
        rows = self._rows.sorted_back
        if not path.converged.all():
            return rows(path.converged), {}
        outputs = {name: MEASURED[name].output for name in observed if name != "axis_points"}
        bodies = _BODIES if "axis_points" in observed else ()
        solved = tuple(dict.fromkeys((*outputs.values(), *bodies)))
        modelled = {name: np.asarray(path.quantity(name)) for name in solved}
        slopes = {name: np.zeros((0, *array.shape)) for name, array in modelled.items()}
        if self.own_unknowns:
            slopes = derivatives(path, self._changes(path, load, numbers), solved)
        if bodies:
            poses, moves = ([arrays[name] for name in bodies] for arrays in (modelled, slopes))
            places = axis_places(self.robot, self.measured.axis_at)
            modelled["axis_points"] = axis_points(path, self.measured.axis_at)
            slopes["axis_points"] = axis_point_changes(places, poses, moves)
        return rows(path.converged), {
            name: misfit(name, array, rows(modelled[output]), rows(slopes[output], axis=1))
            for name, array in observed.items()
            for output in [MEASURED[name].output]
        }

    def _load(self, numbers: Mapping[str, float]) -> LoadPath:
        """The loads of the robot: the measured ones, corrected for the sensor."""
        load, order = self._rows.model.load, self._rows.order
        if not SENSOR.keys() & numbers.keys():
            return load
        offset, factor, slack = (numbers.get(name, row.neutral) for name, row in SENSOR.items())
        tension = factor * (self.measured.measured_tension[order] - offset)
        stroke = self.measured.load.stroke[order] - slack
        return replace(load, tension=np.maximum(tension, 0.0), stroke=stroke)

    def _changes(
        self, path: EquilibriumPath, load: LoadPath, numbers: Mapping[str, float]
    ) -> list[Change]:
        """Changes of the robot and of its loads with every constant: sums over what it sets."""
        names = [*numbers]
        along = np.zeros((len(self.own_unknowns), len(names)))
        for row, unknown in enumerate(self.own_unknowns.values()):
            for number in unknown.sets:
                along[row, names.index(number.path)] = number.slope
        of_robot = [number for number, name in enumerate(names) if name not in SENSOR]
        made = changes(path, [names[number] for number in of_robot], along[:, of_robot])
        for name in SENSOR.keys() & numbers.keys():
            # Packed loads are linear in tension and stroke.
            command = SENSOR[name].command
            value, step = getattr(load, command), 1.0 if name == "sensor.force_factor" else -1.0
            moved = getattr(self._load({**numbers, name: numbers[name] + step}), command)
            # Whatever the sensor shows, no tension is below 0 N; tendons are also released.
            acts = (command == "stroke") | (value > 0.0)
            moved = replace(load, **{command: np.where(acts, moved, value)})
            for row in np.flatnonzero(along[:, names.index(name)]):
                change = Change(step * load_change(path, moved), None)
                made[row] = made[row].plus(change, along[row, names.index(name)])
        return made


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
    """

    values: Numbers
    slopes: Numbers
    sample: Integers
    robot: Integers
    row: Integers
    quantity: Integers
    part: Integers
    pull: Integers
    point: Integers
    rows: Integers
    given: Numbers

    def __len__(self) -> int:
        """Number of measured numbers."""
        return len(self.values)

    def of(self, sample: int, quantity: str) -> Flags:
        """Return whether each number belongs to a quantity of some measurements, (R,)."""
        return (self.sample == sample) & self.are(quantity)

    def are(self, *quantities: str) -> Flags:
        """Return whether each number belongs to one of some quantities, (R,)."""
        return np.isin(self.quantity, [OBSERVED.index(name) for name in quantities])

    def root_mean_squares(self) -> dict[str, float]:
        """Return the root mean square by quantity (rad, mm, N)."""
        return {
            OBSERVED[number]: float(np.sqrt(np.mean(self.values[self.quantity == number] ** 2)))
            for number in np.unique(self.quantity)
        }


def misfit(
    name: str, observed: Numbers, values: Numbers, slopes: Numbers
) -> tuple[Float[np.ndarray, "p c"], Float[np.ndarray, "k p c"]]:
    """Return output less measurement of a quantity, rows by components, and its derivatives.

    Both are NaN where nothing was measured.
    """
    if name == "tip_rotation":  # vectors of the rotations from the measured to the model's
        turned = Rotation.from_matrix(values) * Rotation.from_rotvec(np.nan_to_num(observed)).inv()
        vector = turned.as_rotvec()
        spin = slopes @ np.swapaxes(values, -1, -2)
        turn = np.stack([spin[..., 2, 1], spin[..., 0, 2], spin[..., 1, 0]], axis=-1)
        by_turn = np.linalg.inv(np.asarray(left_slope(vector)))
        off = np.where(np.isnan(observed), np.nan, vector)
        return off, np.einsum("pij,kpj->kpi", by_turn, turn)
    off = (reading(name, values) - observed).reshape(len(observed), -1)
    return off, reading(name, slopes).reshape(len(slopes), *off.shape)


@dataclass(eq=False)
class Samples:
    """All measurements of a fit.

    Attributes:
        every: The measurements, with their models.
        unknowns: The constants.
        solves: Number of rows solved so far.
        failed: Rows that were not solved at the last values: source and row.
        refused: Why no robot can have the last values, "" if it can.
    """

    every: tuple[Sample, ...]
    unknowns: tuple[Unknown, ...]
    solves: int = 0
    failed: list[tuple[str, int]] = field(default_factory=list[tuple[str, int]])
    refused: str = ""

    @classmethod
    def of(
        cls,
        robots: Mapping[str, Robot],
        measurements: Mapping[str, Sequence[Measurements]],
        unknowns: tuple[Unknown, ...],
        settings: Settings | None = None,
    ) -> Samples:
        """Collect all measurements of all robots."""
        every = tuple(
            Sample(label, robot, measured, unknowns, settings or Settings())
            for label, robot in robots.items()
            for measured in measurements[label]
        )
        return cls(every, unknowns)

    @property
    def robots(self) -> dict[str, Robot]:
        """The robots as they are, by label."""
        return {sample.label: sample.robot for sample in self.every}

    def of_robot(self, label: str) -> list[Measurements]:
        """Return the measurements of a robot."""
        return [sample.measured for sample in self.every if sample.label == label]

    @property
    def quantities(self) -> tuple[str, ...]:
        """The measured quantities."""
        return tuple(
            dict.fromkeys(name for sample in self.every for name in sample.measured.observed)
        )

    def residuals(self, values: Numbers) -> Residuals | None:
        """Return model less measurement; None if no robot has the values, or a row is unsolved."""
        self.failed, self.refused = [], ""
        residuals: list[Numbers] = []
        slopes: list[Numbers] = []
        for sample in self.every:
            try:
                converged, misfits = sample.misfits(np.asarray(values, float))
            except InputError as problem:
                self.refused = str(problem)
                return None
            self.solves += len(converged)
            unsolved = np.flatnonzero(~converged).tolist()
            self.failed += [(sample.measured.source, row) for row in unsolved]
            for name, (off, by_own) in misfits.items():
                is_known = np.isfinite(sample.measured.observed[name]).reshape(off.shape)
                by_all = np.zeros((int(is_known.sum()), len(self.unknowns)))
                by_all[:, [*sample.own_unknowns]] = by_own[:, is_known].T
                residuals.append(off[is_known])
                slopes.append(by_all)
        if self.failed:
            return None
        return Residuals(np.concatenate(residuals), np.concatenate(slopes), **self._layout)

    def of_unknowns(self, unknowns: tuple[Unknown, ...]) -> Samples:
        """Return the same measurements as a function of other constants."""
        every = tuple(replace(sample, unknowns=unknowns) for sample in self.every)
        return replace(self, every=every, unknowns=unknowns)

    def slopes_of(self, more: Unknown, values: Numbers) -> Numbers | None:
        """Return derivatives by one more constant at values of the others; None without any."""
        both = self.of_unknowns((*self.unknowns, more))
        residuals = both.residuals(np.append(values, more.start))
        if residuals is None or not np.isfinite(residuals.slopes[:, -1]).all():
            return None
        return residuals.slopes[:, -1]

    @cached_property
    def _layout(self) -> dict[str, np.ndarray]:
        """What each measured number belongs to, and its standard deviation."""
        labels, pulls = [*self.robots], 0
        parts: list[dict[str, np.ndarray]] = []
        for number, sample in enumerate(self.every):
            measured = sample.measured
            for name, observed in measured.observed.items():
                is_known = np.isfinite(observed)
                row, part = np.nonzero(is_known.reshape(len(observed), -1))
                deviation = measured.deviation.get(name, np.full(observed.shape, np.nan))
                quantity = OBSERVED.index(name)
                point = part // 3 if name in ("tip_position", "axis_points") else part
                same = {
                    "sample": number,
                    "robot": labels.index(sample.label),
                    "quantity": quantity,
                    "rows": sum(map(len, self.of_robot(sample.label))),
                }
                parts.append(
                    {key: np.full(len(row), value) for key, value in same.items()}
                    | {"row": row, "part": part, "pull": pulls + measured.pull_number[row]}
                    | {"point": point, "given": deviation[is_known]}
                )
            pulls += len(measured.pulls)
        layout = {key: np.concatenate([part[key] for part in parts]) for key in parts[0]}
        # Number the points of all measurements without gaps.
        points = np.stack([layout[key] for key in ("sample", "quantity", "row", "point")])
        layout["point"] = np.unique(points, axis=1, return_inverse=True)[1].ravel()
        return layout


def deviated(robot: Robot, label: str, deviations: Sequence[Unknown]) -> Robot:
    """Return the robot of a label with deviations at their `start`.

    Raises:
        InputError: The robot cannot deviate so.
    """
    return with_numbers(
        robot, values_set(label, deviations, [deviation.start for deviation in deviations])
    )
