"""A solved path as a table that is as wide as the terminal."""

from __future__ import annotations

import textwrap
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise
from typing import TYPE_CHECKING, Any

import numpy as np

from notchflex import InputError
from notchflex.cli import terminal
from notchflex.cli.tables.tolerance_tables import tolerance_lines
from notchflex.loads.load_path import external_words
from notchflex.support import AXES, CONTACT_STATES, QUANTITIES, Quantity, holds, nearest

if TYPE_CHECKING:
    from rich.console import Console

    from notchflex import Bands, EquilibriumPath
    from notchflex.support import ExternalLoad


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


MAX_ROWS = 60
"""A path with no more steps than this is shown whole."""

_MAX_ALL = 20_000


def shown_rows(path: EquilibriumPath, *, every_row: bool = False) -> tuple[list[int], int]:
    """Return the steps to show and the stride between them.

    Args:
        path: Solved path, S steps.
        every_row: Whether all steps are shown.

    Returns:
        Indices in rising order, and the stride: 1 where every step is shown. Otherwise every
        stride-th step, and beside these the first and the last one, every step where a commanded
        tension or stroke reverses (of a path that reverses all the time only its extremes), and
        the first step that did not converge.

    Raises:
        InputError: There are too many steps to show all of them.
    """
    steps = len(path)
    if every_row and steps > _MAX_ALL:
        raise InputError.UNSUPPORTED(
            f"--all: a table of {steps:,} rows; write them with --csv FILE instead "
            f"(--all shows up to {_MAX_ALL:,})."
        )
    if every_row:
        return list(range(steps)), 1
    stride = next(
        size * 10**power
        for power in range(7)  # 1, 2, 5, 10, 20, ...: so that round loads stay round
        for size in (1, 2, 5)
        if steps <= MAX_ROWS * size * 10**power
    )
    rows = set(range(0, steps, stride)) | {0, steps - 1}
    if stride > 1:
        reversals = reversals_of(path)
        extremes = {
            int(pick(column))
            for column in _commanded(path)
            for pick in (np.nanargmin, np.nanargmax)
            if np.isfinite(column).any()
        }
        rows |= reversals if len(reversals) <= MAX_ROWS else extremes
        rows |= {int(step) for step in np.flatnonzero(~np.asarray(path.converged))[:1]}
    return sorted(rows), stride


def reversals_of(path: EquilibriumPath) -> set[int]:
    """Return the steps at which a commanded tension or stroke stops rising or falling.

    Where a load is held for some steps before it reverses, the first and the last of these.
    """
    reversals: set[int] = set()
    for column in _commanded(path):
        change = np.sign(np.diff(column))
        moves = np.flatnonzero(change)
        for before, after in pairwise(moves):
            if change[before] != change[after]:
                reversals |= {int(before) + 1, int(after)}
    return reversals


def rows_note(steps: int, shown: int, stride: int) -> str:
    """Return the sentence that says which steps are shown; "" where all are."""
    if stride == 1:
        return ""
    which = {1: "st", 2: "nd", 3: "rd"}.get(stride, "th")
    return (
        f"{steps} steps, {shown} shown: every {stride}{which} one, and where the load reverses. "
        "--all shows every step."
    )


def _commanded(path: EquilibriumPath) -> list[np.ndarray]:
    """Return the commanded columns; the tension of a tendon with a stroke is not commanded."""
    columns = [*np.asarray(path.commanded_tension).T, *np.asarray(path.commanded_stroke).T]
    return [column for column in columns if np.isfinite(column).any()]


ANGLE_AND_TIP = ("total_angle", "tip_position")
"""Quantities whose bands are shown where none are named."""

MAX_LOADS = 3
"""More different loads than this are only counted."""


def print_path(
    path: EquilibriumPath, title: str, *, columns: Sequence[str] = (), every_row: bool = False
) -> None:
    """Print the steps of a path with units.

    Args:
        path: Solved path.
        title: What stands above the table.
        columns: Quantities to show, by their names; none for the usual ones. The usual ones that
            do not fit are left out and named, those that were asked for are continued below.
        every_row: Whether all steps of a long path are shown.
    """
    rows, stride = shown_rows(path, every_row=every_row)
    room = terminal.width()
    console = terminal.output(room)
    _print_head(console, path, title)
    step = step_column(rows)
    groups = named_groups(path, rows, columns) if columns else usual_groups(path, rows)
    left_out = [] if columns else _without_room(groups, room - step.width)
    groups = [group for group in groups if group not in left_out]
    for block in _blocks(step, groups, room):
        _print_block(console, path, rows, block)
    _print_notes(console, groups, left_out, room)
    note = rows_note(len(path), len(rows), stride)
    if note:
        console.print(note, soft_wrap=True)
    if note or left_out:
        console.print("--csv FILE or --json FILE writes everything.", soft_wrap=True)


def print_beside(
    paths: Mapping[str, EquilibriumPath], *, columns: Sequence[str] = (), every_row: bool = False
) -> None:
    """Print quantities of several paths under the same loads, side by side."""
    first = next(iter(paths.values()))
    rows, _ = shown_rows(first, every_row=every_row)
    room = terminal.width()
    console = terminal.output(room)
    step = step_column(rows)
    widest = max(8, (room - step.width - len(paths)) // len(paths))
    for name in columns or ("total_angle",):
        console.print()
        console.print(f"{QUANTITIES[name].title}, beside each other", style="bold")
        groups = [
            _labelled(group, terminal.shortened(label, widest))
            for label, path in paths.items()
            for group in named_groups(path, rows, [name])
        ]
        for block in _blocks(step, groups, room):
            _print_block(console, first, rows, block)


def print_bands(
    bands: Bands, title: str, *, columns: Sequence[str] = (), every_row: bool = False
) -> None:
    """Print the low end, the middle and the high end of quantities, step by step.

    Args:
        bands: The bands, and their path.
        title: What stands above the table.
        columns: Quantities to show, by their names; angle and tip where none are named.
        every_row: Whether all steps of a long path are shown.
    """
    path = bands.path
    rows, stride = shown_rows(path, every_row=every_row)
    room = terminal.width()
    console = terminal.output(room)
    _print_head(console, path, title)
    commanded = named_groups(path, rows, ("commanded_tension", "commanded_stroke"))
    for group in commanded:
        group.columns[:] = [one for one in group.columns if {*one.cells} != {NO_NUMBER}]
    groups = [group for group in commanded if group.columns]
    ends = [bands.end(end) for end in ("low", "median", "high")]
    for name in columns or ANGLE_AND_TIP:
        several = [named_groups(end, rows, [name])[0] for end in ends if name in bands]
        parts = [
            _labelled(group, label, below=True).columns
            for group, label in zip(several, ("5 %", "50 %", "95 %"), strict=False)
        ]
        (plain,) = named_groups(path, rows, [name])
        triples = [triple for triple in zip(*parts, strict=True) if any(map(_varies, triple))]
        banded = [column for triple in triples for column in triple]
        groups.append(replace(plain, columns=banded) if name in bands else plain)
    for block in _blocks(step_column(rows), groups, room):
        _print_block(console, path, rows, block)
    _print_notes(console, groups, [], room)
    for line in (
        f"5 %, 50 %, 95 %: percentiles of {bands.draws} draws within the tolerances.",
        *tolerance_lines(bands),
        *filter(None, [rows_note(len(path), len(rows), stride)]),
    ):
        console.print(line, soft_wrap=True)


def _varies(column: PathColumn) -> bool:
    """Whether a column holds another number than zero."""
    return any(cell.strip("-0.* ") not in ("", NO_NUMBER) for cell in column.cells)


def _print_head(console: Console, path: EquilibriumPath, title: str) -> None:
    """Print a title and the external loads of a path."""
    console.print(title, style="bold", soft_wrap=True)
    for sentence in load_sentences(path.load.external):
        console.print(sentence, soft_wrap=True)


def load_sentences(external: Sequence[ExternalLoad]) -> list[str]:
    """Return lines with the external loads, and their steps if not at all of them."""
    different = list(dict.fromkeys(external))
    if all(one.is_nothing for one in different):
        return []
    if len(different) > MAX_LOADS:
        return [f"external loads: {len(different)} different ones over the steps"]
    lines: list[str] = []
    for one in different:
        steps = [number for number, other in enumerate(external, start=1) if other == one]
        where = "" if len(different) == 1 else _steps(steps)
        text = f"external loads{where}: {', '.join(external_words(one)) or 'none'}"
        lines += textwrap.wrap(text, width=terminal.NARROW, subsequent_indent="    ")
    return lines


def _steps(steps: list[int]) -> str:
    if len(steps) == 1:
        return f", step {steps[0]}"
    if steps == list(range(steps[0], steps[-1] + 1)):
        return f", steps {steps[0]} to {steps[-1]}"
    return f", {len(steps)} of the steps"


def _labelled(group: ColumnGroup, label: str, *, below: bool = False) -> ColumnGroup:
    """Put the label of one of several paths above its columns, or below their heads."""
    if below:
        return replace(
            group, columns=[replace(one, head=f"{one.head}\n{label}") for one in group.columns]
        )
    several = len(group.columns) > 1
    columns = [
        replace(column, head=f"{label}\n{column.head}" if several else label)
        for column in group.columns
    ]
    return ColumnGroup(group.names, 1, columns)


def _without_room(groups: list[ColumnGroup], room: int) -> list[ColumnGroup]:
    """Return the groups that do not fit, low ranks first served."""
    left_out: list[ColumnGroup] = []
    for group in sorted(groups, key=lambda group: group.rank):
        if group.width <= room:
            room -= group.width
        else:
            left_out.append(group)
    return left_out


def _blocks(step: PathColumn, groups: Sequence[ColumnGroup], room: int) -> list[list[PathColumn]]:
    """Divide columns into tables that fit, each with the steps; one column at least in each."""
    blocks = [[step]]
    for column in (column for group in groups for column in group.columns):
        block = blocks[-1]
        if len(block) > 1 and sum(one.width for one in block) + column.width > room:
            blocks.append([step, column])
        else:
            block.append(column)
    return blocks


def _print_block(
    console: Console, path: EquilibriumPath, rows: Sequence[int], columns: Sequence[PathColumn]
) -> None:
    table = terminal.table([f">{column.head}\n{column.unit}" for column in columns])
    for index, row in enumerate(rows):
        style = None if path.converged[row] else "red"
        table.add_row(*(column.cells[index] for column in columns), style=style)
    console.print(table)


def _print_notes(
    console: Console, shown: Sequence[ColumnGroup], left_out: Sequence[ColumnGroup], room: int
) -> None:
    """Explain the heads, and how to see what had no room."""
    meanings = dict.fromkeys(group.meaning for group in shown if group.meaning and group.columns)
    empty = [name for group in shown if not group.columns for name in group.names]
    lines = [f"{'; '.join(meanings)}."] if meanings else []
    if empty:
        lines.append(f"This path has no values of {', '.join(empty)}.")
    if left_out:
        names = ",".join(dict.fromkeys(name for group in left_out for name in group.names))
        titles = ", ".join(dict.fromkeys(_title(group) for group in left_out))
        lines.append(
            f"No room in {room} columns for: {titles}. --columns {names} shows them, and so does a "
            "wider terminal."
        )
    for line in lines:
        joined = line.replace(" [", "\u00a0[")  # a unit stays with what it is of
        for part in textwrap.wrap(joined, width=min(room, 100) - 1, break_long_words=False):
            console.print(part.replace("\u00a0", " "), soft_wrap=True)


def _title(group: ColumnGroup) -> str:
    if group.names == ("tension", "stroke"):  # each tendon has a group of its own
        return " and ".join(column.head for column in group.columns)
    return "notch angles" if group.names == ("notch_angle",) else QUANTITIES[group.names[0]].title
