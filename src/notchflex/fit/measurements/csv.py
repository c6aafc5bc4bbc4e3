"""Measurements as CSV; `docs/measurements.md` describes the columns."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path
from typing import Any, Literal

import numpy as np

from notchflex import BodyForce, InputError, LoadPath, Robot
from notchflex.analysis import axis_places
from notchflex.fit.measurements.loading_order import Order, commands_of, loading_order
from notchflex.fit.measurements.measurements import MEASURED, Measurements, Numbers, fields_in
from notchflex.support import (
    AXES,
    QUANTITIES,
    AnyPath,
    ExternalLoad,
    Table,
    check_external,
    check_is_path,
    check_is_robot,
    check_pulls,
    no_tendon_column,
    read_data_table,
    write_columns,
)

_COMMANDS = {name: QUANTITIES[name].column for name in ("tension", "stroke")}
# Columns of the arguments of an external load, and of a force on a body.
_LOADS = {
    "tip_force": "tip_force_{axis}_N",
    "tip_moment": "tip_moment_{axis}_Nmm",
    "tip_point": "tip_point_{axis}_mm",
    "following": "following",
    "tip_mass": "tip_mass_g",
    "gravity": "gravity_{axis}_m_s2",
    "temperature": "temperature_C",
}
# A gravity of 0 differs from none given, with which a mass hangs; a temperature of 0 likewise.
_OPTIONAL = ("gravity", "temperature")
_BEND = "sheath_bend_deg"
_ON_BODIES = {
    "force": "body_{body}_force_{axis}_N",
    "moment": "body_{body}_moment_{axis}_Nmm",
    "point": "body_{body}_point_{axis}_mm",
    "following": "body_{body}_following",
}
_BASE_ROTATION = "base_r{axis}_deg"
_DIRECTIONS = {"loading": 1, "load": 1, "up": 1, "unloading": -1, "unload": -1, "down": -1}

_NUMBERED = re.compile(r"(notch|tendon|body)_(\d+)_(\w+_)?(deg|N|mm|Nmm|following)")
_ON_AXIS = re.compile(r"axis_(\d+(?:\.\d+)?)_[xyz]_(?:sd_)?mm")

Columns = dict[tuple[int, ...], str]
"""Headers of columns by the index of their numbers in an array."""


def headers(pattern: str, shape: Sequence[int], points: Sequence[str] = ()) -> Columns:
    """Return the columns of an array; a single tendon has no number.

    Example:
        >>> headers("notch_{notch}_deg", (2,))
        {(0,): 'notch_1_deg', (1,): 'notch_2_deg'}
    """
    names, bodies = fields_in(pattern), range(max(shape, default=0))
    numbers = [number + 1 for number in bodies]
    labels: dict[str, Sequence[object]] = {
        "notch": numbers,
        "body": bodies,
        "tendon": [f"_{number}" for number in numbers] if shape != (1,) else [""],
        "point": points,
        "axis": AXES,
    }
    return {
        index: pattern.format(**{n: labels[n][i] for n, i in zip(names, index, strict=True)})
        for index in np.ndindex(*shape)
    }


def deviation_header(header: str) -> str:
    """Return the header of the standard deviation of a column.

    Example:
        >>> deviation_header("notch_1_deg")
        'notch_1_sd_deg'
    """
    head, _, unit = header.rpartition("_")
    return f"{head}_sd_{unit}"


@dataclass
class MeasurementReader:
    """A table of measurements of a robot; `used` are the columns read so far."""

    table: Table
    robot: Robot
    used: set[str] = field(default_factory=set[str])

    @cached_property
    def points(self) -> dict[str, float]:
        """The points on the axis, rising: as the columns write them, and as numbers, mm."""
        points: dict[float, str] = {}
        for name in self.table.header:
            if (match := _ON_AXIS.fullmatch(name)) is None:
                continue
            text, distance = match[1], float(match[1])
            try:
                axis_places(self.robot, distance)
            except InputError as problem:
                message = f"{self.table.name}: column {name}: {problem}."
                raise InputError.TABLE_COLUMNS(message) from None
            if points.setdefault(distance, text) != text:
                raise InputError.TABLE_COLUMNS(
                    f"{self.table.name}: the columns axis_{points[distance]}_... and "
                    f"axis_{text}_... are of one point; keep one of them."
                )
        return {points[distance]: distance for distance in sorted(points)}

    @cached_property
    def sizes(self) -> dict[str, int]:
        """How many of each the robot has that columns are counted by."""
        notches, tendons = self.robot.number_of_notches, self.robot.number_of_tendons
        sizes = {"notch": notches, "tendon": tendons, "body": notches + 1}
        return sizes | {"point": len(self.points), "axis": len(AXES)}

    def check_numbers(self) -> None:
        """Refuse columns of notches, tendons or bodies that the robot does not have."""
        for name in self.table.header:
            if (match := _NUMBERED.fullmatch(name)) is None:
                continue
            part, first = match[1], int(match[1] != "body")
            last = self.sizes[part] + first - 1
            if not first <= int(match[2]) <= last:
                has = f"{part} {first}" + f" to {last}" * (last > first)
                raise InputError.TABLE_COLUMNS(
                    f"{self.table.name}: there is a column {name}, but {self.robot.name} has "
                    f"{has}; choose the robot that was measured."
                )

    def texts(self, *names: str) -> tuple[str, ...] | None:
        """Return the first of some columns that is there, as texts; None if none is."""
        for name in names:
            if name in self.table.header:
                self.used.add(name)
                return self.table.texts(name)
        return None

    def numbers(self, name: str, *, may_miss: bool = False, is_load: bool = False) -> Numbers:
        """Return a column of numbers, of which some may be missing (NaN); angles in rad."""
        self.used.add(name)
        values = self.table.numbers(name, may_miss=may_miss, is_load=is_load)
        wrong = ~np.isin(values, (0.0, 1.0))
        if name.endswith(("following", "from_rest")) and wrong.any():
            place = self.table.place_of(int(np.argmax(wrong)))
            raise InputError.NOT_A_NUMBER(f"{place}: {name} is neither 0 nor 1.")
        return np.radians(values) if name.endswith("_deg") else values

    def columns(self, pattern: str) -> Columns:
        """Return the columns of an array; the only tendon may have a number in the file."""
        shape = tuple(self.sizes[name] for name in fields_in(pattern))
        columns = headers(pattern, shape, [*self.points])
        if self.sizes["tendon"] == 1:
            for index, name in columns.items():
                numbered = name.replace("tendon_", "tendon_1_", 1)
                if name not in self.table.header and numbered in self.table.header:
                    columns[index] = numbered
        return columns

    def array(self, pattern: str, empty: float = 0.0, **options: bool) -> Any:
        """Return the numbers of columns, rows as leading axis; None if no column is there."""
        shape = (self.sizes[name] for name in fields_in(pattern))
        values = np.full((len(self.table), *shape), empty)
        columns = self.columns(pattern)
        for index, name in columns.items():
            if name in self.table.header:
                values[:, *index] = self.numbers(name, **options)
        return values if self.used & {*columns.values()} else None

    def same_in_all(self, pattern: str, what: str, remedy: str) -> Any:
        """Return the first row of what must be the same in all; None if no column is there."""
        values = self.array(pattern)
        if values is None:
            return None
        for row, value in enumerate(values):
            if np.any(value != values[0]):
                raise InputError.UNSUPPORTED(
                    f"{self.table.place_of(row)}: {what} differs from the row before it; {remedy}."
                )
        return values[0]

    def commands(self) -> tuple[Numbers, Numbers]:
        """Return measured tensions and strokes, rows by tendons; NaN where the other is given."""
        table, tendons = self.table, self.sizes["tendon"]
        both = [self.columns(pattern) for pattern in _COMMANDS.values()]
        if not self.used and not {*both[0].values(), *both[1].values()} & {*table.header}:
            raise no_tendon_column(table, tendons)
        commands = np.full((2, len(table), tendons), np.nan)
        for tendon in range(tendons):
            names = [columns[tendon,] for columns in both if columns[tendon,] in table.header]
            missing = np.ones(len(table), bool)
            for values, columns in zip(commands, both, strict=True):
                if columns[tendon,] in names and missing.any():
                    read = self.numbers(columns[tendon,], may_miss=True, is_load=True)
                    values[missing, tendon] = read[missing]
                    missing &= np.isnan(read)
            if names and missing.any():
                raise InputError.MISSING_VALUE(
                    f"{table.place_of(int(np.argmax(missing)))}: {' and '.join(names)} "
                    f"{'are' if len(names) > 1 else 'is'} nothing; say what was done to the "
                    "tendon, 0 N where it was slack."
                )
        return commands[0], commands[1]

    def external(self) -> tuple[ExternalLoad, ...]:
        """Return the external loads, row by row."""
        arrays, on_bodies = (
            {
                name: values.astype(bool) if name == "following" else values
                for name, pattern in patterns.items()
                if (values := self.array(pattern)) is not None
            }
            for patterns in (_LOADS, _ON_BODIES)
        )
        on_bodies.setdefault("force", np.zeros((len(self.table), self.sizes["body"], 3)))
        acting = [on_bodies[name].any(axis=-1) for name in ("force", "moment") if name in on_bodies]
        acts = np.any(acting, axis=0)
        loads: list[ExternalLoad] = []
        bends = self.array(_BEND, np.nan, may_miss=True)
        for row in range(len(self.table)):
            place = self.table.place_of(row)
            forces = [
                BodyForce(body, **{name: values[row, body] for name, values in on_bodies.items()})
                for body in np.flatnonzero(acts[row]).tolist()
            ]
            try:
                tip = {name: values[row] for name, values in arrays.items()}
                if bends is not None and not np.isnan(bends[row]):
                    tip[_BEND] = round(np.degrees(bends[row]), 9)  # as it stands in the file
                load = ExternalLoad(**tip, body_forces=forces)
                check_external(load, self.robot)
            except InputError as problem:
                raise InputError(f"{place}: {problem}.", problem.code) from None
            loads.append(load)
        return tuple(loads)

    def observed(self) -> tuple[dict[str, Numbers], dict[str, Numbers]]:
        """Return measured quantities and their standard deviations."""
        table = self.table
        observed: dict[str, Numbers] = {}
        deviation: dict[str, Numbers] = {}
        for name, quantity in MEASURED.items():
            values = self.array(quantity.columns, np.nan, may_miss=True)
            spread = self._deviation(quantity.columns)
            if values is not None and not np.isnan(values).all():
                observed[name] = values
                if not np.isnan(spread).all():
                    deviation[name] = spread
        if not observed:
            raise InputError.NO_DATA(
                f"{table.name}: nothing is measured; no column has a number, such as "
                f"notch_1_deg, total_deg, tip_x_mm or axis_5_x_mm; {table.columns}."
            )
        return observed, deviation

    def _deviation(self, pattern: str) -> Numbers:
        """Standard deviations of what some columns hold; NaN where unknown."""
        table, columns = self.table, self.columns(pattern)
        values = np.full((len(table), *(self.sizes[name] for name in fields_in(pattern))), np.nan)
        for index, measured in columns.items():
            name = deviation_header(measured)
            if name not in table.header:
                continue
            if measured not in table.header:
                raise InputError.TABLE_COLUMNS(
                    f"{table.name}: there is a column {name}, but none of what it is the "
                    f"standard deviation of; add {measured}."
                )
            values[:, *index] = spread = self.numbers(name, may_miss=True)
            check_deviation(table, name, spread)
        return values

    def directions(self) -> list[int]:
        """Return 1 for rows of loading, -1 for rows of unloading; nothing without a column."""
        texts = self.texts("direction") or ()
        for row, text in enumerate(texts):
            if text.lower() not in _DIRECTIONS:
                raise InputError.TABLE_COLUMNS(
                    f"{self.table.place_of(row)}: direction is {text or 'nothing'!r}; give loading "
                    "or unloading."
                )
        return [_DIRECTIONS[text.lower()] for text in texts]


def read_measurements(
    source: AnyPath,
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
    check_is_path(source, "a CSV")
    reader = MeasurementReader(read_data_table(source, columns), check_is_robot(robot))
    table = reader.table
    reader.check_numbers()
    external = reader.external()
    tension, stroke = reader.commands()
    check_pulls(tension, source=table.name)
    observed, deviation = reader.observed()
    remedy = "write a file for each way that it is turned"
    rotation = reader.same_in_all(_BASE_ROTATION, "the base rotation", remedy)
    in_file = reader.same_in_all("from_rest", "from_rest", "it is the same for all")
    labels = reader.texts("pull", "trial")
    if in_file is None and -1 in (directions := reader.directions()):
        in_file = False  # unloading follows loading, and the next pull follows unloading
        starts = np.diff(directions, prepend=1) > 0
        labels = labels or tuple(map(str, 1 + np.cumsum(starts)))
    if from_rest is None and in_file is not None:
        from_rest = bool(in_file)
    order = _order(table, tension, stroke, labels, from_rest)
    rotation = np.zeros(3) if rotation is None else rotation
    measurements = Measurements(
        source=table.name,
        load=LoadPath(np.maximum(tension, 0.0), stroke, rotation, external),
        pull=order.pull,
        from_rest=order.from_rest,
        observed=observed,
        deviation=deviation,
        axis_at=np.array([*reader.points.values()] if "axis_points" in observed else [], float),
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
        return Order(False, labels or ("1",) * len(table))
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
    load, loads = measurements.load, measurements.load.external
    given = ~np.isnan(load.tension) | ~np.isnan(load.stroke)
    for tendon in np.flatnonzero(given.any(axis=0) & ~given.all(axis=0)):
        raise InputError.UNSUPPORTED(
            f"tendon {tendon + 1} is commanded in some rows only; give 0 N where it is slack"
        )
    for name in _OPTIONAL:
        if len({getattr(load, name) is None for load in loads}) > 1:
            raise InputError.UNSUPPORTED(
                f"{name} is given in some rows only; give it in all or in none"
            )
    table: dict[str, Any] = {"pull": measurements.pull}
    table |= _filled(_COMMANDS["tension"], measurements.measured_tension)
    table |= _filled(_COMMANDS["stroke"], load.stroke)
    for name, pattern in _LOADS.items():
        values = np.array([getattr(load, name) for load in loads], float)
        table |= _filled(pattern, values if name in _OPTIONAL else _nan_for_zeros(values))
    bends = [getattr(load, _BEND) for load in loads]
    table |= _filled(_BEND, np.radians(np.array(bends, float)))
    for name, values in _on_bodies(loads).items():
        table |= _filled(_ON_BODIES[name], _nan_for_zeros(values))
    table |= _filled(_BASE_ROTATION, _nan_for_zeros(np.tile(load.base_rotation, (len(loads), 1))))
    points = [np.format_float_positional(place, trim="-") for place in measurements.axis_at]
    for name, values in measurements.observed.items():
        pattern = MEASURED[name].columns
        spread = measurements.deviation.get(name, np.full_like(values, np.nan))
        deviations = _filled(pattern, spread, points)
        for header, column in _filled(pattern, values, points).items():
            table[header] = column
            if header in deviations:
                table[deviation_header(header)] = deviations[header]
    table["from_rest"] = [measurements.from_rest] * len(measurements)
    write_columns(target, table)


def _filled(pattern: str, values: Numbers, points: Sequence[str] = ()) -> dict[str, Numbers]:
    """Columns of an array, (P, ...), that are not all NaN."""
    if np.isnan(values).all():
        return {}
    values = exactly_in_degrees(values) if pattern.endswith("_deg") else values
    columns = headers(pattern, values.shape[1:], points).items()
    return {
        header: values[:, *index] for index, header in columns if ~np.isnan(values[:, *index]).all()
    }


def _nan_for_zeros(values: Numbers) -> Numbers:
    return np.where(values.any(axis=0), values, np.nan)


def _on_bodies(loads: Sequence[ExternalLoad]) -> dict[str, Numbers]:
    """Forces on bodies as arrays, rows and bodies as leading axes."""
    bodies = 1 + max((force.body for load in loads for force in load.body_forces), default=0)
    shape = (len(loads), bodies, 3)
    arrays: dict[str, Any] = {name: np.zeros(shape) for name in ("force", "moment", "point")}
    arrays["following"] = np.zeros((len(loads), bodies))
    for row, load in enumerate(loads):
        for force in load.body_forces:
            if sum(force.body == other.body for other in load.body_forces) > 1:
                raise InputError.UNSUPPORTED(
                    f"several forces act on body {force.body}; a table has room for one"
                )
            for name, values in arrays.items():
                values[row, force.body] = getattr(force, name)
    return arrays


def exactly_in_degrees(angle: Numbers) -> Numbers:
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
