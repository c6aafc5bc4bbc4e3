"""Measurements as CSV; `docs/measurements.md` describes the columns."""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from itertools import pairwise
from pathlib import Path
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from notchflex import BodyForce, InputError, LoadPath, Robot
from notchflex.analysis import axis_places
from notchflex.fit.measurements import columns
from notchflex.fit.measurements import columns as layout
from notchflex.fit.measurements.loading_order import Order, commands_of, loading_order
from notchflex.fit.measurements.measurements import Measurements
from notchflex.support import (
    AXES,
    QUANTITIES,
    ExternalLoad,
    Table,
    check_is_robot,
    check_pulls,
    no_tendon_column,
    read_data_table,
    tendon_columns,
    write_columns,
)

_YES_OR_NO = {"0": False, "1": True, "false": False, "true": True}

Numbers = NDArray[np.float64]


@dataclass
class MeasurementReader:
    """A table of measurements of a robot; `used` are the columns read so far."""

    table: Table
    robot: Robot
    used: set[str] = field(default_factory=set[str])

    def texts(self, name: str) -> tuple[str, ...]:
        """Return a column of texts."""
        self.used.add(name)
        return self.table.texts(name)

    def numbers(self, name: str, *, may_miss: bool = False, is_load: bool = False) -> Numbers:
        """Return a column of numbers, of which some may be missing (NaN)."""
        self.used.add(name)
        return self.table.numbers(name, may_miss=may_miss, is_load=is_load)

    def vectors(self, patterns: dict[str, str], **number: object) -> dict[str, Numbers]:
        """Return vectors, (P, 3), for each argument that has a column; axes without one are 0."""
        values: dict[str, Numbers] = {}
        for argument, pattern in patterns.items():
            for axis, letter in enumerate(AXES):
                name = pattern.format(a=letter, **number)
                if name in self.table.header:
                    rows = values.setdefault(argument, np.zeros((len(self.table), 3)))
                    rows[:, axis] = self.numbers(name)
        return values

    def flags(self, name: str) -> list[bool] | None:
        """Return a column of 0 and 1; None if it is missing."""
        if name not in self.table.header:
            return None
        texts = self.texts(name)
        for row, text in enumerate(texts):
            if text.lower() not in _YES_OR_NO:
                raise InputError.NOT_A_NUMBER(
                    f"{self.table.place_of(row)}: {name} is {text or 'nothing'!r}; give 0 or 1."
                )
        return [_YES_OR_NO[text.lower()] for text in texts]

    def directions(self) -> list[int]:
        """Return 1 for rows of loading, -1 for rows of unloading."""
        words = {"loading": 1, "load": 1, "up": 1, "unloading": -1, "unload": -1, "down": -1}
        texts = self.texts(columns.DIRECTION)
        for row, text in enumerate(texts):
            if text.lower() not in words:
                raise InputError.TABLE_COLUMNS(
                    f"{self.table.place_of(row)}: {columns.DIRECTION} is {text or 'nothing'!r}; "
                    "give loading or unloading."
                )
        return [words[text.lower()] for text in texts]

    def check_numbers(self) -> None:
        """Refuse columns of notches, tendons or bodies that the robot does not have."""
        robot, table = self.robot, self.table
        limits = {
            "notch": (1, robot.number_of_notches),
            "tendon": (1, robot.number_of_tendons),
            "body": (0, robot.number_of_notches),
        }
        for name in table.header:
            part, number = columns.numbered(name) or ("body", 0)  # the base, which every robot has
            first, last = limits[part]
            if not first <= number <= last:
                has = f"{part} {first}" if first == last else f"{part} {first} to {last}"
                raise InputError.TABLE_COLUMNS(
                    f"{table.name}: there is a column {name}, but {robot.name} has {has}; choose "
                    "the robot that was measured."
                )

    def from_rest(self) -> bool | None:
        """Return whether all rows were loaded from rest; None if the file does not say."""
        flags = self.flags(columns.FROM_REST)
        if flags is None:
            return None
        if len(set(flags)) > 1:
            row = flags.index(not flags[0])
            raise InputError.UNSUPPORTED(
                f"{self.table.place_of(row)}: {columns.FROM_REST} differs from the rows before; it "
                "is the same for all."
            )
        return flags[0]

    def base_rotation(self) -> Numbers:
        """Return the rotation vector of the base, rad, the same in all rows."""
        turned = self.vectors({"base": columns.BASE_TURN}).get("base", np.zeros((1, 3)))
        differs = np.flatnonzero((turned != turned[0]).any(axis=1))
        if len(differs):
            raise InputError.UNSUPPORTED(
                f"{self.table.place_of(differs[0])}: the base rotation differs from the row before "
                "it; write a file for each way that it is turned."
            )
        return np.radians(turned[0])

    def commands(self) -> tuple[Numbers, Numbers]:
        """Return measured tensions and strokes, rows by tendons; NaN where the other is given."""
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
                tension[:, tendon] = self.numbers(names[-1], may_miss=True, is_load=True)
            if tendon in by_stroke:
                names.append(by_stroke[tendon])
                values = table.numbers(names[-1], may_miss=True, is_load=True)
                stroke[:, tendon] = np.where(np.isnan(tension[:, tendon]), values, np.nan)
                if not np.isnan(stroke[:, tendon]).all():
                    self.used.add(names[-1])
            missing = np.flatnonzero(np.isnan(tension[:, tendon]) & np.isnan(stroke[:, tendon]))
            if len(missing):
                raise InputError.MISSING_VALUE(
                    f"{table.place_of(missing[0])}: {' and '.join(names)} "
                    f"{'are' if len(names) > 1 else 'is'} nothing; say what was done to the "
                    "tendon, 0 N where it was slack."
                )
        return tension, stroke

    def external(self) -> tuple[ExternalLoad, ...]:
        """Return the external loads, row by row."""
        at_tip, following = self.vectors(columns.TIP_VECTORS), self.flags(columns.FOLLOWING)
        mass = self.numbers(columns.TIP_MASS) if columns.TIP_MASS in self.table.header else None
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
                raise InputError(f"{self.table.place_of(row)}: {problem}.", problem.code) from None
            has_mass = self.robot.material.density is not None or load.get("tip_mass")
            if any(load.get("gravity", ())) and not has_mass:
                raise InputError.UNSUPPORTED(
                    f"{self.table.place_of(row)}: gravity has nothing to act on, because the "
                    f"density of {self.robot.name} is not known; give material.density, or a "
                    f"{columns.TIP_MASS}."
                )
        return tuple(loads)

    def _body_forces(self) -> list[list[BodyForce]]:
        """Forces on every body that has columns, row by row."""
        forces: list[list[BodyForce]] = []
        rows = range(len(self.table))
        for body in range(self.robot.number_of_notches + 1):
            vectors = self.vectors(columns.BODY_VECTORS, b=body)
            follows = self.flags(columns.BODY_FOLLOWING.format(b=body)) or [False for _ in rows]
            if vectors:
                vectors = {"force": np.zeros((len(self.table), 3))} | vectors
                lists = {name: values.tolist() for name, values in vectors.items()}
                of_rows = [{name: values[row] for name, values in lists.items()} for row in rows]
                forces.append(
                    [BodyForce(body, **of_rows[row], following=follows[row]) for row in rows]
                )
        return forces


def read_measurements(
    source: str | os.PathLike[str],
    robot: Robot,
    *,
    from_rest: bool | None = None,
    measured: Literal["ring", "edge"] = "ring",
    columns: Mapping[str, str] | None = None,
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
        measured: What columns such as `notch_1_deg` hold: "ring", the angle between the uncut
            pieces beside a notch, or "edge", the angle between its two faces, as `notch_1_edge_deg`
            holds; then a total that was added up from them is taken so too.
        columns: Headers of the file for quantities, such as `{"tension": "Kraft [N]"}`. Words such
            as `Force [mN]` or `Angle (deg)` are understood without it.

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
    if measured not in ("ring", "edge"):
        raise InputError.UNKNOWN_NAME(f'measured is "ring" or "edge"; got {measured!r}')
    reader = MeasurementReader(read_data_table(source, columns), check_is_robot(robot))
    table = reader.table
    reader.check_numbers()
    external = reader.external()
    tension, stroke = reader.commands()
    check_pulls(tension, source=table.name)
    observed, deviation, axis_at = _observed(reader)
    base_rotation = reader.base_rotation()
    labels = next((reader.texts(name) for name in layout.PULL if name in table.header), None)
    in_file = reader.from_rest()
    if layout.DIRECTION in table.header and in_file is None:
        directions = reader.directions()
        if -1 in directions:  # unloading follows loading, and the next pull follows unloading
            in_file = False
            starts = np.diff(directions, prepend=1) > 0
            labels = labels or tuple(map(str, 1 + np.cumsum(starts)))
    order = _order(table, tension, stroke, labels, in_file if from_rest is None else from_rest)
    measurements = Measurements(
        source=table.name,
        load=LoadPath(np.maximum(tension, 0.0), stroke, base_rotation, external),
        pull=order.pull,
        from_rest=order.from_rest,
        observed=observed,
        deviation=deviation,
        axis_at=axis_at,
        measured_tension=tension,
        ignored=table.unused(reader.used),
        order=order.words,
        renamed=table.written,
    )
    return measurements.as_edge_angles() if measured == "edge" else measurements


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
        f"{table.place_of(row)}: the {name} falls from {top:g} to {bottom:g} neither step by step "
        "nor to where the pull began, so the order of the rows does not show how the robot was "
        "loaded. Say so: --from-rest (a column from_rest "
        "of 1) if every row was loaded from rest, --path (0) if the rows of each pull are one "
        "loading path; a column trial separates pulls."
    )


def _observed(
    reader: MeasurementReader,
) -> tuple[dict[str, Numbers], dict[str, Numbers], Numbers]:
    """Measured quantities, their standard deviations, and the points on the axis, mm."""
    table, robot = reader.table, reader.robot
    written = _points_on_axis(table, robot)
    axis_at = np.array(list(written.values()))
    notches, tendons = robot.number_of_notches, robot.number_of_tendons
    shapes = {
        "notch_angle": (notches,),
        "total_angle": (),
        "edge_angle": (notches,),
        "total_edge_angle": (),
        "tip_position": (3,),
        "tip_rotation": (3,),
        "tip_tension": (tendons,),
        "axis_points": (len(axis_at), 3),
    }
    observed: dict[str, Numbers] = {}
    deviation: dict[str, Numbers] = {}
    for column in layout.measured_columns(notches, tendons, axis_at.tolist()):
        name, spread = _names(table, column, list(written))
        if spread in table.header and name not in table.header:
            raise InputError.TABLE_COLUMNS(
                f"{table.name}: there is a column {spread}, but none of what it is the "
                f"standard deviation of; add {name}."
            )
        for tables, header in ((observed, name), (deviation, spread)):
            if header not in table.header:
                continue
            values = reader.numbers(header, may_miss=True)
            if tables is deviation:
                check_deviation(table, header, values)
            if np.isnan(values).all():
                continue
            empty = np.full((len(table), *shapes[column.quantity]), np.nan)
            components = tables.setdefault(column.quantity, empty)
            components[:, *column.index] = np.radians(values) if column.in_degrees else values
    if not observed:
        raise InputError.NO_DATA(
            f"{table.name}: nothing is measured; no column has a number, such as "
            f"notch_1_deg, total_deg, tip_x_mm or axis_5_x_mm; {table.columns}."
        )
    deviation = {name: values for name, values in deviation.items() if name in observed}
    return observed, deviation, axis_at if "axis_points" in observed else np.zeros(0)


def _points_on_axis(table: Table, robot: Robot) -> dict[str, float]:
    """The points on the axis, as the columns write them and as numbers, mm."""
    points = layout.places_on_axis(table.header)
    for written, distance in points.items():
        try:
            axis_places(robot, distance)
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


def _names(table: Table, column: layout.MeasuredColumn, points: list[str]) -> tuple[str, ...]:
    """Names that the file may use for a column and for that of its standard deviation."""
    names = column.name, column.deviation
    if column.quantity == "axis_points":
        written = points[column.index[0]]
        return tuple(f"axis_{written}_{name.split('_', 2)[2]}" for name in names)
    if column.quantity == "tip_tension" and column.name not in table.header:
        return tuple(name.replace("tendon_tip", "tendon_1_tip") for name in names)
    return names


def check_deviation(table: Table, column: str, values: Numbers) -> None:
    """Raise InputError if a standard deviation is not above 0; NaN is not known."""
    if (values <= 0.0).any():
        row = int(np.argmax(values <= 0.0))
        raise InputError.OUT_OF_RANGE(
            f"{table.place_of(row)}: {column} is {values[row]:g}; a standard deviation is above 0, "
            "or empty where it is not known."
        )


def write_measurements(measurements: Measurements, target: str | Path) -> None:
    """Write measurements as a CSV, whole or not at all.

    Angles are written in degrees. Those that were read from a file, or made by
    `simulate_measurements`, read back exactly; any other to its last digit.

    Args:
        measurements: What to write.
        target: Path, or `-` for standard output.

    Raises:
        InputError: The file cannot be written, or a table cannot hold the loads: several forces on
            one body, gravity or a commanded tendon in some rows only.
    """
    table = {columns.PULL[0]: list(measurements.pull)} | _commands(measurements)
    table |= _external(measurements) | _observed_columns(measurements)
    table[columns.FROM_REST] = [measurements.from_rest] * len(measurements)
    write_columns(target, table)


def exactly_in_degrees(angle: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return degrees that `numpy.radians` turns into exactly these angles, where there are such.

    Example:
        >>> angle = np.radians(np.arange(1.0, 400.0) / 7.0)
        >>> bool((np.radians(exactly_in_degrees(angle)) == angle).all())
        True
    """
    degrees = np.degrees(angle)
    up = down = degrees
    for _ in range(3):
        up, down = np.nextafter(up, np.inf), np.nextafter(down, -np.inf)
        for near in (up, down):
            better = (np.radians(degrees) != angle) & (np.radians(near) == angle)
            degrees = np.where(better, near, degrees)
    return degrees


def _commands(measurements: Measurements) -> dict[str, Any]:
    tension, stroke = measurements.measured_tension, measurements.load.stroke
    tendons = tension.shape[1]
    table: dict[str, Any] = {}
    for tendon in range(tendons):
        commanded = ~np.isnan(tension[:, tendon]) | ~np.isnan(stroke[:, tendon])
        if commanded.any() and not commanded.all():
            raise InputError.UNSUPPORTED(
                f"tendon {tendon + 1} is commanded in some rows only; give 0 N where it is slack"
            )
        for name, values in (("tension", tension), ("stroke", stroke)):
            if not np.isnan(values[:, tendon]).all():
                header = QUANTITIES[name].header(tendon="" if tendons == 1 else tendon + 1)
                table[header] = values[:, tendon]
    return table


def _observed_columns(measurements: Measurements) -> dict[str, Any]:
    observed, deviation = measurements.observed, measurements.deviation
    angles = [observed[name] for name in ("notch_angle", "edge_angle") if name in observed]
    notches = angles[0].shape[1] if angles else 0
    tendons = measurements.measured_tension.shape[1]
    table: dict[str, Any] = {}
    for column in columns.measured_columns(notches, tendons, measurements.axis_at.tolist()):
        for tables, name in ((observed, column.name), (deviation, column.deviation)):
            if column.quantity not in tables:
                continue
            values, measured = (
                one[column.quantity][:, *column.index] for one in (tables, observed)
            )
            # The deviation of what was never measured would not be read back.
            if not (np.isnan(values).all() or np.isnan(measured).all()):
                table[name] = exactly_in_degrees(values) if column.in_degrees else values
    return table


def _external(measurements: Measurements) -> dict[str, Any]:
    loads = measurements.load.external
    table: dict[str, Any] = {}
    if len({one.gravity is None for one in loads}) > 1:
        raise InputError.UNSUPPORTED(
            "gravity is given in some rows only; give it in all or in none"
        )
    for name, pattern in columns.TIP_VECTORS.items():
        rows = [getattr(one, name) for one in loads]
        # Gravity of 0 differs from no gravity given, with which a mass hangs.
        if rows[0] is not None and (name == "gravity" or np.any(rows)):
            table |= _vector(pattern, rows)
    if any(one.following for one in loads):
        table[columns.FOLLOWING] = [one.following for one in loads]
    if any(one.tip_mass for one in loads):
        table[columns.TIP_MASS] = [one.tip_mass for one in loads]
    for body in sorted({force.body for one in loads for force in one.body_forces}):
        of_body = [[force for force in one.body_forces if force.body == body] for one in loads]
        if max(map(len, of_body)) > 1:
            raise InputError.UNSUPPORTED(
                f"several forces act on body {body}; a table has room for one"
            )
        forces = [one[0] if one else BodyForce(body, (0.0, 0.0, 0.0)) for one in of_body]
        for name, pattern in columns.BODY_VECTORS.items():
            rows = [getattr(force, name) for force in forces]
            if np.any(rows):
                table |= _vector(pattern, rows, b=body)
        if any(force.following for force in forces):
            table[columns.BODY_FOLLOWING.format(b=body)] = [force.following for force in forces]
    turn = measurements.load.base_rotation
    if turn.any():
        table |= _vector(columns.BASE_TURN, [exactly_in_degrees(turn)] * len(loads))
    return table


def _vector(pattern: str, rows: Sequence[Any], **number: object) -> dict[str, Any]:
    coordinates = zip(AXES, zip(*rows, strict=True), strict=True)
    return {pattern.format(a=axis, **number): values for axis, values in coordinates}
