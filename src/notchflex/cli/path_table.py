"""A solved path as a table that is as wide as the terminal."""

from __future__ import annotations

import textwrap
from collections.abc import Mapping, Sequence
from itertools import pairwise
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from notchflex import InputError
from notchflex.cli import tables, terminal
from notchflex.cli.tables import FORMS, NO_NUMBER, cell, tolerance_lines
from notchflex.loads.load_path import external_words
from notchflex.support import AXES, CONTACT_STATES, QUANTITIES, holds, nearest

if TYPE_CHECKING:
    from notchflex import Bands, EquilibriumPath
    from notchflex.support import ExternalLoad, Quantity

CLOSED = "*"
PERCENT = ("outer_strain", "peak_strain")
"""Strains, which files hold as numbers, are shown in percent."""

USUAL = {
    "tension": 1,
    "stroke": 2,
    "total_chord_angle": 5,
    "notch_angle": 7,
    "total_angle": 3,
    "tip_position": 4,
    "peak_strain": 6,
}
"""What is shown where no quantities are named, from left to right; and which has room first."""

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

_EVERY_STEP = (
    "commanded_tension", "commanded_stroke", "converged", "reason", "residual", "iterations",
)  # fmt: skip
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
    columns: Sequence[str] = (),
    every_row: bool = False,
    bands: Bands | None = None,
) -> None:
    """Print the steps of a path with units, or the ends and the middle of bands of tolerances.

    Args:
        path: Solved path.
        title: What stands above the table.
        columns: Quantities to show, by their names; none for the usual ones. The usual ones that
            do not fit are left out and named, those that were asked for are continued below.
        every_row: Whether all steps of a long path are shown.
        bands: The bands of the path; None shows the path itself.
    """
    rows, stride = shown_rows(path, every_row=every_row)
    room = terminal.width()
    console = terminal.output(room)
    console.print(title, style="bold", soft_wrap=True)
    for sentence in load_sentences(path.load.external[0]):
        console.print(sentence, soft_wrap=True)
    if bands is not None:
        shown = banded_columns(bands, rows, columns or ("total_angle", "tip_position"))
    elif columns:
        shown = {name: path_columns(path, rows, name) for name in columns}
    else:
        shown = usual_columns(path, rows)
    left = room - len("step ")
    left_out: list[str] = []
    for name in () if columns or bands else sorted(shown, key=USUAL.__getitem__):
        width = sum(column.width for column in shown[name])
        if width > left:
            left_out.append(name)
        else:
            left -= width
    every = [column for name in shown if name not in left_out for column in shown[name]]
    _print_columns(path, rows, every)
    notes: list[str] = []
    if meanings := dict.fromkeys(column.meaning for column in every):
        notes.append(f"{'; '.join(meanings)}.")
    if empty := [name for name in shown if not shown[name]]:
        notes.append(f"This path has no values of {', '.join(empty)}.")
    if left_out:
        titles = [QUANTITIES[name].title for name in left_out]
        notes.append(
            f"No room in {room} columns for: {', '.join(titles)}. --columns {','.join(left_out)} "
            "shows them, and so does a wider terminal."
        )
    for note in notes:
        joined = note.replace(" [", "\u00a0[")  # a unit stays with what it is of
        for line in textwrap.wrap(joined, width=min(room, 100) - 1, break_long_words=False):
            console.print(line.replace("\u00a0", " "), soft_wrap=True)
    lines = [rows_note(len(path), len(rows), stride)]
    if bands is not None:
        drawn = f"5 %, 50 %, 95 %: percentiles of {bands.draws} draws within the tolerances."
        lines = [drawn, *tolerance_lines(bands), *lines]
    elif left_out or stride > 1:
        lines.append("--csv FILE or --json FILE writes everything.")
    for line in filter(None, lines):
        console.print(line, soft_wrap=True)


def print_beside(
    paths: Mapping[str, EquilibriumPath], *, columns: Sequence[str] = (), every_row: bool = False
) -> None:
    """Print quantities of several paths under the same loads, side by side."""
    first = next(iter(paths.values()))
    rows, _ = shown_rows(first, every_row=every_row)
    room = terminal.width()
    widest = max(8, (room - len("step ") - len(paths)) // len(paths))
    for name in columns or ("total_angle",):
        terminal.output(room).print(f"\n{QUANTITIES[name].title}, beside each other", style="bold")
        shown: list[PathColumn] = []
        for label, path in paths.items():
            short = tables.shortened(label, widest)
            several = path_columns(path, rows, name)
            for column in several:
                head, _, unit = column.head.rpartition("\n")
                head = f"{short}\n{head}" if len(several) > 1 else short
                shown.append(column._replace(head=f"{head}\n{unit}"))
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
            got = repr(name) if name else "an empty name"
            raise InputError.UNKNOWN_NAME(
                f"--columns {text}: {got} is not the name of a quantity{nearest(name, allowed)}. "
                f"Allowed: {', '.join(allowed)}."
            )
        if names.count(name) > 1:
            raise InputError.CONFLICT(f"--columns {text}: {name} is given twice; give it once.")
    return names


# Columns


def usual_columns(path: EquilibriumPath, rows: Sequence[int]) -> dict[str, list[PathColumn]]:
    """Return the columns that are shown where no quantities are named."""
    shown = {
        name: path_columns(path, rows, name) for name in USUAL if holds(path, QUANTITIES[name])
    }
    for name in ("tension", "stroke"):  # of a step that was not solved, what was commanded
        values, command = _values(path, name), _values(path, f"commanded_{name}")
        values = np.where(np.isfinite(values), values, command)
        shown[name] = path_columns(path, rows, name, values)
    if not np.nanmax(np.abs(path.tip_position[:, 1]), initial=0.0) > 1e-9:
        del shown["tip_position"][1]  # a planar robot has no coordinate across its plane
    largest = np.abs(_values(path, "peak_strain")).max(axis=1)
    (strain,) = path_columns(path, rows, "peak_strain", largest)
    meaning = "strain: largest strain of all notches [%]"
    shown["peak_strain"] = [strain._replace(head="strain\n%", meaning=meaning)]
    return shown


def banded_columns(
    bands: Bands, rows: Sequence[int], names: Sequence[str]
) -> dict[str, list[PathColumn]]:
    """Return what is commanded, and low end, middle and high end of quantities."""
    shown: dict[str, list[PathColumn]] = {}
    for name in ("commanded_tension", "commanded_stroke"):
        columns = path_columns(bands.path, rows, name)
        if commanded := [column for column in columns if {*column.cells} != {NO_NUMBER}]:
            shown[name] = commanded
    for name in names:
        if name not in bands:
            shown[name] = path_columns(bands.path, rows, name)
            continue
        ends = [path_columns(bands.end(end), rows, name) for end in ("low", "median", "high")]
        shown[name] = []
        for triple in zip(*ends, strict=True):
            texts = {text.strip("-0.* ") for column in triple for text in column.cells}
            if texts <= {"", NO_NUMBER}:
                continue  # a component that is zero in all steps
            for column, part in zip(triple, ("5 %", "50 %", "95 %"), strict=True):
                head, _, unit = column.head.rpartition("\n")
                shown[name].append(column._replace(head=f"{head}\n{part}\n{unit}"))
    return shown


def _values(path: EquilibriumPath, name: str) -> np.ndarray:
    """Return a quantity as it is shown: without numbers where a step did not converge."""
    values = np.asarray(getattr(path, name))
    if name == "contact_state":
        values = np.array([CONTACT_STATES[state] for state in values.flat]).reshape(values.shape)
    if name in _EVERY_STEP:
        return values
    solved = np.asarray(path.converged).reshape(-1, *[1] * (values.ndim - 1))
    nothing: Any = np.nan if values.dtype.kind == "f" else None
    return np.where(solved, values, nothing)


def path_columns(
    path: EquilibriumPath, rows: Sequence[int], name: str, values: np.ndarray | None = None
) -> list[PathColumn]:
    """Return a column for every component of a quantity that holds anything.

    Args:
        path: Solved path.
        rows: Steps to show.
        name: The quantity.
        values: What is shown in its place.
    """
    if getattr(path, name, None) is None:
        return []
    quantity = QUANTITIES[name]
    values = _values(path, name) if values is None else values
    unit = "%" if name in PERCENT else quantity.unit
    form = FORMS.get(unit, ".4g")
    short = f"{HEADS[name]}: " if name in HEADS else ""
    meaning = f"{short}{MEANINGS.get(name, quantity.title)}{f' [{unit}]' if unit else ''}"
    columns: list[PathColumn] = []
    for index in np.ndindex(values.shape[1:]):
        component = values[:, *index]
        if values.dtype.kind == "f":
            if quantity.per[1:] in (("span",), ("contact",)) and np.isnan(component).all():
                continue  # a tendon that ends before the others has fewer
            component = component * (100.0 if unit == "%" else quantity.scale)
        cells = [cell(value, form) or NO_NUMBER for value in component[list(rows)].tolist()]
        head = f"{_head(quantity, index, values.shape[1:])}\n{unit}"
        if name == "notch_angle":
            closed = _values(path, "closed")[list(rows), *index]
            cells = [text + (CLOSED if on else " ") for text, on in zip(cells, closed, strict=True)]
            head = head.replace("\n", " \n") + " "
        columns.append(PathColumn(head, cells, meaning))
    return columns


def _head(quantity: Quantity, index: tuple[int, ...], shape: tuple[int, ...]) -> str:
    head = HEADS.get(quantity.name, quantity.name.replace("_", "\n"))
    words = [
        AXES[one] if what == "axis" else str(one + (what not in ("span", "body")))
        for what, one in zip(quantity.per, index, strict=False)
        if (what, shape[0]) != ("tendon", 1)
    ]
    gap = "" if len(head) == 1 or not words else (" " if quantity.name in HEADS else "\n")
    return head + gap + ".".join(words)


def _print_columns(
    path: EquilibriumPath, rows: Sequence[int], columns: Sequence[PathColumn]
) -> None:
    """Print columns in tables that fit, each with the steps; one column at least in each."""
    room = terminal.width()
    step = PathColumn("step\n", [str(row + 1) for row in rows], "")
    blocks = [[step]]
    for column in columns:
        block = blocks[-1]
        if len(block) > 1 and sum(one.width for one in block) + column.width > room:
            blocks.append([step, column])
        else:
            block.append(column)
    styles = ["" if path.converged[row] else "red" for row in rows]
    for block in blocks:
        table = tables.table([(head, cells, ">") for head, cells, _ in block], styles=styles)
        terminal.output(room).print(table)


# Rows


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
    if every_row or steps <= MAX_ROWS:
        return list(range(steps)), 1
    stride = next(
        size * 10**power
        for power in range(7)  # 1, 2, 5, 10, 20, ...: so that round loads stay round
        for size in (1, 2, 5)
        if steps <= MAX_ROWS * size * 10**power
    )
    reversals: set[int] = set()
    extremes: set[int] = set()
    for column in (*np.asarray(path.commanded_tension).T, *np.asarray(path.commanded_stroke).T):
        if np.isfinite(column).any():  # the tension of a tendon with a stroke is not commanded
            reversals |= reversals_of(column)
            extremes |= {int(np.nanargmin(column)), int(np.nanargmax(column))}
    rows = set(range(0, steps, stride)) | {steps - 1}
    rows |= reversals if len(reversals) <= MAX_ROWS else extremes
    rows |= {int(step) for step in np.flatnonzero(~np.asarray(path.converged))[:1]}
    return sorted(rows), stride


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


def rows_note(steps: int, shown: int, stride: int) -> str:
    """Return the sentence that says which steps are shown; "" where all are."""
    if stride == 1:
        return ""
    which = {1: "st", 2: "nd", 3: "rd"}.get(stride, "th")
    return (
        f"{steps} steps, {shown} shown: every {stride}{which} one, and where the load reverses. "
        "--all shows every step."
    )


def load_sentences(load: ExternalLoad) -> list[str]:
    """Return lines with the external loads, which act at all steps; none where nothing acts."""
    words = ", ".join(external_words(load))
    text = f"external loads: {words}" if words else ""
    return textwrap.wrap(text, width=terminal.NARROW, subsequent_indent="    ")
