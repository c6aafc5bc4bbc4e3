"""Reading text files, and tables of numbers from CSV files; errors name the line and the column.

A table is UTF-8 with commas and its header first; empty lines and lines that start with `#` are
skipped. Semicolons between the columns, as spreadsheets write them where numbers have a decimal
comma, are read too.
"""

from __future__ import annotations

import csv
import errno
import io
import math
import os
import re
import select
import stat
from collections.abc import Container, Mapping, Sequence, Set
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING

from notchflex._replacing import AnyPath
from notchflex.errors import InputError

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

_LARGEST = 50_000_000
"""Bytes of the largest text file that is read."""
_PART, _WRITER_COMES = 2**16, 3.0
"""Bytes that are read at once, and how long a pipe waits for its writer, s."""


def bounded_bytes(path: AnyPath, most: int = _LARGEST) -> bytes:
    """Read a file of at most so many bytes; a pipe without a writer raises `OSError` too."""
    with open(path, "rb", buffering=0, opener=_at_once) as file:
        pipe = stat.S_ISFIFO(os.fstat(file.fileno()).st_mode)
        ready = not pipe or select.select([file], [], [], _WRITER_COMES)[0]
        # Without waiting a pipe reads as None where its writer is only slow.
        part = file.read(_PART)
        if part == b"" and not ready:
            raise OSError(errno.EPIPE, "it is a pipe into which no program writes")
        if pipe:
            os.set_blocking(file.fileno(), True)
        data = bytearray(part or b"")
        while part is None or part:
            part = file.read(_PART)
            data += part or b""
            if len(data) > most:
                raise OSError(errno.EFBIG, f"it has more than {most / 1e6:.0f} MB")
    return bytes(data)


def _at_once(path: str, flags: int) -> int:
    """Open a pipe without waiting for its writer, anything else as usual."""
    pipe = stat.S_ISFIFO(os.stat(path).st_mode)
    return os.open(path, flags | (os.O_NONBLOCK if pipe else 0))


def read_text(
    source: AnyPath,
    kind: str,
    shown: str | None = None,
    error_class: type[InputError] = InputError,
) -> str:
    """Read a text file in UTF-8, without the byte-order mark that spreadsheets put before it."""
    shown = shown or str(source)
    try:
        return io.TextIOWrapper(io.BytesIO(bounded_bytes(source)), "utf-8-sig").read()
    except FileNotFoundError:
        raise error_class.FILE_NOT_FOUND(f"{shown}: there is no such file.") from None
    except IsADirectoryError:
        raise error_class.FILE_UNREADABLE(f"{shown} is a folder; name a {kind}.") from None
    except UnicodeDecodeError:
        form = kind.removesuffix(" file")  # such as "CSV file"
        form = form if form[0].isupper() else "text"
        saved = f"save it as {form} in UTF-8"
        raise error_class.FILE_UNREADABLE(f"{shown} is not text in UTF-8; {saved}.") from None
    except (OSError, ValueError) as problem:  # ValueError: a null character in the name
        words = getattr(problem, "strerror", None) or problem
        raise error_class.FILE_UNREADABLE(f"{shown} cannot be read: {words}.") from None


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
        entries: Entries of each column by its name, without spaces around them.
        lines: Line of the file that each row stands in.
        decimal: What separates the decimals of its numbers, a point or a comma.
        written: Columns that have another name in the file, to that name.
        named: Columns that the caller told by their header.
    """

    name: str
    entries: Mapping[str, tuple[str, ...]]
    lines: tuple[int, ...]
    decimal: str = "."
    written: Mapping[str, str] = field(default_factory=dict[str, str])
    named: Set[str] = frozenset()

    def __len__(self) -> int:
        return len(self.lines)

    @property
    def header(self) -> tuple[str, ...]:
        """Names of the columns."""
        return tuple(self.entries)

    def texts(self, column: str) -> tuple[str, ...]:
        """Return the entries of a column.

        Raises:
            InputError: There is no such column.
        """
        if column not in self.entries:
            raise InputError.TABLE_COLUMNS(
                f"{self.name}: there is no column {column}; {self.columns}."
            )
        return self.entries[column]

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
        import numpy as np  # robots without a file are read without it

        hint = "; leave the entry empty where there is none" if may_miss and not is_load else ""
        values, written = list[float](), self.written.get(column, column)
        for text, line in zip(self.texts(column), self.lines, strict=True):
            if may_miss and not text:
                values.append(math.nan)
                continue
            place = f"{self.name}, line {line}: {written} is"
            try:
                value = float(text.replace(self.decimal, ".", 1))
            except ValueError:
                got = repr(text) if text else "nothing"
                raise InputError.NOT_A_NUMBER(f"{place} {got}; give a number{hint}.") from None
            if not math.isfinite(value):
                raise InputError.NOT_FINITE(f"{place} {text}; give a finite number{hint}.")
            if abs(value) > LARGEST:
                raise InputError.OUT_OF_RANGE(f"{place} {text}; give at most {LARGEST:g}.")
            values.append(value)
        return np.array(values)

    def place_of(self, row: int) -> str:
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


def csv_table(source: AnyPath) -> Table:
    """Read a table of at least one row, as it stands in a file."""
    path, text = Path(source), read_text(source, "CSV file")
    lines = text.splitlines()
    filled = (line for line in lines if line.strip(" ;,") and not line.lstrip().startswith("#"))
    head = next(filled, "")
    separator = ";" if ";" in head and "," not in head else ","
    reader = csv.reader(lines, strict=True, delimiter=separator)
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
    entries = dict(zip(header, zip(*rows, strict=True), strict=True))
    return Table(str(source), entries, lines, decimal)


def _decimal(path: Path, lines: Sequence[int], rows: Sequence[Sequence[str]]) -> str:
    """Return the decimal separator of a table with semicolons, whose numbers may have either."""
    # A table with commas and points has separators of thousands: it is refused.
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
