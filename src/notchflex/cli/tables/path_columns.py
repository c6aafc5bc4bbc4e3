"""The columns of the table of a path: the usual ones, or those that a user names."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from notchflex._quantity import Quantity
from notchflex.errors import InputError
from notchflex.results.quantities.registry import AXES, CONTACT_STATES, QUANTITIES, holds
from notchflex.robot.error_messages import nearest

if TYPE_CHECKING:
    from notchflex.results import EquilibriumPath

NO_NUMBER = "–"
CLOSED = "*"
PERCENT = ("outer_strain", "peak_strain")
"""Strains, which files hold as numbers, are shown in percent."""

HEADS = {
    "tension": "T",
    "stroke": "u",
    "commanded_tension": "T set",
    "commanded_stroke": "u set",
    "notch_angle": "n",
    "total_angle": "total",
    "total_chord_angle": "chords",
    "tip_position": "tip",
}
"""Short heads of the quantities that are shown most often."""

MEANINGS = {
    "tension": "tension of a tendon at the base",
    "stroke": "tendon length drawn out at the base",
    "notch_angle": f"notch angle, base to tip ({CLOSED} closed)",
    "total_angle": "total bending angle",
    "total_chord_angle": "sum of the chord angles",
    "tip_position": "tip position in the world",
    "strain": "largest strain of all notches",
}
"""Texts of the legend; other quantities have their titles there."""


@dataclass(frozen=True)
class PathColumn:
    """A column of the table: its head, its unit and the text of every row."""

    head: str
    unit: str
    cells: list[str]

    @property
    def width(self) -> int:
        """Characters that the column takes, with the gap behind it."""
        return max(map(len, (*self.head.split("\n"), self.unit, *self.cells))) + 1


@dataclass(frozen=True)
class ColumnGroup:
    """Columns that are shown or left out together.

    Attributes:
        names: The quantities, as `--columns` takes them.
        rank: Groups of a low rank are shown first.
        columns: The columns, in their place in the table.
        meaning: Their text in the legend, "" for none.
    """

    names: tuple[str, ...]
    rank: int
    columns: list[PathColumn]
    meaning: str = ""

    @property
    def width(self) -> int:
        """Characters that all its columns take."""
        return sum(column.width for column in self.columns)


def step_column(rows: Sequence[int]) -> PathColumn:
    """Return the column with the number of every step."""
    return PathColumn("step", "", [str(row + 1) for row in rows])


def usual_groups(path: EquilibriumPath, rows: Sequence[int]) -> list[ColumnGroup]:
    """Return the columns that are shown where none are named, in the order of the table."""
    groups: list[ColumnGroup] = []
    for tendon in range(path.tension.shape[1]):
        columns = [
            _components(path, rows, QUANTITIES[name])[tendon] for name in ("tension", "stroke")
        ]
        commands = [path.commanded_tension[:, tendon], path.commanded_stroke[:, tendon]]
        # A step that was not solved still shows what was commanded.
        for column, command in zip(columns, commands, strict=True):
            for index, row in enumerate(rows):
                if not path.converged[row] and np.isfinite(command[row]):
                    column.cells[index] = _rounded(float(command[row]), ".3f")
        commanded = bool(np.isfinite(commands).any())
        meaning = "" if tendon else _meaning("tension", "T") + "; " + _meaning("stroke", "u")
        groups.append(ColumnGroup(("tension", "stroke"), 1 if commanded else 5, columns, meaning))
    if holds(path, QUANTITIES["total_chord_angle"]):
        groups.append(_group(path, rows, "total_chord_angle", 2))
    groups.append(_group(path, rows, "notch_angle", 4))
    groups.append(_group(path, rows, "total_angle", 2))
    tip = _group(path, rows, "tip_position", 2)
    if not np.nanmax(np.abs(path.tip_position[:, 1]), initial=0.0) > 1e-9:
        del tip.columns[1]  # a planar robot has no coordinate across its plane
    groups.append(tip)
    peak = np.abs(path.peak_strain).max(axis=1)
    cells = [f"{100 * peak[row]:.2f}" if path.converged[row] else NO_NUMBER for row in rows]
    strain = f"strain: {MEANINGS['strain']} [%]"
    groups.append(ColumnGroup(("peak_strain",), 3, [PathColumn("strain", "%", cells)], strain))
    return groups


def named_groups(
    path: EquilibriumPath, rows: Sequence[int], names: Sequence[str]
) -> list[ColumnGroup]:
    """Return the columns of the quantities that were named, in that order."""
    return [_group(path, rows, name, 1) for name in names]


def parse_columns(text: str) -> list[str]:
    """Return the quantities that `--columns` names.

    Example:
        >>> parse_columns("tension, notch_angle")
        ['tension', 'notch_angle']
    """
    allowed = [name for name, quantity in QUANTITIES.items() if "row" not in quantity.per]
    names = [word.strip() for word in text.split(",")]
    for index, name in enumerate(names):
        if name not in allowed:
            got = repr(name) if name else "an empty name"
            raise InputError.UNKNOWN_NAME(
                f"--columns {text}: {got} is not the name of a quantity{nearest(name, allowed)}. "
                f"Allowed: {', '.join(allowed)}."
            )
        if name in names[:index]:
            raise InputError.CONFLICT(f"--columns {text}: {name} is given twice; give it once.")
    return names


def _group(path: EquilibriumPath, rows: Sequence[int], name: str, rank: int) -> ColumnGroup:
    quantity = QUANTITIES[name]
    columns = _components(path, rows, quantity)
    return ColumnGroup((name,), rank, columns, _meaning(name, HEADS.get(name, "")))


def _meaning(name: str, head: str) -> str:
    quantity = QUANTITIES[name]
    text = MEANINGS.get(name, quantity.title)
    unit = f" [{_unit(quantity)}]" if _unit(quantity) else ""
    return f"{head}: {text}{unit}" if head else f"{text}{unit}"


def _components(path: EquilibriumPath, rows: Sequence[int], quantity: Quantity) -> list[PathColumn]:
    """Return a column for every component of a quantity that holds anything."""
    values = getattr(path, quantity.name, None)
    if values is None:
        return []
    table = np.asarray(values)
    columns: list[PathColumn] = []
    for index in np.ndindex(table.shape[1:]):
        component = table[:, *index]
        several = quantity.per in (("tendon", "span"), ("tendon", "contact"))
        if several and table.dtype.kind == "f" and not np.isfinite(component).any():
            continue  # a tendon that ends before the others has fewer
        cells = [
            _cell(quantity, component[row]) if _is_valid(path, quantity, row) else NO_NUMBER
            for row in rows
        ]
        head, unit = _head(quantity, index, table.shape[1:]), _unit(quantity)
        if quantity.name == "notch_angle":
            closed = [path.converged[row] and path.closed[row, *index] for row in rows]
            marks = [CLOSED if one else " " for one in closed]
            cells = [cell + mark for cell, mark in zip(cells, marks, strict=True)]
            head, unit = f"{head} ", f"{unit} "
        columns.append(PathColumn(head, unit, cells))
    return columns


def _head(quantity: Quantity, index: tuple[int, ...], shape: tuple[int, ...]) -> str:
    head = HEADS.get(quantity.name, quantity.name.replace("_", "\n"))
    if not index or (quantity.per == ("tendon",) and shape == (1,)):
        return head
    words = [
        AXES[one] if what == "axis" else str(one + (what not in ("span", "body")))
        for what, one in zip(quantity.per, index, strict=True)
        if (what, shape[0]) != ("tendon", 1)
    ]
    gap = "" if len(head) == 1 else (" " if quantity.name in HEADS else "\n")
    return head + gap + ".".join(words)


def _unit(quantity: Quantity) -> str:
    return "%" if quantity.name in PERCENT else quantity.unit


def _is_valid(path: EquilibriumPath, quantity: Quantity, row: int) -> bool:
    always = ("commanded_tension", "commanded_stroke", "converged", "reason", "residual")
    return bool(path.converged[row]) or quantity.name in (*always, "iterations")


def _cell(quantity: Quantity, value: Any) -> str:
    if quantity.name == "contact_state":
        return CONTACT_STATES[int(value)]
    if isinstance(value, str):
        return value or NO_NUMBER
    if isinstance(value, (bool, np.bool_)):
        return "yes" if value else "no"
    if not np.isfinite(value):
        return NO_NUMBER
    if isinstance(value, (int, np.integer)):
        return str(value)
    if quantity.name in PERCENT:
        return _rounded(100.0 * float(value), ".2f")
    form = {"deg": ".2f", "mm": ".3f", "N": ".3f"}.get(quantity.unit, ".4g")
    return _rounded(float(value) * quantity.scale, form)


def _rounded(value: float, form: str) -> str:
    """Write a number without the minus sign of a zero that rounding made."""
    text = format(value, form)
    return text.lstrip("-") if not text.strip("-0.") else text
