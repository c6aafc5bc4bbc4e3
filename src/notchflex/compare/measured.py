"""Reading a CSV of measured notch angles."""

from __future__ import annotations

import csv
import math
import os
import re
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from notchflex.errors import InputError
from notchflex.results.quantities import QUANTITIES
from notchflex.robot import Robot

NOTCH_COLUMN = re.compile(QUANTITIES["notch_angle"].header(notch=r"(\d+)"))
TOTAL_COLUMN = QUANTITIES["total_angle"].header()
TRIAL_COLUMN = "trial"
LARGEST = 1e6
"""Nothing that was measured (N, mm, deg) is larger; a slip of the keyboard is."""


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
    header, lines, rows = _read_table(Path(source))
    name = str(source)
    tension_columns, stroke_columns = _tendon_columns(header, robot.number_of_tendons, name)
    notch_columns = _notch_columns(header, robot, name)
    used = {*tension_columns.values(), *stroke_columns.values(), *notch_columns}
    optional = [column for column in (TOTAL_COLUMN, TRIAL_COLUMN) if column in header]

    def numbers(column: str) -> NDArray[np.float64]:
        position = header.index(column)
        return np.array(
            [
                _number(row[position], column, line, name)
                for line, row in zip(lines, rows, strict=True)
            ]
        )

    def commanded(columns: dict[int, str]) -> NDArray[np.float64]:
        table = np.full((len(rows), robot.number_of_tendons), np.nan)
        for tendon, column in columns.items():
            table[:, tendon] = numbers(column)
        return table

    notch_angle = np.radians(np.stack([numbers(column) for column in notch_columns], axis=1))
    if TOTAL_COLUMN in header:
        total_angle = np.radians(numbers(TOTAL_COLUMN))
    else:
        total_angle = notch_angle.sum(axis=1)
    if TRIAL_COLUMN in header:
        trial = tuple(row[header.index(TRIAL_COLUMN)].strip() for row in rows)
    else:
        trial = ("1",) * len(rows)
    return Measured(
        source=name,
        tension=commanded(tension_columns),
        stroke=commanded(stroke_columns),
        notch_angle=notch_angle,
        total_angle=total_angle,
        trial=trial,
        ignored=tuple(column for column in header if column not in {*used, *optional}),
    )


def _read_table(path: Path) -> tuple[list[str], list[int], list[list[str]]]:
    """Return the header, the line number of every row, and the rows."""
    try:
        # utf-8-sig: spreadsheets put a byte-order mark before the first column's name.
        text = path.read_text(encoding="utf-8-sig")
    except FileNotFoundError:
        raise InputError(f"{path}: there is no such file.") from None
    except IsADirectoryError:
        raise InputError(f"{path} is a folder; name a CSV file.") from None
    except UnicodeDecodeError:
        raise InputError(f"{path} is no text in UTF-8; save it as CSV.") from None
    except (OSError, ValueError) as problem:
        words = getattr(problem, "strerror", None) or str(problem)
        raise InputError(f"{path} cannot be read: {words}.") from None
    table: list[tuple[int, list[str]]] = []
    try:
        reader = csv.reader(text.splitlines(), strict=True)
        for row in reader:
            if any(field.strip() for field in row) and not row[0].lstrip().startswith("#"):
                table.append((reader.line_num, [field.strip() for field in row]))
    except csv.Error as problem:
        raise InputError(f"{path} is no CSV: {problem}.") from None
    if not table:
        raise InputError(f"{path} is empty; it needs a header and at least one row of numbers.")
    (_, header), *body = table
    separators = {";": "semicolons", "\t": "tabs"}
    found = [word for mark, word in separators.items() if mark in header[0]]
    if len(header) == 1 and found:
        raise InputError(
            f"{path}: the columns are separated by {found[0]}; save it with commas between the "
            "columns and points in the numbers."
        )
    for column in header:
        if column and header.count(column) > 1:
            raise InputError(f"{path}: the column {column} is there more than once; keep one.")
    if not body:
        raise InputError(f"{path} has a header and no rows; it needs at least one row of numbers.")
    for line, row in body:
        if len(row) != len(header):
            raise InputError(
                f"{path}, line {line}: {len(row)} entries for {len(header)} columns; "
                "every row needs one entry for each column."
            )
    return header, [line for line, _ in body], [row for _, row in body]


def _tendon_columns(
    header: Sequence[str], tendons: int, name: str
) -> tuple[dict[int, str], dict[int, str]]:
    """Return the column of the tension or, where there is none, the stroke of each tendon."""
    found: tuple[dict[int, str], dict[int, str]] = ({}, {})
    for quantity, columns in zip(("tension", "stroke"), found, strict=True):
        for tendon in range(tendons):
            labels: list[object] = [tendon + 1] if tendons > 1 else ["", 1]
            for label in labels:
                column = QUANTITIES[quantity].header(tendon=label)
                if column in header:
                    columns[tendon] = column
                    break
    tension, stroke = found
    stroke = {tendon: column for tendon, column in stroke.items() if tendon not in tension}
    if not tension and not stroke:
        label = "" if tendons == 1 else 1
        wanted = [QUANTITIES[q].header(tendon=label) for q in ("tension", "stroke")]
        more = "" if tendons == 1 else f" (and so on to tendon {tendons})"
        raise InputError(
            f"{name}: there is no column {wanted[0]} or {wanted[1]}{more}; "
            f"the columns are {', '.join(header)}."
        )
    return tension, stroke


def _notch_columns(header: Sequence[str], robot: Robot, name: str) -> list[str]:
    notches = robot.number_of_notches
    wanted = [QUANTITIES["notch_angle"].header(notch=j + 1) for j in range(notches)]
    there = [column for column in header if NOTCH_COLUMN.fullmatch(column)]
    missing = [column for column in wanted if column not in there]
    extra = [column for column in there if column not in wanted]
    if missing:
        which = f"column {missing[0]}" if len(missing) == 1 else f"columns {', '.join(missing)}"
        is_not = "is not" if len(missing) == 1 else "are not"
        raise InputError(
            f"{name}: the {which} {is_not} there; {robot.name} has {notches} notches and each "
            f"needs its measured angle. The columns are {', '.join(header)}."
        )
    if extra:
        raise InputError(
            f"{name}: there is a column {extra[0]}, but {robot.name} has {notches} notches; "
            "choose the robot that was measured."
        )
    return wanted


def _number(text: str, column: str, line: int, name: str) -> float:
    try:
        value = float(text)
    except ValueError:
        got = repr(text) if text else "nothing"
        raise InputError(f"{name}, line {line}: {column} is {got}; give a number.") from None
    if not math.isfinite(value):
        raise InputError(f"{name}, line {line}: {column} is {text}; give a finite number.")
    if abs(value) > LARGEST:
        raise InputError(f"{name}, line {line}: {column} is {text}; give at most {LARGEST:g}.")
    return value
