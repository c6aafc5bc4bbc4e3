"""Tables of `notchflex calibrate`."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from notchflex.cli import terminal

if TYPE_CHECKING:
    from rich.console import Console

    from notchflex.fit import Calibration, Interval, LeftOut, NextMeasurement, Posterior

_ROWS = 16
"""More candidates than that are thinned."""


def print_calibration(found: Calibration) -> None:
    """Print constants, their intervals, problems found, and the errors of every part."""
    from notchflex.fit.assessment.diagnosis import NO_PROBLEMS, diagnose
    from notchflex.fit.documents import data_of

    console = terminal.output()
    for label in found.given:
        console.print(f"{label}: {', '.join(data_of(found, label))}", soft_wrap=True)
    kind = type(found.problem.objective).__name__
    count = len(found.searches)
    console.print(f"{_numbers(found)}; {count} search{'es' if count > 1 else ''}")
    chi = found.reduced_chi_squared
    noise = f"; reduced chi squared {chi:.3g} (about 1: as noise)" if math.isfinite(chi) else ""
    console.print(f"{kind} {found.cost:.6g}{noise}")
    console.print()
    _print_constants(console, found)
    console.print()
    for sentence in diagnose(found) or (NO_PROBLEMS,):
        console.print(sentence)
    console.print()
    _print_errors(console, found)


def print_left_out(left_out: LeftOut) -> None:
    """Print how well constants fitted without a part predict it."""
    from notchflex.fit.assessment.errors_of_parts import edge

    console = terminal.output()
    console.print(f"\nFitted without each {left_out.by}, and tried on it (root mean square):")
    table = terminal.table("left out", "quantity")
    terminal.number_columns(table, "error", "of fit to all")
    table.add_column("unit")
    for fold in left_out.folds:
        if not fold.converged:
            table.add_row(fold.label, "not solved", "-", "-", "")
        for name, error in fold.errors.items():
            title, unit, scale = edge(name)
            of_all = fold.errors_of_all.get(name, math.nan) * scale
            table.add_row(fold.label, title, f"{error * scale:.3g}", _plain(of_all), unit)
    console.print(table)


def print_next(best: NextMeasurement) -> None:
    """Print how much each candidate would narrow the intervals."""
    console = terminal.output()
    wanted = ", ".join(best.wanted) or "all constants together"
    console.print(f"\nNext measurement of {best.label}, to narrow {wanted}:")
    rows = range(len(best.gain))
    if len(rows) > _ROWS:
        rows = np.unique(np.linspace(0, len(rows) - 1, _ROWS).round().astype(int)).tolist()
        rows = sorted({*rows, best.best})
    table = terminal.table()
    terminal.number_columns(table, "candidate", *_load_heads(best), "interval after / before")
    for row in rows:
        gain = f"{best.gain[row]:.3f}" if best.converged[row] else "not solved"
        mark = "  best" if row == best.best else ""
        table.add_row(str(row + 1), *_load_cells(best, row), gain + mark.ljust(6))
    console.print(table)


def print_posterior(drawn: Posterior) -> None:
    """Print mean, interval and convergence of the draws of every constant."""
    console = terminal.output()
    chains, count, _ = drawn.draws.shape
    console.print(f"\nPosterior, {chains} chains of {count} draws, {drawn.divergent} divergent:")
    table = terminal.table("constant")
    terminal.number_columns(table, "mean", "middle 95 %", "deviation", "draws worth", "R-hat")
    for name in drawn.names:
        low, high = drawn.intervals[name]
        table.add_row(
            name,
            f"{drawn.means[name]:.5g}",
            f"{low:.4g} to {high:.4g}",
            f"{drawn.deviations[name]:.2g}",
            f"{drawn.effective[name]:.0f}",
            f"{drawn.unlike[name]:.3f}",
        )
    console.print(table)


def _print_constants(console: Console, found: Calibration) -> None:
    table = terminal.table("constant")
    terminal.number_columns(table, "value")
    table.add_column("unit")
    if found.intervals:
        terminal.number_columns(table, "95 % interval")
    terminal.number_columns(table, "deviation")
    for name, value in found.values.items():
        ends = [_interval(found.intervals[name])] if name in found.intervals else []
        table.add_row(
            name, f"{value:.5g}", found.units[name], *ends, _plain(found.deviations[name], 2)
        )
    console.print(table)


def _print_errors(console: Console, found: Calibration) -> None:
    from notchflex.fit.assessment.errors_of_parts import errors_of_parts

    table = terminal.table("robot", "measured")
    terminal.number_columns(table, "rms error", "between repeats")
    table.add_column("unit")
    for one in errors_of_parts(found):
        cells = _plain(one.error), _plain(one.repeats)
        table.add_row(one.robot, one.title, *cells, one.unit)
    console.print(table)


def _numbers(found: Calibration) -> str:
    """Return how many numbers count, and how many do not."""
    counted = found.counted
    words = f"{counted} number{'s' * (counted > 1)} measured"
    rest = len(found.residuals) - counted
    if not rest:
        return words
    return f"{words} (and {rest} total angle{'s' * (rest > 1)}, the sum of the notches)"


def _interval(interval: Interval) -> str:
    ends = ("open" if end is None else f"{end:.5g}" for end in (interval.lower, interval.upper))
    return " to ".join(ends)


def _plain(value: float, digits: int = 3) -> str:
    return f"{value:.{digits}g}" if math.isfinite(value) else "-"


def _load_heads(best: NextMeasurement) -> list[str]:
    return [f"{name} {number + 1} {unit}" for name, unit, number, _ in _loads(best)]


def _load_cells(best: NextMeasurement, row: int) -> list[str]:
    return [_plain(float(values[row]), 4) for _, _, _, values in _loads(best)]


def _loads(best: NextMeasurement) -> list[tuple[str, str, int, np.ndarray]]:
    """Return name, unit, tendon and values of each commanded column."""
    columns = (("tension", "N", best.loads.tension), ("stroke", "mm", best.loads.stroke))
    return [
        (name, unit, tendon, table[:, tendon])
        for name, unit, table in columns
        for tendon in range(table.shape[1])
        if np.isfinite(table[:, tendon]).any()
    ]
