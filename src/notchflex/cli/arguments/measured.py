"""Measurements for `compare` and `calibrate`: how rows were loaded, and notes on a table."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated

from cyclopts import Parameter

from notchflex.cli import terminal

if TYPE_CHECKING:
    from notchflex.fit import Measurements

OnePath = Annotated[
    bool | None,
    Parameter(
        name="--path",
        negative="--from-rest",
        show_default=False,
        help="Take the rows of each pull as one loading path with friction history, or each row as "
        "loaded from rest. Without either the column `from_rest` of the file decides, else the "
        "order of its rows: a force that falls step by step within a pull makes it a path.",
    ),
]


def from_rest(path: bool | None) -> bool | None:
    """Return the argument of `read_measurements`; None where neither option is given."""
    return None if path is None else not path


def note_table(measured: Measurements) -> None:
    """Write how the rows were interpreted and what was not used."""
    if measured.order:
        terminal.note(f"{measured.source}: {measured.order}.")
    if measured.ignored:
        terminal.note(f"{measured.source}: ignored columns: {', '.join(measured.ignored)}.")
    if measured.negative_forces:
        count = measured.negative_forces
        are = "force is" if count == 1 else "forces are"
        terminal.note(
            f"{measured.source}: {count} measured {are} negative (sensor offset); the model "
            "uses 0 N."
        )
