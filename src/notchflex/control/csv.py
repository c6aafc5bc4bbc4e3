"""Reading targets from a CSV file, in the units of files: mm, N, deg."""

from __future__ import annotations

import os
from collections.abc import Iterator

import numpy as np

from notchflex._quantity import DEGREES
from notchflex.control.targets import DIRECTION, Targets, make_targets, sizes_of, target_shapes
from notchflex.errors import InputError
from notchflex.loads.validation import short_repr
from notchflex.results.files.csv_reading import read_table
from notchflex.results.quantities.registry import AXES, QUANTITIES
from notchflex.robot import Robot
from notchflex.robot.error_messages import nearest

# Columns of a simulation that say what was commanded are no targets, but may stand in the file.
_COMMANDS = ("tension", "stroke")


def read_targets(source: str | os.PathLike[str], robot: Robot) -> Targets:
    r"""Read targets from a CSV file.

    Columns have the names that results have: `tip_x_mm`, `tip_y_mm`, `tip_z_mm`, `total_deg`,
    `notch_1_deg`, ...; `tip_direction_x` (and `_y`, `_z`) is the unit vector along the tube at the
    tip. An empty entry is free. Other columns are not allowed, so that a slip is not ignored.

    Args:
        source: Path of the file.
        robot: The robot that is to meet them.

    Returns:
        The targets, one per row.

    Raises:
        InputError: The file cannot be used; the message names line and column.

    Example:
        >>> from pathlib import Path
        >>> from notchflex import load_robot
        >>> _ = Path("targets.csv").write_text("tip_x_mm,tip_z_mm\n2.1,9.5\n2.4,9.3\n")
        >>> len(read_targets("targets.csv", load_robot("pacheco2021-a")))
        2
    """
    table = read_table(source)
    columns = dict(_columns(robot))
    unknown = [name for name in table.header if name not in columns]
    if unknown:
        near = nearest(unknown[0], columns, 2)
        raise InputError.TABLE_COLUMNS(
            f"{table.name}: {short_repr(unknown[0])} is not a column of targets"
            f"{near or f'; there are {_shown(columns)}'}"
        )
    shapes = target_shapes(robot)
    values: dict[str, np.ndarray] = {}
    for header in table.header:
        name, index = columns[header]
        scale = DEGREES if header.endswith("_deg") else 1.0
        empty = np.full((len(table), *shapes[name]), np.nan)
        values.setdefault(name, empty)[(slice(None), *index)] = (
            table.numbers(header, may_miss=True) / scale
        )
    return make_targets(Targets(values), robot, several=True)


def _columns(robot: Robot) -> Iterator[tuple[str, tuple[str, tuple[int, ...]]]]:
    """Yield every column, and the quantity and entry that it is."""
    sizes = sizes_of(robot)
    for name in target_shapes(robot):
        if name == DIRECTION:
            yield from ((f"{DIRECTION}_{axis}", (name, (i,))) for i, axis in enumerate(AXES))
            continue
        quantity = QUANTITIES[name]
        if not quantity.column or name in _COMMANDS:
            continue
        match quantity.per:
            case ():
                yield quantity.header(), (name, ())
            case ("axis",):
                yield from ((quantity.header(axis=a), (name, (i,))) for i, a in enumerate(AXES))
            case ("notch",):
                count = sizes["notch"]
                yield from ((quantity.header(notch=i + 1), (name, (i,))) for i in range(count))
            case _:
                continue


def _shown(columns: dict[str, tuple[str, tuple[int, ...]]]) -> str:
    """Columns for a message: of those per notch the first alone."""
    names = [name for name, (_, index) in columns.items() if not ("notch_" in name and index[0])]
    return ", ".join(names)
