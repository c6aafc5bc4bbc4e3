"""Reading measurements from a CSV; `docs/measurements.md` describes its columns."""

from __future__ import annotations

import os
from itertools import pairwise
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from notchflex.analysis import axis_places
from notchflex.errors import InputError
from notchflex.fit.measurements import columns
from notchflex.fit.measurements.loading_order import Order, commands_of, loading_order
from notchflex.fit.measurements.measurements import Measurements
from notchflex.fit.measurements.reader import MeasurementReader
from notchflex.loads import LoadPath
from notchflex.loads.validation import check_pulls
from notchflex.results.files.csv_reading import Table, read_table
from notchflex.robot import Robot

Numbers = NDArray[np.float64]


def read_measurements(
    source: str | os.PathLike[str],
    robot: Robot,
    *,
    from_rest: bool | None = None,
    measured: Literal["ring", "edge"] = "ring",
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
    reader = MeasurementReader(read_table(source), robot)
    table = reader.table
    reader.check_numbers()
    external = reader.external()
    tension, stroke = reader.commands()
    check_pulls(tension, source=table.name)
    observed, deviation, axis_at = _observed(reader)
    base_rotation = reader.base_rotation()
    labels = next((reader.texts(name) for name in columns.PULL if name in table.header), None)
    in_file = reader.from_rest()
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
        ignored=tuple(name for name in table.header if name not in reader.used),
        order=order.words,
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
        f"{table.at(row)}: the {name} falls from {top:g} to {bottom:g} neither step by step nor "
        "to where the pull began, so the order of the rows does not show how the robot was loaded. "
        "Say so: --from-rest (a column from_rest "
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
    for column in columns.measured_columns(notches, tendons, axis_at.tolist()):
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
    points = columns.places_on_axis(table.header)
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


def _names(table: Table, column: columns.MeasuredColumn, points: list[str]) -> tuple[str, ...]:
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
            f"{table.at(row)}: {column} is {values[row]:g}; a standard deviation is above 0, or "
            "empty where it is not known."
        )
