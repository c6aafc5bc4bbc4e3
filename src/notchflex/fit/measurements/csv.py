"""Reading measurements from a CSV; `docs/measurements.md` describes its columns."""

from __future__ import annotations

import os
from dataclasses import dataclass, field
from itertools import pairwise
from typing import Any

import numpy as np
from numpy.typing import NDArray

from notchflex.analysis import axis_places
from notchflex.errors import InputError
from notchflex.fit.measurements.columns import (
    BASE_TURN,
    BODY_FOLLOWING,
    BODY_VECTORS,
    FOLLOWING,
    FROM_REST,
    PULL,
    TIP_MASS,
    TIP_VECTORS,
    MeasuredColumn,
    columns,
    numbered,
    places_on_axis,
)
from notchflex.fit.measurements.loading_order import Order, commands_of, loading_order
from notchflex.fit.measurements.measurements import Measurements
from notchflex.loads import BodyForce, ExternalLoad, LoadPath
from notchflex.results.files.csv_reading import Table, no_tendon_column, read_table, tendon_columns
from notchflex.results.quantities.registry import AXES
from notchflex.robot import Robot

_YES_OR_NO = {"0": False, "1": True, "false": False, "true": True}

Numbers = NDArray[np.float64]


def read_measurements(
    source: str | os.PathLike[str], robot: Robot, *, from_rest: bool | None = None
) -> Measurements:
    r"""Read measurements of a robot from a CSV.

    The file is UTF-8 with commas and its header first; lines that start with `#` are skipped. A
    column is named after its quantity and unit: the load (`tendon_force_N`, `tip_mass_g`), what was
    measured (`notch_1_deg`, `tip_x_mm`) and, if known, its standard deviation (`notch_1_sd_deg`).
    An empty entry was not measured. `docs/measurements.md` lists all columns.

    Args:
        source: Path of the file.
        robot: The robot that was measured.
        from_rest: True if every row is a pull from rest, False if the rows of each pull are one
            path with friction history. None takes the column `from_rest` of the file or, without
            it, the order of the rows: a force or displacement that falls step by step is
            unloading, one that falls at once to where it began is the next pull from rest.
            `Measurements.order` says how the order was understood.

    Returns:
        The measurements, in the order of the file.

    Raises:
        InputError: The file cannot be used, or the order of its rows is ambiguous; the message
            names the file, line and column.

    Example:
        >>> from pathlib import Path
        >>> from notchflex import load_robot
        >>> _ = Path("pull.csv").write_text("tendon_force_N,total_deg\n0.25,12.4\n0.5,24.9\n")
        >>> read_measurements("pull.csv", load_robot("pacheco2021-a"))
        <Measurements of pull.csv: 2 rows of 1 pull, each from rest; total_angle>
    """
    reader = _Reader(read_table(source), robot)
    table = reader.table
    reader.check_numbers()
    external = reader.external()
    tension, stroke = reader.commands()
    observed, deviation, axis_at = reader.observed()
    base_rotation = reader.base_rotation()
    labels = next((reader.texts(name) for name in PULL if name in table.header), None)
    in_file = reader.from_rest()
    order = _order(table, tension, stroke, labels, in_file if from_rest is None else from_rest)
    return Measurements(
        source=table.name,
        load=LoadPath(np.maximum(tension, 0.0), stroke, base_rotation, external),
        pull=order.pull,
        from_rest=order.from_rest,
        observed=observed,
        deviation=deviation,
        axis_at=axis_at,
        measured_tension=tension,
        ignored=tuple(name for name in table.header if name not in reader.used),
        order=order.words,
    )


def _order(
    table: Table,
    tension: Numbers,
    stroke: Numbers,
    labels: tuple[str, ...] | None,
    from_rest: bool | None,
) -> Order:
    """Pull of every row, and whether the rows were loaded from rest."""
    if from_rest is False:
        return Order(False, ("1",) * len(table) if labels is None else labels)
    order = loading_order(commands_of(tension, stroke), labels, len(table))
    if from_rest:
        return Order(True, order.pull)
    if order.unclear is None:
        return order
    row, name, top, bottom = order.unclear
    raise InputError.UNSUPPORTED(
        f"{table.at(row)}: the {name} falls from {top:g} to {bottom:g} neither step by step nor "
        "to where the pull began, so the order of the rows does not tell how the robot was loaded. "
        "Say so: --from-rest (a column from_rest "
        "of 1) if every row was loaded from rest, --path (0) if the rows of each pull are one "
        "loading path; a column trial separates pulls."
    )


@dataclass
class _Reader:
    """A table of measurements of a robot; it remembers which columns were used."""

    table: Table
    robot: Robot
    used: set[str] = field(default_factory=set[str])

    def texts(self, name: str) -> tuple[str, ...]:
        self.used.add(name)
        return self.table.texts(name)

    def numbers(self, name: str, *, may_miss: bool = False) -> Numbers:
        self.used.add(name)
        return self.table.numbers(name, may_miss=may_miss)

    def vectors(self, patterns: dict[str, str], **number: object) -> dict[str, Numbers]:
        """Three numbers a row for each argument that has a column; axes without one are 0."""
        values: dict[str, Numbers] = {}
        for argument, pattern in patterns.items():
            for axis, letter in enumerate(AXES):
                name = pattern.format(a=letter, **number)
                if name in self.table.header:
                    rows = values.setdefault(argument, np.zeros((len(self.table), 3)))
                    rows[:, axis] = self.numbers(name)
        return values

    def flags(self, name: str) -> list[bool] | None:
        """A column of 0 and 1; None if it is missing."""
        if name not in self.table.header:
            return None
        texts = self.texts(name)
        for row, text in enumerate(texts):
            if text.lower() not in _YES_OR_NO:
                raise InputError.NOT_A_NUMBER(
                    f"{self.table.at(row)}: {name} is {text or 'nothing'!r}; give 0 or 1."
                )
        return [_YES_OR_NO[text.lower()] for text in texts]

    def check_numbers(self) -> None:
        """Refuse columns of notches, tendons or bodies that the robot does not have."""
        robot, table = self.robot, self.table
        limits = {
            "notch": (1, robot.number_of_notches),
            "tendon": (1, robot.number_of_tendons),
            "body": (0, robot.number_of_notches),
        }
        for name in table.header:
            part, number = numbered(name) or ("body", 0)  # the base, which every robot has
            first, last = limits[part]
            if not first <= number <= last:
                has = f"{part} {first}" if first == last else f"{part} {first} to {last}"
                raise InputError.TABLE_COLUMNS(
                    f"{table.name}: there is a column {name}, but {robot.name} has {has}; choose "
                    "the robot that was measured."
                )

    def from_rest(self) -> bool | None:
        """Whether all rows were loaded from rest; None if the file does not say."""
        flags = self.flags(FROM_REST)
        if flags is None:
            return None
        if len(set(flags)) > 1:
            row = flags.index(not flags[0])
            raise InputError.UNSUPPORTED(
                f"{self.table.at(row)}: {FROM_REST} differs from the rows before; it is the same "
                "for all."
            )
        return flags[0]

    def base_rotation(self) -> Numbers:
        turned = self.vectors({"base": BASE_TURN}).get("base", np.zeros((1, 3)))
        differs = np.flatnonzero((turned != turned[0]).any(axis=1))
        if len(differs):
            raise InputError.UNSUPPORTED(
                f"{self.table.at(differs[0])}: the base is turned otherwise than in the row before "
                "it; write a file for each way that it is turned."
            )
        return np.radians(turned[0])

    def commands(self) -> tuple[Numbers, Numbers]:
        """Measured tensions and strokes, rows by tendons; NaN where the other is given."""
        table, tendons = self.table, self.robot.number_of_tendons
        tension, stroke = (np.full((len(table), tendons), np.nan) for _ in range(2))
        by_force = tendon_columns(table.header, "tension", tendons)
        by_stroke = tendon_columns(table.header, "stroke", tendons)
        if not by_force and not by_stroke and not self.used:  # nor any external load
            raise no_tendon_column(table, tendons)
        for tendon in sorted({*by_force, *by_stroke}):
            names: list[str] = []
            if tendon in by_force:
                names.append(by_force[tendon])
                tension[:, tendon] = self.numbers(names[-1], may_miss=True)
            if tendon in by_stroke:
                names.append(by_stroke[tendon])
                values = table.numbers(names[-1], may_miss=True)
                stroke[:, tendon] = np.where(np.isnan(tension[:, tendon]), values, np.nan)
                if not np.isnan(stroke[:, tendon]).all():
                    self.used.add(names[-1])
            missing = np.flatnonzero(np.isnan(tension[:, tendon]) & np.isnan(stroke[:, tendon]))
            if len(missing):
                raise InputError.MISSING_VALUE(
                    f"{table.at(missing[0])}: {' and '.join(names)} "
                    f"{'are' if len(names) > 1 else 'is'} nothing; say what was done to the "
                    "tendon, 0 N where it was slack."
                )
        return tension, stroke

    def external(self) -> tuple[ExternalLoad, ...]:
        """External loads, row by row."""
        at_tip, following = self.vectors(TIP_VECTORS), self.flags(FOLLOWING)
        mass = self.numbers(TIP_MASS) if TIP_MASS in self.table.header else None
        on_bodies = self._body_forces()
        loads: list[ExternalLoad] = []
        for row in range(len(self.table)):
            load: dict[str, Any] = {name: values[row].tolist() for name, values in at_tip.items()}
            load["body_forces"] = [
                one[row] for one in on_bodies if any((*one[row].force, *one[row].moment))
            ]
            if following is not None:
                load["following"] = following[row]
            if mass is not None:
                load["tip_mass"] = float(mass[row])
            try:
                loads.append(ExternalLoad(**load))
            except InputError as problem:
                raise InputError(f"{self.table.at(row)}: {problem}.", problem.code) from None
            has_mass = self.robot.material.density is not None or load.get("tip_mass")
            if any(load.get("gravity", ())) and not has_mass:
                raise InputError.UNSUPPORTED(
                    f"{self.table.at(row)}: gravity has nothing to act on, because the density of "
                    f"{self.robot.name} is not known; give material.density, or a {TIP_MASS}."
                )
        return tuple(loads)

    def _body_forces(self) -> list[list[BodyForce]]:
        """Forces on every body that has columns, row by row."""
        forces: list[list[BodyForce]] = []
        rows = range(len(self.table))
        for body in range(self.robot.number_of_notches + 1):
            vectors = self.vectors(BODY_VECTORS, b=body)
            follows = self.flags(BODY_FOLLOWING.format(b=body)) or [False for _ in rows]
            zero = {"force": np.zeros((len(self.table), 3))}
            if vectors:
                forces.append(
                    [
                        BodyForce(
                            body,
                            **{name: one[row].tolist() for name, one in (zero | vectors).items()},
                            following=follows[row],
                        )
                        for row in rows
                    ]
                )
        return forces

    def observed(self) -> tuple[dict[str, Numbers], dict[str, Numbers], Numbers]:
        """Measured quantities, their standard deviations, and the points on the axis, mm."""
        table = self.table
        written = self._points_on_axis()
        axis_at = np.array(list(written.values()))
        notches, tendons = self.robot.number_of_notches, self.robot.number_of_tendons
        shapes = {
            "notch_angle": (notches,),
            "total_angle": (),
            "tip_position": (3,),
            "tip_rotation": (3,),
            "tip_tension": (tendons,),
            "axis_points": (len(axis_at), 3),
        }
        observed: dict[str, Numbers] = {}
        deviation: dict[str, Numbers] = {}
        for column in columns(notches, tendons, axis_at.tolist()):
            name, spread = self._names(column, list(written))
            if spread in table.header and name not in table.header:
                raise InputError.TABLE_COLUMNS(
                    f"{table.name}: there is a column {spread}, but none of what it is the "
                    f"standard deviation of; add {name}."
                )
            for tables, header in ((observed, name), (deviation, spread)):
                if header not in table.header:
                    continue
                values = self.numbers(header, may_miss=True)
                if tables is deviation:
                    check_deviation(table, header, values)
                if np.isnan(values).all():
                    continue
                empty = np.full((len(table), *shapes[column.quantity]), np.nan)
                components = tables.setdefault(column.quantity, empty)
                components[:, *column.index] = np.radians(values) if column.in_degrees else values
        if not observed:
            raise InputError.NO_DATA(
                f"{table.name}: nothing is measured; there is no number in a column such as "
                f"notch_1_deg, total_deg, tip_x_mm or axis_5_x_mm; {table.columns}."
            )
        deviation = {name: values for name, values in deviation.items() if name in observed}
        return observed, deviation, axis_at if "axis_points" in observed else np.zeros(0)

    def _points_on_axis(self) -> dict[str, float]:
        """The points on the axis, as the columns write them and as numbers, mm."""
        table, points = self.table, places_on_axis(self.table.header)
        for written, distance in points.items():
            try:
                axis_places(self.robot, distance)
            except InputError as problem:
                name = next(name for name in table.header if name.startswith(f"axis_{written}_"))
                raise InputError.TABLE_COLUMNS(f"{table.name}: column {name}: {problem}.") from None
        for (first, distance), (second, other) in pairwise(points.items()):
            if distance == other:
                raise InputError.TABLE_COLUMNS(
                    f"{table.name}: the columns axis_{first}_... and axis_{second}_... are of one "
                    "point; keep one of them."
                )
        return points

    def _names(self, column: MeasuredColumn, points: list[str]) -> tuple[str, ...]:
        """Names that the file may use for a column and for that of its standard deviation."""
        names = column.name, column.deviation
        if column.quantity == "axis_points":
            written = points[column.index[0]]
            return tuple(f"axis_{written}_{name.split('_', 2)[2]}" for name in names)
        if column.quantity == "tip_tension" and column.name not in self.table.header:
            return tuple(name.replace("tendon_tip", "tendon_1_tip") for name in names)
        return names


def check_deviation(table: Table, column: str, values: Numbers) -> None:
    """Raise InputError if a standard deviation is not above 0; NaN is not known."""
    if (values <= 0.0).any():
        row = int(np.argmax(values <= 0.0))
        raise InputError.OUT_OF_RANGE(
            f"{table.at(row)}: {column} is {values[row]:g}; a standard deviation is above 0, or "
            "empty where it is not known."
        )
