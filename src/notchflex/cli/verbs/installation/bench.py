"""`notchflex bench`."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated

from cyclopts import Parameter

from notchflex.cli import terminal
from notchflex.cli.outputs import JsonFile, Outputs, Quiet

if TYPE_CHECKING:
    from notchflex.bench import BenchRow


def bench(
    *,
    only: Annotated[
        str | None,
        Parameter(metavar="TEXT", help="Time only cases with this text in their name: `wrist`."),
    ] = None,
    json: JsonFile = None,
    quiet: Quiet = False,
) -> None:
    """Time the solver on this machine.

    Times are medians in multiples of LU135, one solution of 135 linear equations by NumPy on one
    core in the same run. All cases take some minutes, on a machine that should be otherwise idle.
    """
    outputs = Outputs(quiet=quiet, json=json)
    with terminal.working("timing") as progress:
        from notchflex.bench import bench_document, measured

        terminal.use_compile_cache()
        rows = measured(only, progress)
    outputs.write_json(lambda: bench_document(rows))
    if outputs.prints_tables:
        _print(rows)


def _print(rows: list[BenchRow]) -> None:
    from notchflex.bench import MEASURED, PEERS

    console = terminal.output()
    cells: list[list[str]] = []
    for row in rows:
        cells.append([row.name, _time(row.us), _multiple(row.lu135), _multiple(row.target)])
        cells += [[f"  {row.note}"]] if row.note else []
    heads = ["what", ">time", ">LU135", ">target"]
    console.print(terminal.table(heads, cells, gap=2, colour="cyan"))
    console.print()
    peers = [
        [name, what, " to ".join(_time(1e3 * one) for one in dict.fromkeys(ms))]
        for name, what, ms in PEERS
    ]
    console.print(terminal.table(["others", "what", ">time"], peers, gap=2, colour="cyan"))
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
