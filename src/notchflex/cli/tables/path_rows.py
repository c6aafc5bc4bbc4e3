"""Which steps of a long path a table shows: a regular stride, with peaks and reversals."""

from __future__ import annotations

from itertools import pairwise
from typing import TYPE_CHECKING

import numpy as np

from notchflex.errors import InputError

if TYPE_CHECKING:
    from notchflex.results import EquilibriumPath

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
        rows |= reversals if len(reversals) <= MAX_ROWS else _extremes(path)
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


def _extremes(path: EquilibriumPath) -> set[int]:
    return {
        int(pick(column))
        for column in _commanded(path)
        for pick in (np.nanargmin, np.nanargmax)
        if np.isfinite(column).any()
    }


def _commanded(path: EquilibriumPath) -> list[np.ndarray]:
    """Return the commanded columns; the tension of a tendon with a stroke is not commanded."""
    columns = [*np.asarray(path.commanded_tension).T, *np.asarray(path.commanded_stroke).T]
    return [column for column in columns if np.isfinite(column).any()]
