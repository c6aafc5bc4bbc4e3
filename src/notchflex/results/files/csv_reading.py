"""Tables of numbers from CSV files; errors name the line and the column.

A table is UTF-8 with commas and its header first; empty lines and lines that start with `#` are
skipped. Semicolons between the columns, as spreadsheets write them where numbers have a decimal
comma, are read too.
"""

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
from notchflex.results.files.writing import read_text
from notchflex.results.quantities.registry import QUANTITIES

LARGEST = 1e6
"""Nothing that was measured (N, mm, deg, g) is larger; a slip of the keyboard is."""

_DECIMAL = re.compile(r"[-+]?\d*([.,])\d+(?:[eE][-+]?\d+)?")


@dataclass(frozen=True)
class Table:
    """A table as it stands in a file.

    Attributes:
        name: The file, for messages.
        header: Names of the columns.
        lines: Line of the file that each row stands in.
        rows: Entries of each row, as many as columns, without spaces around them.
        decimal: What separates the decimals of its numbers, a point or a comma.
    """

    name: str
    header: tuple[str, ...]
    lines: tuple[int, ...]
    rows: tuple[tuple[str, ...], ...]
    decimal: str = "."

    def __len__(self) -> int:
        return len(self.rows)

    def texts(self, column: str) -> tuple[str, ...]:
        """Return the entries of a column."""
        position = self.header.index(column)
        return tuple(row[position] for row in self.rows)

    def numbers(
        self, column: str, *, may_miss: bool = False, is_load: bool = False
    ) -> NDArray[np.float64]:
        """Return a column of numbers, (rows,).

        Args:
            column: Its name.
            may_miss: Whether an entry may be empty, which is then NaN.
            is_load: Whether another column must have what is empty here, so that a message does
                not advise to leave an entry empty.

        Raises:
            InputError: An entry is not a finite number; the message names line and column.
        """
        hint = "; leave the entry empty where there is none" if may_miss and not is_load else ""
        return np.array(
            [
                math.nan if may_miss and not text else self._number(text, column, line, hint)
                for text, line in zip(self.texts(column), self.lines, strict=True)
            ]
        )

    def _number(self, text: str, column: str, line: int, hint: str) -> float:
        at = f"{self.name}, line {line}: {column} is {text}"
        try:
            value = float(text.replace(self.decimal, ".", 1))
        except ValueError:
            got = repr(text) if text else "nothing"
            at = f"{self.name}, line {line}: {column} is {got}"
            raise InputError.NOT_A_NUMBER(f"{at}; give a number{hint}.") from None
        if not math.isfinite(value):
            raise InputError.NOT_FINITE(f"{at}; give a finite number{hint}.")
        if abs(value) > LARGEST:
            raise InputError.OUT_OF_RANGE(f"{at}; give at most {LARGEST:g}.")
        return value

    def at(self, row: int) -> str:
        """Return where a row (from 0) stands, as messages begin: file and line."""
        return f"{self.name}, line {self.lines[row]}"

    @property
    def columns(self) -> str:
        """The columns, for a message."""
        return f"the columns are {', '.join(self.header)}"


def read_table(source: str | os.PathLike[str]) -> Table:
    """Read a table.

    Args:
        source: Path of the file.

    Returns:
        Its header and rows, at least one.

    Raises:
        InputError: No such file, not a CSV, empty, two columns of one name, or a row that has
            more or fewer entries than the header.
    """
    path, text = Path(source), read_text(source, "CSV file")
    separator = _separator(text)
    reader = csv.reader(text.splitlines(), strict=True, delimiter=separator)
    try:
        table = [
            (reader.line_num, tuple(map(str.strip, row)))
            for row in reader
            if any(map(str.strip, row)) and not row[0].lstrip().startswith("#")
        ]
    except csv.Error as problem:
        raise InputError.FILE_UNREADABLE(f"{path} is not a CSV: {problem}.") from None
    if not table:
        raise InputError.TABLE_ROWS(
            f"{path} is empty; it needs a header and at least one row of numbers."
        )
    (_, header), *numbered = table
    if len(header) == 1 and "\t" in header[0]:
        raise InputError.FILE_FORMAT(
            f"{path}: the columns are separated by tabs; save it with commas between the columns "
            "and points in the numbers."
        )
    for column in header:
        if column and header.count(column) > 1:
            raise InputError.TABLE_COLUMNS(
                f"{path}: the column {column} is there more than once; keep one."
            )
    if not numbered:
        raise InputError.TABLE_ROWS(
            f"{path} has a header and no rows; it needs at least one row of numbers."
        )
    for line, row in numbered:
        if len(row) != len(header):
            raise InputError.TABLE_ROWS(
                f"{path}, line {line}: {len(row)} entries for {len(header)} columns; every row "
                "needs one entry for each column."
            )
    lines, rows = zip(*numbered, strict=True)
    decimal = "." if separator == "," else _decimal(path, lines, rows)
    return Table(str(source), header, lines, rows, decimal)


def _separator(text: str) -> str:
    """Return what separates the columns: a semicolon where the header has no comma."""
    lines = (line for line in text.splitlines() if line.strip(" ;,"))
    header = next((line for line in lines if not line.lstrip().startswith("#")), "")
    return ";" if ";" in header and "," not in header else ","


def _decimal(path: Path, lines: Sequence[int], rows: Sequence[Sequence[str]]) -> str:
    """Return the decimal separator of a table with semicolons, whose numbers may have either.

    Raises:
        InputError: Some numbers have a comma and others a point: one of them separates thousands.
    """
    first: dict[str, tuple[int, str]] = {}
    for line, row in zip(lines, rows, strict=True):
        for entry in row:
            if number := _DECIMAL.fullmatch(entry):
                first.setdefault(number[1], (line, entry))
    if len(first) == 2:
        (line, entry), (other_line, other) = sorted(first.values())
        raise InputError.FILE_FORMAT(
            f"{path}: {entry} in line {line} and {other} in line {other_line} have different "
            "decimal separators; write all numbers with points, or all with commas."
        )
    return next(iter(first), ".")


def tendon_columns(header: Sequence[str], quantity: str, tendons: int) -> dict[int, str]:
    """Return the column of a quantity of each tendon (from 0) that has one.

    Args:
        header: The columns.
        quantity: Name of a quantity of the table of quantities, such as "tension".
        tendons: How many tendons the robot has; the only one may go without its number.
    """
    columns: dict[int, str] = {}
    for tendon in range(tendons):
        labels: list[object] = [tendon + 1] if tendons > 1 else ["", 1]
        names = (QUANTITIES[quantity].header(tendon=label) for label in labels)
        column = next((name for name in names if name in header), None)
        if column is not None:
            columns[tendon] = column
    return columns


def no_tendon_column(table: Table, tendons: int) -> InputError:
    """Return what is raised where a table has no column for any tendon."""
    label = "" if tendons == 1 else 1
    wanted = [QUANTITIES[q].header(tendon=label) for q in ("tension", "stroke")]
    more = "" if tendons == 1 else f" (and so on to tendon {tendons})"
    return InputError.TABLE_COLUMNS(
        f"{table.name}: there is no column {wanted[0]} or {wanted[1]}{more}; {table.columns}."
    )
