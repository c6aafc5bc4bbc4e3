"""Results as a CSV table, one row a step, and as one JSON document; units from the registry.

The columns of tensions, strokes and angles have the names that measured data have
(`tendon_force_N`, `tendon_displacement_mm`, `notch_j_deg`, `total_deg`), so that a computed table
can be compared as if it had been measured.
"""

from __future__ import annotations

import csv
import io
import json
import math
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from notchflex import __version__
from notchflex._quantity import Quantity
from notchflex._replacing import AnyPath
from notchflex.results.quantities import (
    AXES,
    CONTACT_STATES,
    QUANTITIES,
    holds,
    span_names,
    spans_of,
    units,
)
from notchflex.results.writing import write_text
from notchflex.robot import Robot
from notchflex.robot.robot import to_table

if TYPE_CHECKING:
    from notchflex.results.path import EquilibriumPath


def path_columns(path: EquilibriumPath) -> dict[str, Sequence[Any]]:
    """Return the columns of a path: header to the values of its S steps, at the edge units."""
    columns: dict[str, Sequence[Any]] = {"step": range(1, len(path) + 1)}
    for quantity in QUANTITIES.values():
        if quantity.column and holds(path, quantity):
            columns.update({entry.header: entry.values for entry in entries_of(path, quantity)})
    return columns


def write_path_csv(
    target: AnyPath, path: EquilibriumPath, more: Mapping[str, Sequence[Any]] | None = None
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


def write_columns(target: AnyPath, columns: Mapping[str, Iterable[Any]]) -> None:
    """Write columns as CSV, as `write_csv` does its rows.

    Args:
        target: Path, or `-` for standard output.
        columns: As many values under every header.

    Raises:
        InputError: The file cannot be written.
    """
    write_csv(target, list(columns), zip(*columns.values(), strict=True))


def write_csv(target: AnyPath, header: Sequence[str], rows: Iterable[Iterable[Any]]) -> None:
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
    """One entry of a quantity along a path, such as the angle of one notch."""

    header: str  # the CSV column; "" where there is none
    name: str  # such as "notch 3"; "" for one number
    values: Any


def is_listed(quantity: Quantity) -> bool:
    """Tell whether `entries_of` lists the entries of a quantity one by one."""
    return quantity.per in ((), ("notch",), ("axis",), ("tendon",), ("tendon", "span"))


def entries_of(path: EquilibriumPath, quantity: Quantity) -> Iterator[CsvEntry]:
    """Yield every entry of a quantity, in the order of the CSV columns."""
    values = np.asarray(getattr(path, quantity.name))
    if quantity.scale != 1.0:
        values = values * quantity.scale
    names = {"axis": AXES, "span": span_names(values.shape[-1] if "span" in quantity.per else 0)}
    for index in np.ndindex(values.shape[1:]):
        place = dict(zip(quantity.per, index, strict=True))
        if "span" in place and place["span"] >= spans_of(path, place["tendon"]):
            continue
        labels: dict[str, object] = {
            axis: names[axis][number] if axis in names else number + 1
            for axis, number in place.items()
        }
        if "tendon" in labels and path.tension.shape[1] == 1:
            labels["tendon"] = ""  # the only one goes without its number
        words = [
            str(label).replace("_", " ") if axis in names else f"{axis} {label}"
            for axis, label in labels.items()
            if label
        ]
        yield CsvEntry(quantity.header(**labels), ", ".join(words), values[(slice(None), *index)])


def _field(value: Any) -> Any:
    value = plain(value)
    if isinstance(value, bool):
        return int(value)
    return "" if value in (None, "inf", "-inf") else value


# Results as one JSON document: keys and units from the table of quantities, never a NaN.

# Quantities of contacts are gathered contact by contact.
CONTACTS = tuple(q for q in QUANTITIES.values() if q.key and q.per == ("tendon", "contact"))
PLAIN = tuple(q for q in QUANTITIES.values() if q.key and q not in CONTACTS)

# External loads are input, not results: they are not registered as quantities.
_LOAD_KEYS = {
    "tip_force": ("tip_force_N", "N"),
    "tip_moment": ("tip_moment_Nmm", "N mm"),
    "tip_point": ("tip_point_mm", "mm"),
    "tip_mass": ("tip_mass_g", "g"),
    "gravity": ("gravity_m_s2", "m/s^2"),
    "temperature": ("temperature_C", "deg C"),
    "sheath_bend_deg": ("sheath_bend_deg", "deg"),
    "force": ("body_forces.force_N", "N"),
    "moment": ("body_forces.moment_Nmm", "N mm"),
    "point": ("body_forces.point_mm", "mm"),
}
LOAD_UNITS = {f"load.{key}": unit for key, unit in _LOAD_KEYS.values()}


def path_document(path: EquilibriumPath) -> dict[str, Any]:
    """Return a path as a JSON document of plain values, angles in deg, None for no number."""
    external = _external(path)
    failed = next((step for step, converged in enumerate(path.converged) if not converged), None)
    steps = [_step(path, index, external) for index in range(len(path))]
    return {
        **document_head(path.robot),
        "units": units() | (LOAD_UNITS if external else {}),
        "converged": failed is None,
        "reason": "" if failed is None else str(path.reason[failed]),
        "reason_code": "" if failed is None else str(path.reason_code[failed]),
        "steps": steps,
    }


def step_document(path: EquilibriumPath, index: int) -> dict[str, Any]:
    """Return one step (from 0) of the document of a path, of plain values."""
    return plain(_step(path, index, _external(path)))


def document_head(robot: Robot) -> dict[str, Any]:
    """Return the head that every document has: the robot's name and description, the version."""
    return {
        "name": robot.name,
        "program": "notchflex",
        "version": __version__,
        "robot": plain(to_table(robot)),
    }


def json_text(document: Any) -> str:
    """Return a document as strict JSON text that ends with a newline; NaN becomes null."""
    return json.dumps(plain(document), ensure_ascii=False, allow_nan=False) + "\n"


def write_json(target: AnyPath, document: Any) -> None:
    """Write a document to a file, whole or not at all, or to standard output for `-`.

    Raises:
        InputError: The file cannot be written.
    """
    write_text(target, json_text(document))


def plain(value: Any) -> Any:
    """Return a value as JSON knows it: arrays as lists, NaN as None, infinity as "inf".

    Infinity only stands in robot descriptions (an inextensible tendon); as a string it is read
    back as a number by the robot models.
    """
    if isinstance(value, dict):
        return {str(key): plain(entry) for key, entry in value.items()}
    if isinstance(value, (list, tuple)):
        return [plain(entry) for entry in value]
    if isinstance(value, (np.ndarray, np.generic)):
        return plain(value.tolist())
    if isinstance(value, float):
        if math.isnan(value):
            return None
        if math.isinf(value):
            return "inf" if value > 0 else "-inf"
    return value


def _step(path: EquilibriumPath, index: int, external: list[dict[str, Any]]) -> dict[str, Any]:
    step: dict[str, Any] = {"step": index + 1}
    for quantity in PLAIN:
        if holds(path, quantity):
            holder = step
            *outer, last = quantity.key.split(".")
            for key in outer:
                holder = holder.setdefault(key, {})
            value = getattr(path, quantity.name)[index]
            if quantity.per == ("tendon", "span"):
                value = [row[: spans_of(path, tendon)] for tendon, row in enumerate(value)]
            elif quantity.scale != 1.0:
                value = np.asarray(value) * quantity.scale
            holder[last] = value.item() if isinstance(value, np.generic) else value
    if external:
        step.setdefault("load", {}).update(external[index])
    step["contacts"] = []
    for tendon in range(path.tension.shape[1]):
        count = spans_of(path, tendon) - 1
        columns = {
            q.key.split(".")[1]: getattr(path, q.name)[index, tendon, :count] * q.scale
            for q in CONTACTS
            if holds(path, q)
        }
        columns["state"] = [CONTACT_STATES[int(state)] for state in columns["state"]]
        contacts = [{key: each[number] for key, each in columns.items()} for number in range(count)]
        step["contacts"].append(contacts)
    return step


def _external(path: EquilibriumPath) -> list[dict[str, Any]]:
    """External loads of every step; nothing at all where no step has any."""
    loads = path.load.external
    if all(load.is_nothing and load.sheath_bend_deg is None for load in loads):
        return []
    return [_with_units(asdict(load)) for load in loads]


def _with_units(values: dict[str, Any]) -> dict[str, Any]:
    return {
        _LOAD_KEYS.get(name, (name,))[0].rpartition(".")[2]: (
            [_with_units(force) for force in value] if name == "body_forces" else value
        )
        for name, value in values.items()
    }
