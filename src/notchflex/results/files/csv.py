"""Results as a CSV table: one row a step, the columns of the table of quantities.

The columns of tensions, strokes and angles have the names that measured data have
(`tendon_force_N`, `tendon_displacement_mm`, `notch_j_deg`, `total_deg`), so that a computed table
can be compared as if it had been measured.
"""

from __future__ import annotations

import csv
import io
import math
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from notchflex._quantity import Quantity
from notchflex.results.files.writing import write_text
from notchflex.results.quantities.registry import AXES, QUANTITIES, holds, span_names, spans_of

if TYPE_CHECKING:
    from pathlib import Path as FilePath

    from notchflex.results.path import EquilibriumPath


def path_columns(path: EquilibriumPath) -> dict[str, Sequence[Any]]:
    """Return the columns of a path: header to the values of its S steps, at the edge units."""
    columns: dict[str, Sequence[Any]] = {"step": range(1, len(path) + 1)}
    for quantity in QUANTITIES.values():
        if quantity.column and holds(path, quantity):
            columns.update({one.header: one.values for one in entries_of(path, quantity)})
    return columns


def write_path_csv(
    target: str | FilePath, path: EquilibriumPath, more: Mapping[str, Sequence[Any]] | None = None
) -> None:
    """Write a path as CSV to a file, whole or not at all, or to standard output for `-`.

    Args:
        target: Path, or `-` for standard output.
        path: The path.
        more: Further columns behind those of the path, a value per step.

    Raises:
        InputError: The file cannot be written.
    """
    write_columns(target, {**path_columns(path), **(more or {})})


def write_columns(target: str | FilePath, columns: Mapping[str, Iterable[Any]]) -> None:
    """Write columns as CSV, as `write_csv` does its rows.

    Args:
        target: Path, or `-` for standard output.
        columns: As many values under every header.

    Raises:
        InputError: The file cannot be written.
    """
    write_csv(target, list(columns), zip(*columns.values(), strict=True))


def write_csv(target: str | FilePath, header: Sequence[str], rows: Iterable[Iterable[Any]]) -> None:
    """Write rows as CSV (UTF-8, comma, header first); NaN and None become empty fields.

    Args:
        target: Path, or `-` for standard output.
        header: Names of the columns.
        rows: Rows of as many values.

    Raises:
        InputError: The file cannot be written.
    """
    write_text(target, csv_text(header, rows))


def csv_text(header: Sequence[str], rows: Iterable[Iterable[Any]]) -> str:
    """Return what `write_csv` writes."""
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(header)
    for row in rows:
        writer.writerow([_field(value) for value in row])
    return text.getvalue()


@dataclass(frozen=True)
class CsvEntry:
    """One entry of a quantity along a path, such as the angle of one notch.

    Attributes:
        header: The CSV column; "" where the quantity has none.
        name: Which entry it is, such as "notch 3"; "" for a quantity with one number.
        values: A value per step, at the edge units.
    """

    header: str
    name: str
    values: Any


def is_listed(quantity: Quantity) -> bool:
    """Tell whether `entries_of` lists the entries of a quantity one by one."""
    return quantity.per in ((), ("notch",), ("axis",), ("tendon",), ("tendon", "span"))


def entries_of(path: EquilibriumPath, quantity: Quantity) -> Iterator[CsvEntry]:
    """Yield every entry of a quantity, in the order of the CSV columns."""
    values: Any = getattr(path, quantity.name)
    if quantity.scale != 1.0:
        values = np.asarray(values) * quantity.scale
    several = path.tension.shape[1] > 1
    tendons = [(i, i + 1 if several else "") for i in range(path.tension.shape[1])]
    match quantity.per:
        case ():
            yield CsvEntry(quantity.header(), "", values)
        case ("notch",):
            for notch in range(values.shape[1]):
                header = quantity.header(notch=notch + 1)
                yield CsvEntry(header, f"notch {notch + 1}", values[:, notch])
        case ("axis",):
            for index, axis in enumerate(AXES):
                yield CsvEntry(quantity.header(axis=axis), axis, values[:, index])
        case ("tendon",):
            for index, number in tendons:
                name = f"tendon {number}" if several else ""
                yield CsvEntry(quantity.header(tendon=number), name, values[:, index])
        case ("tendon", "span"):
            for index, number in tendons:
                for span, name in enumerate(span_names(spans_of(path, index))):
                    header = quantity.header(tendon=number, span=name)
                    words = f"tendon {number}, " if several else ""
                    words += name.replace("_", " ")
                    yield CsvEntry(header, words, values[:, index, span])
        case other:
            raise NotImplementedError(f"no CSV columns for a quantity per {other}")


def _field(value: Any) -> Any:
    if isinstance(value, np.generic):
        value = value.item()
    if isinstance(value, bool):
        return int(value)
    if value is None or (isinstance(value, float) and not math.isfinite(value)):
        return ""
    return value
