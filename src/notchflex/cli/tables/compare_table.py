"""The table of `notchflex compare`."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from notchflex.cli import terminal
from notchflex.cli.tables.notch_tables import shown_numbers
from notchflex.fit import edge
from notchflex.support import DEGREES

if TYPE_CHECKING:
    from notchflex.comparison import Comparison

MAX_COLUMNS = 8
"""Numbers side by side in one table; more of them go below."""


def print_comparison(comparison: Comparison, others: dict[str, Comparison]) -> None:
    """Print the errors of a model, and of others beside it, of every part that was measured."""
    console = terminal.output()
    measured = comparison.measured
    console.print(f"{comparison.robot.name}, {measured.source}", soft_wrap=True)
    points, trials = (
        f"{number} {what}{'s' if number != 1 else ''}"
        for number, what in ((comparison.points, "point"), (len(measured.pulls), "trial"))
    )
    console.print(
        f"{points} of {trials}, each "
        f"{'pulled from rest' if measured.from_rest else 'trial one loading path'}"
    )
    if comparison.angle == "edge_angle":
        console.print("angles between the faces of the notches (edge angles)")
    models = {"model": comparison, **others}
    columns = _columns(models)
    for first in range(0, len(columns), MAX_COLUMNS):  # a wide robot in parts of 80 columns each
        some = columns[first : first + MAX_COLUMNS]
        heads = ["root-mean-square error\n", *(f">{head}" for head, _ in some)]
        rows = [
            [terminal.shortened(label, 24), *(cells[n] for _, cells in some)]
            for n, label in enumerate(models)
        ]
        console.print(terminal.table(heads, rows))
    for name, error in comparison.others.items():
        title, unit, scale = edge(name)
        console.print(f"{title}: {error * scale:.3f} {unit}")
    for sentence in comparison.diagnosis:
        console.print(sentence)


def _columns(models: dict[str, Comparison]) -> list[tuple[str, list[str]]]:
    """Head and one number for each model, of every notch, the total and the tip if measured."""
    first, every = next(iter(models.values())), models.values()
    errors = [
        (f"n{n + 1}\ndeg", ".2f", [one.rmse_notches[n] * DEGREES for one in every])
        for n in range(first.robot.number_of_notches)
        if np.isfinite(first.measured_notch_angle[:, n]).any()
    ]
    if np.isfinite(first.measured_total_angle).any():
        errors.append(("total\ndeg", ".2f", [one.rmse_total * DEGREES for one in every]))
    if np.isfinite(first.measured_tip).any():
        errors.append(("tip\nmm", ".3f", [one.rmse_tip for one in every]))
    return [(head, shown_numbers(values, form)) for head, form, values in errors]
