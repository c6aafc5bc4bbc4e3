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


def print_calibration(fit: Calibration) -> None:
    """Print constants, their intervals, problems found, and the errors of every part."""
    from notchflex.fit import NO_PROBLEMS, data_of, diagnose

    console = terminal.output()
    for label in fit.given:
        console.print(f"{label}: {', '.join(data_of(fit, label))}", soft_wrap=True)
    kind = type(fit.problem.objective).__name__
    count = len(fit.searches)
    console.print(f"{_numbers(fit)}; {count} search{'es' if count > 1 else ''}")
    chi = fit.reduced_chi_squared
    noise = f"; reduced chi squared {chi:.3g} (about 1: as noise)" if math.isfinite(chi) else ""
    console.print(f"{kind} {fit.cost:.6g}{noise}")
    if fit.drawing:
        names = ", ".join(f"{name} {sd:+.2g}" for name, sd in fit.deviations_of_drawing.items())
        console.print(f"Deviations within tolerances, in standard deviations: {names}.")
    console.print()
    _print_constants(console, fit)
    console.print()
    for sentence in diagnose(fit) or (NO_PROBLEMS,):
        console.print(sentence)
    console.print()
    _print_errors(console, fit)


def print_left_out(left_out: LeftOut) -> None:
    """Print how well constants fitted without a part predict it."""
    from notchflex.fit import edge

    rows: list[list[str]] = []
    for fold in left_out.folds:
        rows += [] if fold.converged else [[fold.label, "not solved", "-", "-", ""]]
        for name, error in fold.errors.items():
            title, unit, scale = edge(name)
            of_all = fold.errors_of_all.get(name, math.nan) * scale
            rows.append([fold.label, title, f"{error * scale:.3g}", _plain(of_all), unit])
    console = terminal.output()
    console.print(f"\nFitted without each {left_out.by}, and tried on it (root mean square):")
    console.print(
        terminal.table(["left out", "quantity", ">error", ">of fit to all", "unit"], rows)
    )
    _print_specimens(left_out)


def _print_specimens(left_out: LeftOut) -> None:
    """Print what is known of constants that robots have of their own, before and after a row."""
    from notchflex.fit import edge

    console = terminal.output()
    constants: list[list[str]] = []
    errors: list[list[str]] = []
    for fold in left_out.folds:
        for name, (mean, size) in fold.before.items():
            value = "-" if fold.specimen is None else f"{fold.specimen.values[name]:.4g}"
            gain = "-" if fold.specimen is None else f"{fold.specimen.gain:.2f}"
            constants.append([fold.label, name, f"{mean:.4g} ± {size:.2g}", value, gain])
        inside = fold.share_inside()
        for name, error in fold.errors.items() if fold.before else ():
            title, unit, scale = edge(name)
            after = fold.errors_updated.get(name, math.nan) * scale
            row = [fold.label, title, f"{100.0 * inside[name]:.0f} %"]
            errors.append([*row, f"{error * scale:.3g}", _plain(after), unit])
    if not constants:
        return
    console.print("\nConstants of a robot left out, by prior and others, and by one row of it:")
    heads = ["left out", "constant", ">before", ">photograph", ">width of total after / before"]
    console.print(terminal.table(heads, constants))
    console.print()
    heads = ["left out", "quantity", ">in 90 % band", ">error", ">after photograph", "unit"]
    console.print(terminal.table(heads, errors))


def print_next(best: NextMeasurement) -> None:
    """Print how much each candidate would narrow the intervals."""
    shown = range(len(best.gain))
    if len(shown) > _ROWS:
        thinned = np.unique(np.linspace(0, len(shown) - 1, _ROWS).round().astype(int)).tolist()
        shown = sorted({*thinned, best.best})
    loads = _loads(best)
    rows: list[list[str]] = []
    for row in shown:
        gain = f"{best.gain[row]:.3f}" if best.converged[row] else "not solved"
        mark = "  best" if row == best.best else ""
        cells = [_plain(float(values[row]), 4) for _, values in loads]
        rows.append([str(row + 1), *cells, gain + mark.ljust(6)])
    console = terminal.output()
    names = ", ".join(best.wanted) or "all constants together"
    console.print(f"\nNext measurement of {best.label}, to narrow {names}:")
    heads = ["candidate", *(head for head, _ in loads), "interval after / before"]
    console.print(terminal.table([f">{head}" for head in heads], rows))


def print_posterior(drawn: Posterior) -> None:
    """Print mean, interval and convergence of the draws of every constant."""
    rows = [
        [
            name,
            f"{drawn.means[name]:.5g}",
            "{:.4g} to {:.4g}".format(*drawn.intervals[name]),
            f"{drawn.deviations[name]:.2g}",
            f"{drawn.effective[name]:.0f}",
            f"{drawn.r_hat[name]:.3f}",
        ]
        for name in drawn.names
    ]
    console = terminal.output()
    chains, count, _ = drawn.draws.shape
    console.print(f"\nPosterior, {chains} chains of {count} draws, {drawn.divergent} divergent:")
    heads = ["constant", ">mean", ">middle 95 %", ">deviation", ">effective draws", ">R-hat"]
    console.print(terminal.table(heads, rows))


def _print_constants(console: Console, fit: Calibration) -> None:
    interval = [">95 % interval"] if fit.intervals else []
    rows = [
        [
            name,
            f"{value:.5g}",
            fit.units[name],
            *([_interval(fit.intervals[name])] if name in fit.intervals else []),
            _plain(fit.deviations[name], 2),
        ]
        for name, value in fit.values.items()
    ]
    console.print(terminal.table(["constant", ">value", "unit", *interval, ">deviation"], rows))


def _print_errors(console: Console, fit: Calibration) -> None:
    from notchflex.fit import errors_of_parts

    heads = ["robot", "measured", ">rms error", ">between repeats", "unit"]
    rows = [
        [one.robot, one.title, _plain(one.error), _plain(one.repeats), one.unit]
        for one in errors_of_parts(fit)
    ]
    console.print(terminal.table(heads, rows))


def _numbers(fit: Calibration) -> str:
    """Return how many numbers count, and how many do not."""
    counted = fit.counted
    words = f"{counted} number{'s' * (counted > 1)} measured"
    rest = len(fit.residuals) - counted
    if not rest:
        return words
    return f"{words} (and {rest} total angle{'s' * (rest > 1)}, the sum of the notches)"


def _interval(interval: Interval) -> str:
    ends = ("open" if end is None else f"{end:.5g}" for end in (interval.lower, interval.upper))
    return " to ".join(ends)


def _plain(value: float, digits: int = 3) -> str:
    return f"{value:.{digits}g}" if math.isfinite(value) else "-"


def _loads(best: NextMeasurement) -> list[tuple[str, np.ndarray]]:
    """Return head and values of each commanded column."""
    columns = (("tension", "N", best.loads.tension), ("stroke", "mm", best.loads.stroke))
    return [
        (f"{name} {tendon + 1} {unit}", table[:, tendon])
        for name, unit, table in columns
        for tendon in range(table.shape[1])
        if np.isfinite(table[:, tendon]).any()
    ]
