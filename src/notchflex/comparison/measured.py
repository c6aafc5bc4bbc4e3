"""Reading a CSV of measured notch angles."""

from __future__ import annotations

import os
import re
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from notchflex.errors import InputError
from notchflex.results.csv_reading import Table, no_tendon_column, read_table, tendon_columns
from notchflex.results.quantities import QUANTITIES
from notchflex.robot import Robot

NOTCH_COLUMN = re.compile(QUANTITIES["notch_angle"].header(notch=r"(\d+)"))
TOTAL_COLUMN = QUANTITIES["total_angle"].header()
TRIAL_COLUMN = "trial"


@dataclass(frozen=True)
class Measured:
    """Measured angles of every notch, P points, and what was done to the tendons.

    Attributes:
        source: Where the data came from.
        tension: Measured base tension [N], (P, t), as measured; NaN where a stroke is given.
        stroke: Measured stroke [mm], (P, t); NaN where a tension is given.
        notch_angle: Measured angle of every notch [rad], (P, n).
        total_angle: Measured total angle [rad], (P,): its own column, or the sum of the notches.
        trial: Which pull each point belongs to, P labels.
        ignored: Columns that were not used, in the order of the file.
    """

    source: str
    tension: NDArray[np.float64]
    stroke: NDArray[np.float64]
    notch_angle: NDArray[np.float64]
    total_angle: NDArray[np.float64]
    trial: tuple[str, ...]
    ignored: tuple[str, ...] = ()

    def __len__(self) -> int:
        return len(self.total_angle)

    @property
    def model_tension(self) -> NDArray[np.float64]:
        """Tensions that the model is given [N], (P, t): no less than 0."""
        return np.maximum(self.tension, 0.0)

    @property
    def negative_forces(self) -> int:
        """Number of points with a negative force: the offset of a sensor, 0 N in the model."""
        return int((self.tension < 0.0).any(axis=1).sum())


def read_measured(source: str | os.PathLike[str], robot: Robot) -> Measured:
    """Read measured notch angles of a robot.

    The file is a CSV (UTF-8, commas, header first; lines that start with `#` are skipped) with

    * `tendon_force_N` or `tendon_displacement_mm`; for a robot of several tendons
      `tendon_1_force_N`, `tendon_2_displacement_mm`, ... (a tendon without a column is slack),
    * `notch_1_deg` ... `notch_n_deg`, base to tip, with precurvature,
    * if wanted `trial` (any label; one pull each) and `total_deg`.

    Other columns are ignored and listed in `Measured.ignored`. Where both force and displacement
    of a tendon are there, the force is used.

    Args:
        source: Path of the file.
        robot: The robot that was measured.

    Returns:
        The points, in the order of the file.

    Raises:
        InputError: No such file, not a CSV, empty, a column is missing, or an entry is no finite
            number; the message names the line and the column.
    """
    table = read_table(source)
    header, tendons = table.header, robot.number_of_tendons
    tension_columns, stroke_columns = _commanding_columns(table, tendons)
    notch_columns = _notch_columns(table, robot)
    used = {*tension_columns.values(), *stroke_columns.values(), *notch_columns}
    optional = [column for column in (TOTAL_COLUMN, TRIAL_COLUMN) if column in header]

    def commanded(columns: dict[int, str]) -> NDArray[np.float64]:
        values = np.full((len(table), tendons), np.nan)
        for tendon, column in columns.items():
            values[:, tendon] = table.numbers(column)
        return values

    notch_angle = np.radians(np.stack([table.numbers(one) for one in notch_columns], axis=1))
    if TOTAL_COLUMN in header:
        total_angle = np.radians(table.numbers(TOTAL_COLUMN))
    else:
        total_angle = notch_angle.sum(axis=1)
    trial = table.texts(TRIAL_COLUMN) if TRIAL_COLUMN in header else ("1",) * len(table)
    return Measured(
        source=table.name,
        tension=commanded(tension_columns),
        stroke=commanded(stroke_columns),
        notch_angle=notch_angle,
        total_angle=total_angle,
        trial=trial,
        ignored=tuple(column for column in header if column not in {*used, *optional}),
    )


def _commanding_columns(table: Table, tendons: int) -> tuple[dict[int, str], dict[int, str]]:
    """Return the column of the tension or, where there is none, the stroke of each tendon."""
    tension = tendon_columns(table.header, "tension", tendons)
    stroke = tendon_columns(table.header, "stroke", tendons)
    stroke = {tendon: column for tendon, column in stroke.items() if tendon not in tension}
    if not tension and not stroke:
        raise no_tendon_column(table, tendons)
    return tension, stroke


def _notch_columns(table: Table, robot: Robot) -> list[str]:
    notches = robot.number_of_notches
    wanted = [QUANTITIES["notch_angle"].header(notch=j + 1) for j in range(notches)]
    there = [column for column in table.header if NOTCH_COLUMN.fullmatch(column)]
    missing = [column for column in wanted if column not in there]
    extra = [column for column in there if column not in wanted]
    if missing:
        which = f"column {missing[0]}" if len(missing) == 1 else f"columns {', '.join(missing)}"
        is_not = "is not" if len(missing) == 1 else "are not"
        raise InputError(
            f"{table.name}: the {which} {is_not} there; {robot.name} has {notches} notches and "
            f"each needs its measured angle. The columns are {', '.join(table.header)}."
        )
    if extra:
        raise InputError(
            f"{table.name}: there is a column {extra[0]}, but {robot.name} has {notches} notches; "
            "choose the robot that was measured."
        )
    return wanted
