"""A solved path as a table that is as wide as the terminal."""

from __future__ import annotations

import textwrap
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING

from notchflex.cli import terminal
from notchflex.cli.tables.load_words import load_sentences
from notchflex.cli.tables.path_columns import Column, Group, named_groups, step_group, usual_groups
from notchflex.cli.tables.path_rows import all_rows, rows_note, shown_rows
from notchflex.results.quantities.registry import QUANTITIES

if TYPE_CHECKING:
    from rich.console import Console

    from notchflex.results import EquilibriumPath


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
    rows, stride = all_rows(path) if every_row else shown_rows(path)
    room = terminal.width()
    console = terminal.output(room)
    console.print(title, style="bold", soft_wrap=True)
    for sentence in load_sentences(path.load.external):
        console.print(sentence, soft_wrap=True)
    step = step_group(rows)
    left_out: list[Group] = []
    if columns:
        groups = named_groups(path, rows, columns)
        for block in _blocks(step, groups, room):
            _print_block(console, path, rows, block)
    else:
        groups, left_out = _fitting(step, usual_groups(path, rows), room)
        _print_block(console, path, rows, [*step.columns, *_columns(groups)])
    _print_notes(console, groups, left_out, room)
    note = rows_note(len(path), len(rows), stride)
    if note:
        console.print(note, soft_wrap=True)
    if note or left_out:
        console.print("--csv FILE or --json FILE writes everything.", soft_wrap=True)


def print_beside(
    paths: Mapping[str, EquilibriumPath], *, columns: Sequence[str] = (), every_row: bool = False
) -> None:
    """Print quantities of several paths under the same loads, side by side.

    Args:
        paths: Label to path.
        columns: Quantities to show, by their names; the total angle where none are named.
        every_row: Whether all steps of a long path are shown.
    """
    first = next(iter(paths.values()))
    rows, _ = all_rows(first) if every_row else shown_rows(first)
    room = terminal.width()
    console = terminal.output(room)
    step = step_group(rows)
    widest = max(8, (room - step.width - len(paths)) // len(paths))
    for name in columns or ("total_angle",):
        console.print()
        console.print(f"{QUANTITIES[name].title}, beside each other", style="bold")
        groups: list[Group] = []
        for label, path in paths.items():
            (group,) = named_groups(path, rows, [name])
            groups.append(Group(group.names, 1, _labelled(group, _shortened(label, widest))))
        for block in _blocks(step, groups, room):
            _print_block(console, first, rows, block)


def _labelled(group: Group, label: str) -> list[Column]:
    """The columns of one of several paths, under its label."""
    several = len(group.columns) > 1
    return [
        Column(f"{label}\n{one.head}" if several else label, one.unit, one.cells)
        for one in group.columns
    ]


def _shortened(label: str, width: int) -> str:
    return label if len(label) <= width else f"{label[: width - 1]}…"


def _fitting(step: Group, groups: list[Group], room: int) -> tuple[list[Group], list[Group]]:
    """Return the groups that fit beside the step and those that do not, in their order."""
    room -= step.width
    chosen: list[Group] = []
    for group in sorted(groups, key=lambda group: group.rank):
        if group.width <= room:
            room -= group.width
            chosen.append(group)
    return (
        [group for group in groups if group in chosen],
        [group for group in groups if group not in chosen],
    )


def _blocks(step: Group, groups: Sequence[Group], room: int) -> list[list[Column]]:
    """Divide columns into tables that fit, each with the steps; one column at least in each."""
    blocks = [list(step.columns)]
    for column in _columns(groups):
        block = blocks[-1]
        if len(block) > 1 and sum(one.width for one in block) + column.width > room:
            blocks.append([*step.columns, column])
        else:
            block.append(column)
    return blocks


def _columns(groups: Sequence[Group]) -> list[Column]:
    return [column for group in groups for column in group.columns]


def _print_block(
    console: Console, path: EquilibriumPath, rows: Sequence[int], columns: Sequence[Column]
) -> None:
    # Units stand on one line at the foot of the heads.
    deepest = max(column.head.count("\n") for column in columns)
    above = ["\n" * (deepest - column.head.count("\n")) for column in columns]
    heads = [f">{gap}{one.head}\n{one.unit}" for gap, one in zip(above, columns, strict=True)]
    table = terminal.table(heads)
    for place, row in enumerate(rows):
        style = None if path.converged[row] else "red"
        table.add_row(*(column.cells[place] for column in columns), style=style)
    console.print(table)


def _print_notes(
    console: Console, shown: Sequence[Group], left_out: Sequence[Group], room: int
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


def _title(group: Group) -> str:
    if group.names == ("tension", "stroke"):  # each tendon has a group of its own
        return " and ".join(column.head for column in group.columns)
    return "notch angles" if group.names == ("notch_angle",) else QUANTITIES[group.names[0]].title
