"""`notchflex bench`."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated

from cyclopts import Parameter
from rich.table import Table

from notchflex.cli import terminal
from notchflex.cli.arguments.options import JsonFile, Quiet
from notchflex.results.files.writing import STANDARD_OUTPUT, check_output

if TYPE_CHECKING:
    from notchflex.bench import Row

Only = Annotated[
    str | None,
    Parameter(help="Time only what has this text in its name, such as `wrist`."),
]


def bench(*, only: Only = None, json: JsonFile = None, quiet: Quiet = False) -> None:
    """Time the solver on this machine.

    Times are medians in multiples of LU135, one solution of 135 linear equations by NumPy on one
    core in the same run. All of it takes some minutes, on a machine that should do nothing else.
    """
    terminal.be_quiet(quiet)
    if json is not None:
        check_output(json, "--json")
    with terminal.progress("timing") as told:
        from notchflex.bench import bench_document, measured
        from notchflex.cli.compile_cache import use_compile_cache
        from notchflex.results.files.json import write_json

        use_compile_cache()
        rows = measured(only, told)
    if json is not None:
        write_json(json, bench_document(rows))
    if json != STANDARD_OUTPUT and not quiet:
        _print(rows)


def _print(rows: list[Row]) -> None:
    from notchflex.bench import MEASURED, PEERS

    console = terminal.output()
    table = Table(box=None, padding=(0, 2, 0, 0), header_style="bold")
    table.add_column("what", style="cyan")
    for name in ("time", "LU135", "target"):
        table.add_column(name, justify="right", no_wrap=True)
    for row in rows:
        table.add_row(row.name, _time(row.us), _multiple(row.lu135), _multiple(row.target))
        if row.note:
            table.add_row(f"  {row.note}", "", "", "")
    console.print(table)
    others = Table(box=None, padding=(0, 2, 0, 0), header_style="bold")
    others.add_column("others", style="cyan")
    others.add_column("what")
    others.add_column("time", justify="right", no_wrap=True)
    for peer in PEERS:
        span = [_time(1e3 * ms) for ms in dict.fromkeys(peer.ms)]
        others.add_row(peer.name, peer.what, " to ".join(span))
    console.print()
    console.print(others)
    console.print(f"Others: {MEASURED}.")


def _time(us: float | None) -> str:
    if us is None:
        return ""
    for unit, size in (("s", 1e6), ("ms", 1e3)):
        if us >= size:
            return f"{us / size:.3g} {unit}"
    return f"{us:.3g} us"


def _multiple(value: float | None) -> str:
    return "" if value is None else f"{value:.3g}"
