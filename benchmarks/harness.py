"""What benchmarks share: the command line, numbered trials, processor time, coverage, a table."""

from __future__ import annotations

import argparse
import json
import time
from collections.abc import Callable, Iterable, Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np
from rich import box
from rich.console import Console
from rich.table import Table


def options(doc: str, cases: Iterable[str] = (), **defaults: Any) -> argparse.Namespace:
    """Read the command line: which cases (all, if none is named), and options by their defaults.

    A default that is a type stands for an argument that is required.
    """
    parser = argparse.ArgumentParser(
        description=doc, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    for name, default in defaults.items():
        if isinstance(default, type):
            parser.add_argument(name, type=default)
        else:
            parser.add_argument(f"--{name}", type=type(default), default=default)
    parser.add_argument("--json", type=Path, help="file for the results, one line of JSON each")
    names = list(cases)
    if names:
        parser.add_argument("cases", nargs="*", help=", ".join(names))
    chosen = parser.parse_args()
    if names:
        chosen.cases = chosen.cases or names
        if unknown := set(chosen.cases) - set(names):
            parser.error(f"no case {', '.join(unknown)}; there are {', '.join(names)}")
    return chosen


def trials(
    make: Callable[[int], dict[str, Any]], chosen: argparse.Namespace, case: str = ""
) -> Iterator[dict[str, Any]]:
    """Make numbered trials; those that the file of results holds already are read from it.

    Args:
        make: Makes the trial of a number.
        chosen: Options `count` and `json`, and, if there are any, `first` and `part` (I/N: every
            Nth trial from the Ith).
        case: What the trials of one file are told apart by.
    """
    first = getattr(chosen, "first", 0)
    part, parts = map(int, getattr(chosen, "part", "0/1").split("/"))
    stored = {(row.get("case"), row.get("number")): row for row in read_rows(chosen.json)}
    for number in range(first + part, first + chosen.count, parts):
        row = stored.get((case, number))
        if row is None:
            with timed() as seconds:
                made = make(number)
            row = {"case": case, "number": number, "seconds": seconds["cpu"]} | made
            keep(row, chosen)
        yield row


def read_rows(file: Path | None) -> list[dict[str, Any]]:
    """Read a file of results; none if there is no such file."""
    lines = file.read_text(encoding="utf-8").splitlines() if file and file.exists() else []
    return [json.loads(line) for line in lines]


def keep(row: Mapping[str, Any], chosen: argparse.Namespace) -> None:
    """Append a result to the file of results, if there is to be one."""
    if chosen.json:
        with chosen.json.open("a", encoding="utf-8") as file:
            file.write(json.dumps(row, default=_plain) + "\n")


def _plain(value: Any) -> Any:
    return np.asarray(value).tolist()


@contextmanager
def timed() -> Iterator[dict[str, float]]:
    """Measure processor time (`cpu`) and the time of a clock (`wall`), s."""
    seconds: dict[str, float] = {}
    cpu, wall = time.process_time(), time.perf_counter()
    yield seconds
    seconds |= {"cpu": time.process_time() - cpu, "wall": time.perf_counter() - wall}


def share(holds: Any) -> str:
    """Return in how many of 100 cases something holds, with the binomial standard error."""
    holds = np.ravel(np.asarray(holds, float))
    if not holds.size:
        return "-"
    part = holds.mean()
    return f"{100 * part:.1f} ± {100 * np.sqrt(part * (1 - part) / holds.size):.1f} %"


def rms(errors: Any) -> float:
    """Return the root mean square."""
    return float(np.sqrt(np.mean(np.square(errors))))


def show(rows: Iterable[Mapping[str, Any]], title: str = "") -> None:
    """Print rows with the same keys as one table; floats with four digits."""
    rows = list(rows)
    if not rows:
        return
    table = Table(title=title, title_justify="left", box=box.SIMPLE_HEAD)
    for head in rows[0]:
        table.add_column(head, justify="left" if head == next(iter(rows[0])) else "right")
    for row in rows:
        cells = (f"{one:.4g}" if isinstance(one, float) else str(one) for one in row.values())
        table.add_row(*cells)
    Console(width=200, highlight=False, markup=False).print(table)
