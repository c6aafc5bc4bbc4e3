"""A solved path as a table that fits a terminal of 80 columns."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray
from rich.table import Table

from notchflex.cli import terminal
from notchflex.results.quantities import AXES, QUANTITIES, Quantity

if TYPE_CHECKING:
    from notchflex.statics import Path

MOST_ROWS = 21
MOST_NOTCH_COLUMNS = 6
MOST_TENDON_COLUMNS = 4


def print_path(path: Path) -> None:
    """Print the steps of a path, thinned if there are many, with units in the header."""
    console = terminal.output()
    console.print(f"[bold]{_escape(path.robot.name)}[/]", markup=True)
    rows = telling_rows(path)
    table = Table(box=None, padding=(0, 1, 0, 0), header_style="bold", pad_edge=False)
    columns = _columns(path)
    for head, unit, _ in columns:
        table.add_column(f"{head}\n{unit}", justify="right", no_wrap=True)
    for row in rows:
        good = bool(path.converged[row])
        cells = [write(row) if good else _failed(path, head, row) for head, _, write in columns]
        table.add_row(*cells, style=None if good else "red")
    console.print(table)
    if len(rows) < len(path):
        console.print(
            f"{len(path)} steps, {len(rows)} of them shown; --csv F or --json F writes all."
        )
    if np.asarray(path.closed).any():
        console.print("* closed notch")


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
    for count in range(most - len(must) + 2, 1, -1):
        chosen = must | {round(x) for x in np.linspace(0, steps - 1, count)}
        if len(chosen) <= most:
            return sorted(chosen)
    return sorted(must)


def _columns(path: Path) -> list[tuple[str, str, Callable[[int], str]]]:
    """Return head, unit and writer of every column; the writer takes the step."""
    columns: list[tuple[str, str, Callable[[int], str]]] = [("step", "", lambda row: str(row + 1))]
    tendons = path.tension.shape[1]
    for tendon in range(min(tendons, MOST_TENDON_COLUMNS)):
        mark = str(tendon + 1) if tendons > 1 else ""
        columns.append(_numbers("tension", f"T{mark}", path.tension[:, tendon], ".3f"))
        columns.append(_numbers("stroke", f"u{mark}", path.stroke[:, tendon], ".3f"))
    notches = path.notch_angle.shape[1]
    room = MOST_NOTCH_COLUMNS - 2 * (min(tendons, MOST_TENDON_COLUMNS) - 1)
    if notches <= room:
        for notch in range(notches):
            columns.append(_notch(path, notch))
    columns.append(_numbers("total_angle", "total", path.total_angle, ".2f"))
    out_of_plane = np.nanmax(np.abs(path.tip_position[:, 1]), initial=0.0) > 1e-9
    for tip, axis in zip(path.tip_position.T, AXES, strict=True):
        if axis != "y" or out_of_plane:
            columns.append(_numbers("tip_position", f"tip {axis}", tip, ".3f"))
    peak = 100.0 * np.abs(path.peak_strain).max(axis=1)
    columns.append(("strain", "%", lambda row: f"{peak[row]:.2f}"))
    return columns


def _numbers(
    name: str, head: str, values: NDArray[np.float64], form: str
) -> tuple[str, str, Callable[[int], str]]:
    quantity: Quantity = QUANTITIES[name]
    scaled = values * quantity.scale

    def write(row: int) -> str:
        return _rounded(float(scaled[row]), form)

    return head, quantity.unit, write


def _rounded(value: float, form: str) -> str:
    """Write a number without the minus sign of a zero that rounding made."""
    text = format(value, form)
    return text.lstrip("-") if not text.strip("-0.") else text


def _notch(path: Path, notch: int) -> tuple[str, str, Callable[[int], str]]:
    quantity = QUANTITIES["notch_angle"]
    angles: Any = path.notch_angle[:, notch] * quantity.scale

    def write(row: int) -> str:
        return f"{_rounded(float(angles[row]), '.2f')}{'*' if path.closed[row, notch] else ' '}"

    return f"n{notch + 1} ", f"{quantity.unit} ", write


def _failed(path: Path, head: str, row: int) -> str:
    """Write what is known of a step that was not solved: its number and what was commanded."""
    if head == "step":
        return str(row + 1)
    for name, letter in (("commanded_tension", "T"), ("commanded_stroke", "u")):
        if head.startswith(letter) and head[1:].strip("0123456789") == "":
            value = getattr(path, name)[row, int(head[1:] or 1) - 1]
            return f"{value:.3f}" if np.isfinite(value) else "–"
    return "–"


def _escape(text: str) -> str:
    from rich.markup import escape

    return escape(text)
