"""Results as a CSV table: one row a step, the columns of the table of quantities.

The columns of tensions, strokes and angles have the names that measured data have
(`tendon_force_N`, `tendon_displacement_mm`, `notch_j_deg`, `total_deg`), so that a computed table
can be compared as if it had been measured.
"""

from __future__ import annotations

import csv
import io
import math
from collections.abc import Iterable, Iterator, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from notchflex.results.files import write_text
from notchflex.results.quantities import AXES, QUANTITIES, span_names
from notchflex.results.quantity import Quantity
from notchflex.results.spans import holds, spans_of

if TYPE_CHECKING:
    from pathlib import Path as FilePath

    from notchflex.statics import Path


def path_columns(path: Path) -> dict[str, Sequence[Any]]:
    """Return the columns of a path: header to the values of its S steps, at the edge units."""
    columns: dict[str, Sequence[Any]] = {"step": range(1, len(path) + 1)}
    for quantity in QUANTITIES.values():
        if quantity.column and holds(path, quantity):
            columns.update(_columns_of(path, quantity))
    return columns


def write_path_csv(target: str | FilePath, path: Path) -> None:
    """Write a path as CSV to a file, whole or not at all, or to standard output for `-`.

    Raises:
        InputError: The file cannot be written.
    """
    columns = path_columns(path)
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
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(header)
    for row in rows:
        writer.writerow([_field(value) for value in row])
    write_text(target, text.getvalue())


def _columns_of(path: Path, quantity: Quantity) -> Iterator[tuple[str, Any]]:
    values: Any = getattr(path, quantity.name)
    if quantity.scale != 1.0:
        values = np.asarray(values) * quantity.scale
    tendons = path.tension.shape[1]
    numbers: list[Any] = [""] if tendons == 1 else list(range(1, tendons + 1))
    match quantity.per:
        case ():
            yield quantity.header(), values
        case ("notch",):
            for notch in range(values.shape[1]):
                yield quantity.header(notch=notch + 1), values[:, notch]
        case ("axis",):
            for index, axis in enumerate(AXES):
                yield quantity.header(axis=axis), values[:, index]
        case ("tendon",):
            for index, number in enumerate(numbers):
                yield quantity.header(tendon=number), values[:, index]
        case ("tendon", "span"):
            for index, number in enumerate(numbers):
                for span, name in enumerate(span_names(spans_of(path, index))):
                    yield quantity.header(tendon=number, span=name), values[:, index, span]
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
