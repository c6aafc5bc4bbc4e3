"""A solved path as a table that is as wide as the terminal."""

from __future__ import annotations

import textwrap
from collections.abc import Mapping, Sequence
from itertools import pairwise
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from notchflex import InputError
from notchflex.cli import tables, terminal
from notchflex.cli.options import once
from notchflex.cli.tables import FORMS, NO_NUMBER, cell
from notchflex.loads.load_path import external_words
from notchflex.support import CONTACT_STATES, QUANTITIES, entries_of, holds, nearest

if TYPE_CHECKING:
    from notchflex import Bands, EquilibriumPath

CLOSED = "*"
PERCENT = ("outer_strain", "peak_strain", "fatigue_margin")
"""Strains, which files hold as numbers, are shown in percent."""

USUAL = (
    "temperature",
    "sheath_bend",
    "tension",
    "stroke",
    "total_chord_angle",
    "notch_angle",
    "total_angle",
    "tip_position",
    "peak_strain",
)
"""What is shown where no quantities are named."""

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
}
"""Texts of the legend; other quantities have their titles there."""

_COMMANDS = ("commanded_tension", "commanded_stroke", "temperature", "sheath_bend")
_EVERY_STEP = (*_COMMANDS, "converged", "reason", "residual", "iterations")
"""Quantities that steps without convergence have too."""

MAX_ROWS = 60
"""A path with no more steps than this is shown whole."""

_MAX_ALL = 20_000
"""Steps that `--all` shows at most: nobody reads more."""


class PathColumn(NamedTuple):
    """A column of the table: its head with the unit below, the text of rows, and its legend."""

    head: str
    cells: list[str]
    meaning: str

    @property
    def width(self) -> int:
        """Characters that the column takes, with the gap behind it."""
        return max(map(len, (*self.head.split("\n"), *self.cells))) + 1


def print_path(
    path: EquilibriumPath,
    title: str,
    *,
    columns: Sequence[str],
    every_row: bool,
    bands: Bands | None,
) -> None:
    """Print the steps of a path with units, or the ends and the middle of bands of tolerances.

    Args:
        path: Solved path.
        title: What stands above the table.
        columns: Quantities to show, by their names; none for the usual ones. What does not fit is
            continued below.
        every_row: Whether all steps of a long path are shown.
        bands: The bands of the path; None shows the path itself.
    """
    rows, stride = shown_rows(path, every_row=every_row)
    terminal.line(title, "bold")
    first, *others = path.load.external
    if words := ", ".join(external_words(first)):
        step = "" if all(load == first for load in others) else " of step 1"
        _print_lines(f"external loads{step}: {words}", terminal.NARROW, "    ")
    if bands is not None:
        shown = banded_columns(bands, rows, columns or ("total_angle", "tip_position"))
    elif columns:
        shown = {name: path_columns(path, rows, name) for name in columns}
    else:
        usual = (name for name in USUAL if holds(path, QUANTITIES[name]))
        shown = {name: path_columns(path, rows, name) for name in usual}
        largest = 100.0 * np.fmax.reduce(np.abs(path.peak_strain), axis=1)
        cells = [cell(largest[row] if path.converged[row] else None, ".2f") for row in rows]
        meaning = "strain: largest strain of all notches [%]"
        shown["peak_strain"] = [PathColumn("strain\n%", cells, meaning)]
    every = [column for columns in shown.values() for column in columns]
    _print_columns(path, rows, every)
    notes = ["; ".join(dict.fromkeys(column.meaning for column in every))]
    if empty := [name for name in shown if not shown[name]]:
        notes.append(f"This path has no values of {', '.join(empty)}")
    for note in filter(None, notes):
        _print_lines(f"{note}.", min(terminal.width(), 100) - 1)
    if bands is not None:
        terminal.line(f"5 %, 50 %, 95 %: percentiles of {bands.draws} draws within the tolerances.")
        for words in tables.tolerance_words(path.robot, bands.tolerances, bands.assumed):
            terminal.line(words)
    if stride > 1:
        terminal.line(
            f"{len(path)} steps, {len(rows)} shown: every {stride}{'nd' if stride == 2 else 'th'} "
            "one, and where the load reverses. --all shows every step, --csv FILE and --json FILE "
            "have everything."
        )


def _print_lines(text: str, width: int, indent: str = "") -> None:
    """Print a text broken at words; a unit stays with what it is of."""
    joined = text.replace(" [", "\u00a0[")
    lines = textwrap.fill(joined, width, subsequent_indent=indent, break_long_words=False)
    terminal.line(lines.replace("\u00a0", " "))


def print_beside(
    paths: Mapping[str, EquilibriumPath], *, columns: Sequence[str], every_row: bool
) -> None:
    """Print quantities of several paths under the same loads, side by side."""
    first = next(iter(paths.values()))
    rows, _ = shown_rows(first, every_row=every_row)
    widest = max(8, (terminal.width() - len("step ") - len(paths)) // len(paths))
    for name in columns or ("total_angle",):
        terminal.line(f"\n{QUANTITIES[name].title}, beside each other", "bold")
        shown: list[PathColumn] = []
        for label, path in paths.items():
            short = tables.shortened(label, widest)
            several = path_columns(path, rows, name)
            for column in several:
                head, _, unit = column.head.rpartition("\n")
                lines = [short, head, unit] if len(several) > 1 else [short, unit]
                shown.append(column._replace(head="\n".join(lines)))
        _print_columns(first, rows, shown)


def parse_columns(text: str) -> list[str]:
    """Return the quantities that `--columns` names.

    Example:
        >>> parse_columns("tension, notch_angle")
        ['tension', 'notch_angle']
    """
    allowed = [name for name, quantity in QUANTITIES.items() if "row" not in quantity.per]
    names = [word.strip() for word in text.split(",")]
    for name in names:
        if name not in allowed:
            raise InputError.UNKNOWN_NAME(
                f"--columns {text}: {name!r} is not the name of a quantity"
                f"{nearest(name, allowed)}. Allowed: {', '.join(allowed)}."
            )
    once("--columns", names)
    return names


# Columns


def banded_columns(
    bands: Bands, rows: Sequence[int], names: Sequence[str]
) -> dict[str, list[PathColumn]]:
    """Return what is commanded, and low end, middle and high end of quantities."""
    shown = {name: path_columns(bands.path, rows, name) for name in (*_COMMANDS, *names)}
    for name in (name for name in names if name in bands):
        ends = [path_columns(bands.end(end), rows, name) for end in ("low", "median", "high")]
        shown[name] = [
            _below(column, part)
            for triple in zip(*ends, strict=True)
            for column, part in zip(triple, ("5 %", "50 %", "95 %"), strict=True)
        ]
    return {name: columns for name, columns in shown.items() if columns or name not in _COMMANDS}


def _below(column: PathColumn, text: str) -> PathColumn:
    """Return a column with another line in its head, above the unit."""
    head, _, unit = column.head.rpartition("\n")
    return column._replace(head=f"{head}\n{text}\n{unit}")


def path_columns(path: EquilibriumPath, rows: Sequence[int], name: str) -> list[PathColumn]:
    """Return a column for every entry of a quantity that has any value in these steps."""
    if getattr(path, name, None) is None:
        return []
    quantity = QUANTITIES[name]
    unit = "%" if name in PERCENT else quantity.unit
    form = FORMS.get(unit, ".4g")
    short = HEADS.get(name, "")
    text = MEANINGS.get(name, quantity.title)
    if path.chain.sheath is not None and name in MEANINGS:
        text = text.replace("at the base", "at its drive")
    meaning = f"{short}{': ' * bool(short)}{text}"
    meaning += f" [{unit}]" if unit else ""
    # Of a step that was not solved, what was commanded.
    command = QUANTITIES.get(f"commanded_{name}")
    commanded = [] if command is None else [entry.values for entry in entries_of(path, command)]
    columns: list[PathColumn] = []
    for number, entry in enumerate(entries_of(path, quantity)):
        cells: list[str] = []
        for row in rows:
            value = entry.values[row].item()
            if not path.converged[row] and name not in _EVERY_STEP:
                value = commanded[number][row].item() if commanded else None
            elif name == "contact_state":
                value = CONTACT_STATES[value]
            elif unit == "%":
                value *= 100.0
            cells.append(cell(value, form) or NO_NUMBER)
        # A planar robot has no coordinate across its plane.
        is_plane = entry.name == "y" and not (np.abs(entry.values) > 1e-9).any()
        if is_plane or {*cells} <= {NO_NUMBER}:
            continue
        if short:
            part = entry.name.rpartition(" ")[2]
            head = f"{short}{' ' * (len(short) > 1)}{part}".strip()
        else:
            parts = entry.name.replace("notch ", "").replace(", ", "\n")
            head = name.replace("_", "\n") + f"\n{parts}".rstrip()
        head += f"\n{unit}"
        if name == "notch_angle":
            head = head.replace("\n", " \n") + " "
            closed = (path.closed[row, number] and path.converged[row] for row in rows)
            cells = [text + (CLOSED if on else " ") for text, on in zip(cells, closed, strict=True)]
        columns.append(PathColumn(head, cells, meaning))
    return columns


def _print_columns(
    path: EquilibriumPath, rows: Sequence[int], columns: Sequence[PathColumn]
) -> None:
    """Print columns in tables that fit, each with the steps; one column at least in each."""
    step = PathColumn("step\n", [str(row + 1) for row in rows], "")
    blocks = [[step]]
    for column in columns:
        width = sum(each.width for each in (*blocks[-1], column))
        if len(blocks[-1]) > 1 and width > terminal.width():
            blocks.append([step])
        blocks[-1].append(column)
    styles = ["" if path.converged[row] else "red" for row in rows]
    for block in blocks:
        columns_shown = [(head, cells, ">") for head, cells, _ in block]
        terminal.show(tables.table(columns_shown, styles=styles), wide=True)


# Rows


def shown_rows(path: EquilibriumPath, *, every_row: bool) -> tuple[list[int], int]:
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
    if every_row or steps <= MAX_ROWS:
        return list(range(steps)), 1
    stride = next(
        size * 10**power
        for power in range(7)  # 1, 2, 5, 10, 20, ...: so that round loads stay round
        for size in (1, 2, 5)
        if steps <= MAX_ROWS * size * 10**power
    )
    commands = np.hstack([path.commanded_tension, path.commanded_stroke])
    # The tension of a tendon with a stroke is not commanded.
    commands = commands[:, np.isfinite(commands).any(axis=0)]
    reversals = set().union(*map(reversals_of, commands.T))
    if len(reversals) > MAX_ROWS:
        reversals = {*np.nanargmin(commands, axis=0), *np.nanargmax(commands, axis=0)}
    failed = np.flatnonzero(~np.asarray(path.converged))[:1]
    rows = {*range(0, steps, stride), steps - 1, *reversals, *failed}
    return sorted(map(int, rows)), stride


def reversals_of(column: np.ndarray) -> set[int]:
    """Return the steps at which a command stops rising or falling.

    Where a load is held for some steps before it reverses, the first and the last of these.
    """
    change = np.sign(np.diff(column))
    turns = [
        (before + 1, after)
        for before, after in pairwise(np.flatnonzero(change).tolist())
        if change[before] != change[after]
    ]
    return {step for turn in turns for step in turn}
