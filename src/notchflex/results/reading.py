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
from collections.abc import Callable, Container, Mapping, Sequence, Set
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, TypeVar

import numpy as np
from numpy.typing import NDArray
from pydantic import TypeAdapter, ValidationError

from notchflex._quantity import Quantity
from notchflex.errors import InputError
from notchflex.results.io import read_columns
from notchflex.results.quantities import AXES, QUANTITIES
from notchflex.robot.part import sentences
from notchflex.robot.reading import in_file, load_robot, parse_toml, read_text
from notchflex.robot.robot import Robot

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
        """Return the entries of a column."""
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
        hint = "; leave the entry empty where there is none" if may_miss and not is_load else ""
        return np.array(
            [
                math.nan if may_miss and not text else self._number(text, column, line, hint)
                for text, line in zip(self.texts(column), self.lines, strict=True)
            ]
        )

    def _number(self, text: str, column: str, line: int, hint: str) -> float:
        column = self.written.get(column, column)
        place = f"{self.name}, line {line}: {column} is"
        try:
            value = float(text.replace(self.decimal, ".", 1))
        except ValueError:
            got = repr(text) if text else "nothing"
            raise InputError.NOT_A_NUMBER(f"{place} {got}; give a number{hint}.") from None
        if not math.isfinite(value):
            raise InputError.NOT_FINITE(f"{place} {text}; give a finite number{hint}.")
        if abs(value) > LARGEST:
            raise InputError.OUT_OF_RANGE(f"{place} {text}; give at most {LARGEST:g}.")
        return value

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


def csv_table(source: str | os.PathLike[str]) -> Table:
    """Read a table of at least one row, as it stands in a file."""
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
    entries = dict(zip(header, zip(*rows, strict=True), strict=True))
    return Table(str(source), entries, lines, decimal)


def _separator(text: str) -> str:
    """Return what separates the columns: a semicolon where the header has no comma."""
    lines = (line for line in text.splitlines() if line.strip(" ;,"))
    header = next((line for line in lines if not line.lstrip().startswith("#")), "")
    return ";" if ";" in header and "," not in header else ","


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
    columns = [QUANTITIES[q].header(tendon=label) for q in ("tension", "stroke")]
    more = "" if tendons == 1 else f" (and so on to tendon {tendons})"
    return InputError.TABLE_COLUMNS(
        f"{table.name}: there is no column {columns[0]} or {columns[1]}{more}; {table.columns}. "
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
        InputError: As `csv_table`, or `columns` names a header or quantity that is not there.
    """
    table = csv_table(source)
    named: dict[str, str] = {}
    for name, header in (columns or {}).items():
        if header not in table.header:
            raise InputError.TABLE_COLUMNS(
                f"{table.name}: there is no column {header} for {name}; {table.columns}."
            )
        named[header] = name
    entries: dict[str, tuple[str, ...]] = {}
    written: dict[str, str] = {}
    named_columns: set[str] = set()
    for header, texts in table.entries.items():
        column, factor = _understood(header, named.get(header, ""))
        if column != header and (column in table.entries or column in entries):
            if header in named:
                raise InputError.TABLE_COLUMNS(
                    f"{table.name}: there are two columns for {column}; rename or remove one."
                )
            column, factor = header, 1.0
        entries[column] = tuple(_converted(text, factor, table.decimal) for text in texts)
        written |= {column: header} if column != header else {}
        named_columns |= {column} if header in named else set()
    return dataclasses.replace(
        table, entries=entries, written=written, named=frozenset(named_columns)
    )


def _understood(header: str, name: str) -> tuple[str, float]:
    """Return the usual name of a column, and the factor of its numbers; `name` may say it."""
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
        column, usual_unit = _WORDS[key]
        if base in ("", usual_unit) and len(numbers) <= 1:
            return f"{column.format(n=''.join(f'_{n}' for n in numbers))}_{usual_unit}", factor
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


# Files that ask for something of a robot that they name, such as a design or a sweep: TOML.

Asked = TypeVar("Asked")


def read_specification(
    path: str | os.PathLike[str], kind: str, make: Callable[[Mapping[str, Any]], Asked]
) -> Asked:
    """Read a file and make what it asks.

    Args:
        path: The TOML file.
        kind: What messages call it.
        make: Makes it of the plain table of the file.

    Raises:
        InputError: The file cannot be read, or a value in it is not allowed; every line of the
            message names the file.
    """
    shown = os.fspath(path)
    text = read_text(path, kind)
    try:
        return make(parse_toml(text, shown, kind, InputError))
    except InputError as error:
        raise in_file(shown, error, InputError) from None


def validated(kind: type[Asked], table: Mapping[str, Any]) -> Asked:
    """Make a value of a checked class of a plain table.

    Raises:
        InputError: A key is missing, not known, or its value is not allowed.
    """
    try:
        return TypeAdapter(kind).validate_python(dict(table))
    except ValidationError as error:
        raise InputError.INVALID_SPECIFICATION("\n".join(sentences(error, kind))) from None


def robot_named(name: str, folder: Path) -> Robot:
    """Read the robot that a file names, from the folder of the file if it is a path.

    Raises:
        InputError: There is no such robot, or it cannot be read.
    """
    is_file = name.endswith(".toml") or os.sep in name
    return load_robot(folder / name if is_file else name)


# Tables with one row a step (CSV, Parquet) read as quantities, by the heads of their columns.

_PATTERNS = {
    "tendon": r"(?:_(?P<tendon>[1-9]\d*))?",
    "notch": r"(?P<notch>[1-9]\d*)",
    "axis": rf"(?P<axis>[{''.join(AXES)}])",
    "span": r"(?P<span>proximal|gap_[1-9]\d*|body_[1-9]\d*)",
}


def read_table(file: str | Path) -> dict[str, NDArray[Any]]:
    """Read a table that was written of a path, as its quantities in mm, N and rad.

    A table holds every step as it was printed, so angles come back to the last digit or two. What
    it has no column for (the memory of the friction, the robot) is not in what this returns.

    Args:
        file: A .csv or .parquet that `notchflex simulate` or `save_path` wrote.

    Returns:
        Quantities by the names of `EquilibriumPath`, steps as leading axis; NaN where a
        field is empty.

    Raises:
        InputError: No such file, no table, or no column that is known.

    Example:
        >>> import tempfile
        >>> from pathlib import Path
        >>> import notchflex as nf
        >>> path = nf.simulate(nf.load_robot("pacheco2021-a"), nf.pull(0.0, 1.0, steps=3))
        >>> with tempfile.TemporaryDirectory() as folder:
        ...     nf.save_path(path, Path(folder) / "loop.csv")
        ...     table = nf.read_table(Path(folder) / "loop.csv")
        >>> table["notch_angle"].shape, "contact_slid" in table
        ((3, 5), False)
    """
    entries: dict[str, dict[tuple[int, ...], NDArray[Any]]] = {}
    is_parquet = Path(file).suffix.lower() == ".parquet"
    columns = read_columns(file) if is_parquet else csv_table(file).entries
    for header, values in columns.items():
        place = _place(header)
        if place is None:
            continue
        quantity, index = place
        try:
            entries.setdefault(quantity.name, {})[index] = _numbers(quantity, values)
        except (TypeError, ValueError):
            raise InputError.NOT_A_NUMBER(
                f"{file}: the column {header} holds what is not a number; write the table again."
            ) from None
    if not entries:
        raise InputError.TABLE_COLUMNS(
            f"{file} has no column of a path (such as {QUANTITIES['total_angle'].header()}); give "
            "a table that --csv or --parquet wrote."
        )
    return {name: _joined(QUANTITIES[name], parts) for name, parts in entries.items()}


def _place(header: str) -> tuple[Quantity, tuple[int, ...]] | None:
    """Which quantity a column belongs to, and where in a step it stands."""
    for quantity in QUANTITIES.values():
        if not quantity.column:
            continue
        # re.escape would escape the braces: columns have no other special characters.
        match = re.fullmatch(quantity.column.format_map(_PATTERNS), header)
        if match:
            return quantity, tuple(_index(name, match[name]) for name in quantity.per)
    return None


def _index(name: str, text: str | None) -> int:
    if name == "axis":
        return AXES.index(str(text))
    if name == "span":  # proximal, gap 1, body 1, gap 2, ...
        kind, _, number = str(text).partition("_")
        return 2 * int(number or 0) - (kind == "gap")
    return 0 if text is None else int(text) - 1


def _numbers(quantity: Quantity, values: Sequence[Any]) -> NDArray[Any]:
    if quantity.kind is str:
        return np.array([value or "" for value in values], dtype=object)
    numbers = np.array([np.nan if value in ("", None) else float(value) for value in values])
    if quantity.kind is bool:
        return numbers != 0.0
    return numbers.astype(int) if quantity.kind is int else numbers / quantity.scale


def _joined(quantity: Quantity, parts: Mapping[tuple[int, ...], NDArray[Any]]) -> NDArray[Any]:
    if not quantity.per:
        return parts[()]
    first = next(iter(parts.values()))
    shape = np.max(list(parts), axis=0) + 1
    empty = np.nan if first.dtype.kind == "f" else 0
    array = np.full((len(first), *shape), empty, first.dtype)
    for index, values in parts.items():
        array[(slice(None), *index)] = values
    return array
