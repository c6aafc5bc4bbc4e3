"""Tables of measurements and specifications: their columns in other words and units."""

from __future__ import annotations

import dataclasses
import math
import os
import re
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any, TypeVar

import numpy as np
from numpy.typing import NDArray
from pydantic import TypeAdapter, ValidationError

from notchflex._quantity import Quantity
from notchflex._replacing import AnyPath
from notchflex.errors import InputError
from notchflex.results.io import read_columns
from notchflex.results.quantities import AXES, QUANTITIES
from notchflex.robot.files import TOLD_COLUMNS, Table, csv_table, read_text
from notchflex.robot.part import sentences
from notchflex.robot.reading import in_file, load_robot, parse_toml
from notchflex.robot.robot import Robot


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
    # A tension most likely has a header of its unit, or the first.
    forces = (name for name in table.header if re.search(r"(^|[^A-Za-z])N$", name.rstrip(")] ")))
    header = next(forces, table.header[0])
    likely = table.written.get(header, header)
    return InputError.TABLE_COLUMNS(
        f"{table.name}: there is no column {columns[0]} or {columns[1]}{more}; {table.columns}. "
        f'Say which it is: --column tension="{likely}".'
    )


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


def read_data_table(source: AnyPath, columns: Mapping[str, str] | None = None) -> Table:
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
    path: AnyPath, kind: str, make: Callable[[Mapping[str, Any]], Asked]
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


def read_table(file: AnyPath) -> dict[str, NDArray[Any]]:
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
    arrays: dict[str, NDArray[Any]] = {}
    for name, parts in entries.items():
        first, shape = next(iter(parts.values())), np.max(list(parts), axis=0) + 1
        empty = np.nan if first.dtype.kind == "f" else 0
        arrays[name] = np.full((len(first), *shape), empty, first.dtype)
        for index, values in parts.items():
            arrays[name][(slice(None), *index)] = values
    return arrays


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
