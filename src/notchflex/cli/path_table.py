"""A solved path as a table that fits a terminal of 80 columns."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from rich.table import Table

from notchflex.cli import terminal
from notchflex.cli.load_words import load_sentences
from notchflex.results.quantities import AXES, QUANTITIES
from notchflex.results.spans import holds

if TYPE_CHECKING:
    from notchflex.statics import Path

MOST_ROWS = 21
NO_NUMBER = "–"
NARROW_NUMBERS = terminal.NARROW - 6
"""Characters that are left beside the number of the step."""


@dataclass(frozen=True)
class Column:
    """A column of the table: its head, its unit and the text of every row."""

    head: str
    unit: str
    cells: list[str]

    @property
    def width(self) -> int:
        """Characters that the column takes, with the gap behind it."""
        return max(map(len, (self.head, self.unit, *self.cells))) + 1


def print_path(path: Path) -> None:
    """Print the steps of a path with units: not all rows of a long one, what fits of a wide one."""
    console = terminal.output()
    console.print(path.robot.name, style="bold", soft_wrap=True)
    for sentence in load_sentences(path.load.external):
        console.print(sentence, soft_wrap=True)
    rows = telling_rows(path)
    columns, left_out = _fitting(_groups(path, rows), terminal.NARROW)
    table = Table(box=None, padding=(0, 1, 0, 0), header_style="bold", pad_edge=False)
    for column in columns:
        table.add_column(f"{column.head}\n{column.unit}", justify="right", no_wrap=True)
    for place, row in enumerate(rows):
        style = None if path.converged[row] else "red"
        table.add_row(*(column.cells[place] for column in columns), style=style)
    console.print(table)
    if any("*" in cell for column in columns for cell in column.cells):
        console.print("* closed notch")
    if len(rows) < len(path):
        console.print(f"{len(path)} steps, {len(rows)} of them shown.")
    if left_out:
        console.print(f"Too wide to be shown: {', '.join(left_out)}.")
    if len(rows) < len(path) or left_out:
        console.print("--csv FILE or --json FILE writes everything.")


def print_beside(paths: Mapping[str, Path]) -> None:
    """Print the total angle of several paths under the same loads, side by side."""
    first = next(iter(paths.values()))
    rows = telling_rows(first)
    quantity = QUANTITIES["total_angle"]
    table = Table(
        box=None, padding=(0, 1, 0, 0), header_style="bold", pad_edge=False, title_justify="left"
    )
    table.add_column("step\n", justify="right", no_wrap=True)
    width = (NARROW_NUMBERS - len(paths)) // len(paths)
    for label in paths:
        head = label if len(label) <= width else f"{label[: width - 1]}…"
        table.add_column(f"{head}\n{quantity.unit}", justify="right", no_wrap=True)
    for row in rows:
        cells = [
            _rounded(float(path.total_angle[row]) * quantity.scale, ".2f")
            if path.converged[row]
            else NO_NUMBER
            for path in paths.values()
        ]
        table.add_row(str(row + 1), *cells)
    console = terminal.output()
    console.print()
    console.print(f"{quantity.title}, beside each other", style="bold")
    console.print(table)


def telling_rows(path: Path, most: int = MOST_ROWS) -> list[int]:
    """Return the rows to print: spread evenly, with the ends, the turns and the first failure."""
    steps = len(path)
    if steps <= most:
        return list(range(steps))
    must = {0, steps - 1}
    for column in [*path.tension.T, *path.stroke.T]:
        change = np.sign(np.diff(column))
        moves = np.flatnonzero(change)
        turns = moves[1:][change[moves][1:] != change[moves][:-1]]
        must.update(int(turn) for turn in turns[:most])
    failed = np.flatnonzero(~np.asarray(path.converged))
    must.update(int(step) for step in failed[:1])
    if len(must) > most:  # a jagged path: even spreading tells more than some of its turns
        must = {0, steps - 1}
    # Evenly spread steps fill up what the marked ones leave of the rows.
    for count in range(most, 1, -1):
        chosen = must | {round(x) for x in np.linspace(0, steps - 1, count)}
        if len(chosen) <= most:
            return sorted(chosen)
    return sorted(must)


@dataclass(frozen=True)
class Group:
    """Columns that are shown or left out together.

    Attributes:
        name: What is said to be left out.
        rank: Groups of a low rank are shown first.
        columns: The columns, in their place in the table.
    """

    name: str
    rank: int
    columns: list[Column]


def _fitting(groups: list[Group], room: int) -> tuple[list[Column], list[str]]:
    """Return the columns that fit, in the order of the table, and the names of what does not."""
    chosen: set[str] = set()
    for group in sorted(groups, key=lambda group: group.rank):
        width = sum(column.width for column in group.columns)
        if width <= room:
            room -= width
            chosen.add(group.name)
    columns = [column for group in groups if group.name in chosen for column in group.columns]
    return columns, [group.name for group in groups if group.name not in chosen]


def _groups(path: Path, rows: list[int]) -> list[Group]:
    """Return all columns, in the order of the table."""

    def numbers(name: str, head: str, values: Any, form: str = ".3f") -> Column:
        quantity = QUANTITIES[name]
        cells = [
            _rounded(float(values[row]) * quantity.scale, form)
            if path.converged[row]
            else NO_NUMBER
            for row in rows
        ]
        return Column(head, quantity.unit, cells)

    groups = [Group("step", 0, [Column("step", "", [str(row + 1) for row in rows])])]
    tendons = path.tension.shape[1]
    for tendon in range(tendons):
        number = str(tendon + 1) if tendons > 1 else ""
        tension = numbers("tension", f"T{number}", path.tension[:, tendon])
        stroke = numbers("stroke", f"u{number}", path.stroke[:, tendon])
        # A step that was not solved still shows what was commanded.
        for column, command in (
            (tension, path.commanded_tension[:, tendon]),
            (stroke, path.commanded_stroke[:, tendon]),
        ):
            for place, row in enumerate(rows):
                if not path.converged[row] and np.isfinite(command[row]):
                    column.cells[place] = _rounded(float(command[row]), ".3f")
        commanded = np.isfinite([path.commanded_tension, path.commanded_stroke])[..., tendon].any()
        groups.append(Group(f"tendon {tendon + 1}", 1 if commanded else 5, [tension, stroke]))
    if holds(path, QUANTITIES["total_chord_angle"]):
        chord = numbers("total_chord_angle", "chords", path.total_chord_angle, ".2f")
        groups.append(Group("total chord angle", 2, [chord]))
    groups.append(Group("notch angles", 4, [_notch(path, j, rows) for j in _notches(path)]))
    groups.append(
        Group("total angle", 2, [numbers("total_angle", "total", path.total_angle, ".2f")])
    )
    out_of_plane = np.nanmax(np.abs(path.tip_position[:, 1]), initial=0.0) > 1e-9
    groups.append(
        Group(
            "tip position",
            2,
            [
                numbers("tip_position", f"tip {axis}", values)
                for axis, values in zip(AXES, path.tip_position.T, strict=True)
                if axis != "y" or out_of_plane
            ],
        )
    )
    peak = np.abs(path.peak_strain).max(axis=1)
    strain = [f"{100 * peak[row]:.2f}" if path.converged[row] else NO_NUMBER for row in rows]
    groups.append(Group("peak strain", 3, [Column("strain", "%", strain)]))
    return groups


def _notches(path: Path) -> range:
    return range(path.notch_angle.shape[1])


def _notch(path: Path, notch: int, rows: list[int]) -> Column:
    """Return the angles of a notch; a star marks where it is closed."""
    quantity = QUANTITIES["notch_angle"]
    cells = [
        _rounded(float(path.notch_angle[row, notch]) * quantity.scale, ".2f")
        + ("*" if path.closed[row, notch] else " ")
        if path.converged[row]
        else f"{NO_NUMBER} "
        for row in rows
    ]
    return Column(f"n{notch + 1} ", f"{quantity.unit} ", cells)


def _rounded(value: float, form: str) -> str:
    """Write a number without the minus sign of a zero that rounding made."""
    text = format(value, form)
    return text.lstrip("-") if not text.strip("-0.") else text
