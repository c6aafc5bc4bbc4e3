"""Tables with one row a step (CSV, Parquet) read as quantities, by the heads of their columns."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from pathlib import Path as FilePath
from typing import Any

import numpy as np
from numpy.typing import NDArray

from notchflex._quantity import Quantity
from notchflex.errors import InputError
from notchflex.results.files import csv_reading
from notchflex.results.files.dataframe import read_columns
from notchflex.results.quantities.registry import AXES, QUANTITIES

_PATTERNS = {
    "tendon": r"(?:_(?P<tendon>[1-9]\d*))?",
    "notch": r"(?P<notch>[1-9]\d*)",
    "axis": rf"(?P<axis>[{''.join(AXES)}])",
    "span": r"(?P<span>proximal|gap_[1-9]\d*|body_[1-9]\d*)",
}


def read_table(file: str | FilePath) -> dict[str, NDArray[Any]]:
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
    for header, values in _columns(file).items():
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


def _columns(file: str | FilePath) -> Mapping[str, Sequence[Any]]:
    if FilePath(file).suffix.lower() == ".parquet":
        return read_columns(file)
    table = csv_reading.read_table(file)
    return {column: table.texts(column) for column in table.header}


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
        return 0 if not number else 2 * int(number) - (kind == "gap")
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
    whole = np.full((len(first), *shape), empty, first.dtype)
    for index, values in parts.items():
        whole[(slice(None), *index)] = values
    return whole
