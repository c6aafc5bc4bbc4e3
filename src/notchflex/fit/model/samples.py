"""All measurements of a fit as one list of residuals."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np
from jaxtyping import Float

from notchflex import InputError, Robot, Settings
from notchflex.fit.measurements.measurements import OBSERVED, Measurements
from notchflex.fit.model.constants import Unknown
from notchflex.fit.model.drawing import deviated
from notchflex.fit.model.residuals import Residuals, Sample, misfit
from notchflex.solver.newton import DEFAULT


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
        every: list[Sample] = []
        pulls = 0
        for label, robot in robots.items():
            numbers = [
                (one, column)
                for column, unknown in enumerate(unknowns)
                for one in unknown.sets
                if one.label == label
            ]
            names = tuple(one for one, _ in numbers)
            columns = tuple(column for _, column in numbers)
            for measured in measurements[label]:
                pull = pulls + np.array([measured.pulls.index(one) for one in measured.pull])
                pulls += len(measured.pulls)
                every.append(
                    Sample(label, robot, measured, names, columns, pull, settings or DEFAULT)
                )
        return cls(tuple(every), unknowns)

    def of_robot(self, label: str) -> list[Measurements]:
        """Return the measurements of a robot."""
        return [one.measured for one in self.every if one.label == label]

    @property
    def quantities(self) -> tuple[str, ...]:
        """The measured quantities."""
        return tuple(dict.fromkeys(name for one in self.every for name in one.measured.observed))

    def residuals(self, values: Float[np.ndarray, " k"]) -> Residuals | None:
        """Return model less measurement; None if no robot has the values, or a row is unsolved."""
        self.failed, self.refused = [], ""
        residuals: list[np.ndarray] = []
        slopes: list[np.ndarray] = []
        for sample in self.every:
            try:
                predicted = sample.predict(np.asarray(values, float))
            except InputError as problem:
                self.refused = str(problem)
                return None
            self.solves += len(predicted.converged)
            unsolved = np.flatnonzero(~predicted.converged).tolist()
            self.failed += [(sample.measured.source, row) for row in unsolved]
            if self.failed:
                continue
            for name, observed in sample.measured.observed.items():
                is_known = np.isfinite(observed).reshape(len(observed), -1)
                off, by_numbers = misfit(name, sample.measured, predicted)
                residuals.append(off[is_known])
                by_constants = np.zeros((len(residuals[-1]), len(self.unknowns)))
                by_constants[:, list(sample.columns)] = by_numbers[:, is_known].T
                slopes.append(by_constants)
        if self.failed:
            return None
        values = np.concatenate(residuals)
        none = np.zeros((len(values), 0))
        return Residuals(values, np.concatenate(slopes), **self._layout, spread=none)

    def deviated(self, deviations: Sequence[Unknown]) -> Samples:
        """Return the same measurements of robots that deviate from their drawings.

        Raises:
            InputError: A robot cannot.
        """
        robots = {one.label: one.robot for one in self.every}
        robots = {label: deviated(robot, label, deviations) for label, robot in robots.items()}
        every = tuple(replace(one, robot=robots[one.label]) for one in self.every)
        return replace(self, every=every)

    def slopes_of(
        self, more: Unknown, values: Float[np.ndarray, " k"]
    ) -> Float[np.ndarray, " r"] | None:
        """Return derivatives by one more constant at values of the others; None without any."""
        robots = {one.label: one.robot for one in self.every}
        data = {label: self.of_robot(label) for label in robots}
        varied = Samples.of(robots, data, (*self.unknowns, more), self.every[0].settings)
        residuals = varied.residuals(np.append(values, more.start))
        if residuals is None or not np.isfinite(residuals.slopes[:, -1]).all():
            return None
        return residuals.slopes[:, -1]

    @cached_property
    def _layout(self) -> dict[str, np.ndarray]:
        """Robot, row and quantity of each measured number."""
        labels = list(dict.fromkeys(one.label for one in self.every))
        parts: list[dict[str, np.ndarray]] = []
        for number, sample in enumerate(self.every):
            total = sum(map(len, self.of_robot(sample.label)))
            for name, observed in sample.measured.observed.items():
                is_known = np.isfinite(observed)
                row, part = np.nonzero(is_known.reshape(len(observed), -1))
                deviation = sample.measured.deviation.get(name, np.full(observed.shape, np.nan))
                same = {
                    "sample": number,
                    "robot": labels.index(sample.label),
                    "quantity": OBSERVED.index(name),
                    "rows": total,
                }
                parts.append(
                    {key: np.full(len(row), value) for key, value in same.items()}
                    | {"row": row, "part": part, "pull": sample.pulls[row]}
                    | {"point": part // 3 if name in ("tip_position", "axis_points") else part}
                    | {"given": deviation[is_known]}
                )
        layout = {key: np.concatenate([one[key] for one in parts]) for key in parts[0]}
        # Number the points of all measurements without gaps.
        levels = [layout[key] for key in ("sample", "quantity", "row", "point")]
        points = np.ravel_multi_index(levels, [int(one.max(initial=0)) + 1 for one in levels])
        layout["point"] = np.unique(points, return_inverse=True)[1]
        return layout
