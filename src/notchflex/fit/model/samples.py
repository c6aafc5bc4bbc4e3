"""All measurements of a fit, and the model's rows that go with them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np
from jaxtyping import Float

from notchflex.analysis.axis_points import AxisPlaces, axis_places
from notchflex.errors import InputError
from notchflex.fit.measurements.measurements import OBSERVED, Measurements
from notchflex.fit.model.constants import Unknown
from notchflex.fit.model.residuals import Residuals, misfit, outputs_for
from notchflex.fit.model.rows import Rows
from notchflex.robot import Robot
from notchflex.solver.newton import DEFAULT, Settings


@dataclass(frozen=True, eq=False)
class Sample:
    """One measurement of one robot, and the rows of the model that go with it.

    Attributes:
        label: The robot's.
        robot: The robot as it is.
        measured: What was measured.
        rows: The model.
        columns: Which constant each number of `rows` is.
        pulls: Which pull each row belongs to, counted over all measurements.
    """

    label: str
    robot: Robot
    measured: Measurements
    rows: Rows
    columns: tuple[int, ...]
    pulls: tuple[int, ...]


@dataclass(eq=False)
class Samples:
    """All measurements of a fit.

    Attributes:
        every: One per measurement.
        unknowns: The constants.
        solves: How many rows were solved so far.
        failed: Rows that were not solved in the last try: measurement and row.
        refused: Why no robot could have the values of the last try, "" where one could.
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
        """Lay out all measurements of all robots."""
        every: list[Sample] = []
        pulls = 0
        for label, robot in robots.items():
            mine = [
                (number, path)
                for number, unknown in enumerate(unknowns)
                for owner, path in unknown.sets
                if owner == label
            ]
            for measured in measurements[label]:
                labels = {pull: number for number, pull in enumerate(dict.fromkeys(measured.pull))}
                own = tuple(pulls + labels[pull] for pull in measured.pull)
                pulls += len(labels)
                by_stroke = ~np.isnan(measured.load.stroke)
                rows = Rows(
                    robot=robot,
                    load=measured.load,
                    paths=_paths(measured),
                    names=tuple(path for _, path in mine),
                    outputs=outputs_for(tuple(measured.observed)),
                    measured=np.where(by_stroke, measured.load.stroke, measured.measured_tension),
                    places=_places(robot, measured),
                    settings=settings or DEFAULT,
                )
                columns = tuple(number for number, _ in mine)
                every.append(Sample(label, robot, measured, rows, columns, own))
        return cls(tuple(every), unknowns)

    @property
    def quantities(self) -> tuple[str, ...]:
        """What was measured."""
        return tuple(dict.fromkeys(name for one in self.every for name in one.measured.observed))

    def residuals(self, values: Float[np.ndarray, " k"]) -> Residuals | None:
        """Model less measurement; None where a robot cannot be, or rows have no solution."""
        self.failed, self.refused = [], ""
        parts: list[dict[str, np.ndarray]] = []
        for number, sample in enumerate(self.every):
            own = np.asarray(values, float)[list(sample.columns)]
            try:
                predicted = sample.rows.at(own)
            except InputError as problem:
                self.refused = str(problem)
                return None
            self.solves += len(predicted.converged)
            rows = np.flatnonzero(~predicted.converged)
            self.failed += [(sample.measured.source, int(row)) for row in rows]
            if self.failed:
                continue
            for name in sample.measured.observed:
                found = misfit(name, sample.measured, predicted)
                parts.append(self._laid_out(number, sample, name, found.values, found.slopes))
        if self.failed:
            return None
        return self._joined(parts)

    def _laid_out(
        self,
        number: int,
        sample: Sample,
        name: str,
        values: np.ndarray,
        slopes: np.ndarray,
    ) -> dict[str, np.ndarray]:
        """One quantity of one measurement as a list of numbers; what was not measured goes."""
        known = np.isfinite(values)
        row, part = np.nonzero(known)
        count = len(row)
        labels = list(dict.fromkeys(one.label for one in self.every))
        sides = 3 if name in ("tip_position", "axis_points") else 1
        width = -(-values.shape[1] // sides)
        total = sum(len(one.measured.pull) for one in self.every if one.label == sample.label)
        given = np.full(values.shape, np.nan)
        if name in sample.measured.deviation:
            given = sample.measured.deviation[name].reshape(values.shape)
        every = np.zeros((count, len(self.unknowns)))
        every[:, list(sample.columns)] = slopes[:, known].T
        return {
            "values": values[known],
            "slopes": every,
            "sample": np.full(count, number),
            "robot": np.full(count, labels.index(sample.label)),
            "row": row,
            "quantity": np.full(count, OBSERVED.index(name)),
            "part": part,
            "pull": np.array(sample.pulls, int)[row],
            "point": row * width + part // sides,
            "rows": np.full(count, total),
            "given": given[known],
        }

    def _joined(self, parts: list[dict[str, np.ndarray]]) -> Residuals:
        points = 0
        for part in parts:
            part["point"] = part["point"] + points
            points = int(part["point"].max(initial=points - 1)) + 1
        joined = {key: np.concatenate([part[key] for part in parts]) for key in parts[0]}
        # Numbered without gaps, so that groups can be counted.
        joined["point"] = np.unique(joined["point"], return_inverse=True)[1]
        return Residuals(**joined)


def _places(robot: Robot, measured: Measurements) -> AxisPlaces | None:
    if "axis_points" not in measured.observed:
        return None
    return axis_places(robot, measured.axis_at)


def _paths(measured: Measurements) -> tuple[tuple[int, ...], ...]:
    """Rows of every path: each alone where all are from rest, else those of each pull."""
    rows = range(len(measured.pull))
    if measured.from_rest:
        return tuple((row,) for row in rows)
    return tuple(tuple(row for row in rows if measured.pull[row] == one) for one in measured.pulls)


__all__ = ["Sample", "Samples"]
