"""Tables of `notchflex sweep`."""

from __future__ import annotations

from typing import TYPE_CHECKING

from notchflex.cli import terminal

if TYPE_CHECKING:
    from notchflex.sweeping import Estimate, Sweep


def duration(seconds: float) -> str:
    """Return a time in words: seconds, minutes, hours or days.

    Example:
        >>> duration(90.0), duration(7200.0)
        ('1.5 min', '2.0 h')
    """
    for size, unit in ((86400.0, "days"), (3600.0, "h"), (60.0, "min")):
        if seconds >= size:
            return f"{seconds / size:.1f} {unit}"
    return f"{seconds:.1f} s"


def size_in_words(size: float) -> str:
    """Return a number of bytes in words.

    Example:
        >>> size_in_words(2.5e9)
        '2.5 GB'
    """
    for scale, unit in ((1e12, "TB"), (1e9, "GB"), (1e6, "MB"), (1e3, "kB")):
        if size >= scale:
            return f"{size / scale:.3g} {unit}"
    return f"{size:.0f} bytes"


def print_estimate(expected: Estimate) -> None:
    """Print what a sweep will take."""
    with_workers = f"{expected.workers} core{'s' * (expected.workers != 1)}"
    rows = [
        ("rows", f"{expected.rows}"),
        ("pieces", f"{expected.pieces} of {expected.piece_rows} rows"),
        ("time", f"about {duration(expected.seconds)} on {with_workers}"),
        ("one row", f"{1e6 * expected.row_seconds:.3g} µs on one core"),
        (
            "files",
            f"about {size_in_words(expected.bytes)}; {size_in_words(expected.free)} are free",
        ),
        ("without a result", f"{expected.unsolved} of {expected.solved} rows that were solved"),
    ]
    terminal.output().print(terminal.table(("", ""), rows, gap=2))


_USUAL = [0.0, 0.025, 0.25, 0.5, 0.75, 0.975, 1.0]
_MAX_COLUMNS = 9
"""Quantiles that a table shows at most."""


def print_sweep(sweep: Sweep) -> None:
    """Print counts, and quantiles of every kept quantity: as many as fit beside its name."""
    console = terminal.output(terminal.width())
    counts = ", ".join(f"{count} {code}" for code, count in sweep.counts.items() if count)
    state = "" if sweep.finished else f" of {sweep.manifest.rows}, {len(sweep.pieces)} of "
    state += "" if sweep.finished else f"{sweep.manifest.pieces} pieces"
    console.print(f"{sweep.plan.name}: {sweep.rows} rows{state}; {counts or 'none'}")
    if not sweep.rows:
        return
    console.print(terminal.table(*_fitting(sweep, console.width), gap=2))


def _fitting(sweep: Sweep, width: int) -> tuple[list[str], list[tuple[str, ...]]]:
    """Return heads and cells with as many quantiles as fit into a width, at least the extremes."""
    parts = sorted({0.0, 1.0, *sweep.plan.output.quantiles})
    for shown in (parts, _USUAL, [0.0, 0.025, 0.5, 0.975, 1.0], [0.0, 0.5, 1.0]):
        table = _quantiles(sweep, shown)
        sizes = [max(map(len, column)) for column in zip(table[0], *table[1], strict=True)]
        if len(shown) <= _MAX_COLUMNS and sum(sizes) + 2 * (len(sizes) - 1) <= width:
            return table
    return _quantiles(sweep, [0.0, 1.0])


def _quantiles(sweep: Sweep, shown: list[float]) -> tuple[list[str], list[tuple[str, ...]]]:
    """Return heads and cells of a table of quantiles."""
    names = {0.0: ">smallest", 1.0: ">largest", 0.5: ">median"}
    heads = ["quantity", *(names.get(part, f">{100 * part:g} %") for part in shown)]
    rows = [
        (name, *(f"{value:.5g}" for value in sweep.quantiles(name, shown)))
        for name in sweep.columns
    ]
    return heads, rows
