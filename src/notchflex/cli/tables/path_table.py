"""A solved path as a table that is as wide as the terminal."""

from __future__ import annotations

import textwrap
from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING

from notchflex.cli import terminal
from notchflex.cli.tables.path_columns import (
    NO_NUMBER,
    ColumnGroup,
    PathColumn,
    named_groups,
    step_column,
    usual_groups,
)
from notchflex.cli.tables.path_rows import rows_note, shown_rows
from notchflex.cli.tables.tolerance_lines import tolerance_lines
from notchflex.loads.summary import external_words
from notchflex.results.quantities.registry import QUANTITIES

if TYPE_CHECKING:
    from rich.console import Console

    from notchflex.analysis import Bands
    from notchflex.loads.external import ExternalLoad
    from notchflex.results import EquilibriumPath

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
