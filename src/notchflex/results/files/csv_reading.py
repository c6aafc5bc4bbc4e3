"""Tables of numbers from CSV files; errors name the line and the column.

A table is UTF-8 with commas and its header first; empty lines and lines that start with `#` are
skipped. Semicolons between the columns, as spreadsheets write them where numbers have a decimal
comma, are read too.
"""

from __future__ import annotations

import csv
import dataclasses
import math
import os
import re
from collections.abc import Container, Mapping, Sequence, Set
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from notchflex.errors import InputError
from notchflex.results.quantities.registry import QUANTITIES
from notchflex.robot.reading import read_text

TOLD_COLUMNS = (
    "give tension, stroke, total, notch_1 or the usual name of a column with its unit, such as "
    "tip_x_mm"
)
"""What `columns` and `--column` may name, for messages."""

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
        written: Columns that have another name in the file, to that name.
        named: Columns that the caller told by their header.
    """

    name: str
    header: tuple[str, ...]
    lines: tuple[int, ...]
    rows: tuple[tuple[str, ...], ...]
    decimal: str = "."
    written: Mapping[str, str] = field(default_factory=dict[str, str])
    named: Set[str] = frozenset()

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
        column = self.written.get(column, column)
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

    def unused(self, used: Container[str]) -> tuple[str, ...]:
        """Return the columns that a reader did not use.

        Raises:
            InputError: The caller told one of them.
        """
        unused = tuple(column for column in self.header if column not in used)
        for column in unused:
            if column in self.named:
                raise InputError.UNKNOWN_NAME(
                    f"{self.name}: {column} is no quantity that is read; {TOLD_COLUMNS}."
                )
        return unused

    @property
    def columns(self) -> str:
        """The columns, for a message."""
        return f"the columns are {', '.join(self.written.get(one, one) for one in self.header)}"


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
        f"{table.name}: there is no column {wanted[0]} or {wanted[1]}{more}; {table.columns}. "
        f'Say which it is: --column tension="{_likely(table)}".'
    )


def _likely(table: Table) -> str:
    """Return the header that a tension most likely has: of its unit, or the first."""
    forces = (name for name in table.header if re.search(r"(^|[^A-Za-z])N$", name.rstrip(")] ")))
    header = next(forces, table.header[0])
    return table.written.get(header, header)


_UNITS = {
    "N": {"N": 1.0, "mN": 1e-3, "kN": 1e3},
    "mm": {"mm": 1.0, "m": 1e3, "cm": 10.0, "um": 1e-3, "µm": 1e-3, "μm": 1e-3},
    "deg": {"deg": 1.0, "°": 1.0, "degree": 1.0, "degrees": 1.0, "rad": math.degrees(1.0)},
    "g": {"g": 1.0, "kg": 1e3},
    "Nmm": {"Nmm": 1.0, "N mm": 1.0, "Nm": 1e3, "mNm": 1.0},
}
"""Unit of a column to the units that are understood and what converts them."""
_BASE = {unit: (base, factor) for base, units in _UNITS.items() for unit, factor in units.items()}
_BRACKETED = re.compile(r"(.*?)\s*[\[(]\s*([^\[\]()]+?)\s*[\])]")
_APPENDED = re.compile(r"(.*)_(mN|kN|m|cm|um|rad|kg|g|N|mm|deg)")

_QUANTITIES = {
    ("tendon{n}_force", "N"): ("tension", "force", "tendon force", "cable force"),
    ("tendon{n}_displacement", "mm"): ("stroke", "displacement", "tendon displacement"),
    ("total", "deg"): ("total", "angle", "total angle", "bending angle", "bend angle"),
    ("notch{n}", "deg"): ("notch", "notch angle"),
}
"""Column and its unit to the words for it, in lower case and without numbers."""
_PLAIN = re.compile(r"photograph|pull|trial|from_rest|tip_direction_[xyz]")
"""Usual columns without a unit."""
_WORDS = {word: column for column, words in _QUANTITIES.items() for word in words}


def read_data_table(
    source: str | os.PathLike[str], columns: Mapping[str, str] | None = None
) -> Table:
    """Read a table whose headers may be in other words or units.

    Args:
        source: Path of the file.
        columns: What is in which column, such as `{"tension": "Kraft [N]"}`: a quantity, or the
            usual name of a column, and the header of the file.

    Raises:
        InputError: As `read_table`, or `columns` names a header or quantity that is not there.
    """
    table = read_table(source)
    named: dict[str, str] = {}
    for name, header in (columns or {}).items():
        if header not in table.header:
            raise InputError.TABLE_COLUMNS(
                f"{table.name}: there is no column {header} for {name}; {table.columns}."
            )
        named[header] = name
    headers: list[str] = []
    factors: list[float] = []
    for header in table.header:
        column, factor = _understood(header, named.get(header, ""))
        is_taken = column != header and (column in table.header or column in headers)
        if is_taken and header in named:
            raise InputError.TABLE_COLUMNS(
                f"{table.name}: there are two columns for {column}; rename or remove one."
            )
        headers.append(header if is_taken else column)
        factors.append(1.0 if is_taken else factor)
    rows = tuple(
        tuple(map(_converted, row, factors, [table.decimal] * len(row))) for row in table.rows
    )
    renamed = {new: old for new, old in zip(headers, table.header, strict=True) if new != old}
    told = {new for new, old in zip(headers, table.header, strict=True) if old in named}
    return dataclasses.replace(
        table, header=tuple(headers), rows=rows, written=renamed, named=frozenset(told)
    )


def _understood(header: str, name: str) -> tuple[str, float]:
    """Return the usual name of a column, and what its numbers are multiplied by.

    Args:
        header: As it stands in the file.
        name: What the reader says it is; "" for what its own words say.
    """
    if _PLAIN.fullmatch(name):
        return name, 1.0
    words, unit = _name_and_unit(header)
    base, factor = _BASE.get(unit, ("", 1.0))
    if name:
        words, unit_of_name = _name_and_unit(name)
        base = base or unit_of_name
    elif not base:
        return header, 1.0
    numbers = re.findall(r"\d+", words)
    key = " ".join(re.findall(r"[^\W\d_]+", words.lower()))
    if key in _WORDS:
        column, wanted = _WORDS[key]
        if base in ("", wanted) and len(numbers) <= 1:
            return f"{column.format(n=''.join(f'_{n}' for n in numbers))}_{wanted}", factor
    if name and (key in _WORDS or not base):
        raise InputError.UNKNOWN_NAME(
            f"--column {name}={header}: {TOLD_COLUMNS}, for a column in its unit."
        )
    usual = re.sub(r"[^\w.]+", "_", words.strip())
    return f"{usual}_{base}", factor


def _name_and_unit(header: str) -> tuple[str, str]:
    """Split `Force [mN]` or `force_mN`; the unit is "" where there is none that is known."""
    match = _BRACKETED.fullmatch(header) or _APPENDED.fullmatch(header)
    return (match[1], match[2]) if match and match[2] in _BASE else (header, "")


def _converted(text: str, factor: float, decimal: str) -> str:
    """Convert a number that stands in a table; what is none is left for a message to show."""
    if factor == 1.0:
        return text
    try:
        return f"{float(text.replace(decimal, '.', 1)) * factor!r}".replace(".", decimal, 1)
    except ValueError:
        return text
