"""All that is measured, one after the other, and the document that holds it."""

from __future__ import annotations

import os
import platform
from collections.abc import Callable, Sequence
from dataclasses import asdict, replace
from datetime import date
from typing import Any

from notchflex import __version__
from notchflex._jax import jax
from notchflex.bench.cases import CASES, Case
from notchflex.bench.clock import Clock, Row
from notchflex.bench.peers import MEASURED, PEERS
from notchflex.bench.processes import PROCESSES, Process
from notchflex.errors import InputError

_MICROSECONDS = 1e6


def measured(only: str | None = None, told: Callable[[str], None] | None = None) -> list[Row]:
    """Measure everything, or what has a text in its name and what that is compared with.

    Args:
        only: The text; everything where not given.
        told: Called with the name of what is measured next.

    Raises:
        InputError: Nothing has that text in its name.
    """
    every: tuple[Case | Process, ...] = (*CASES, *PROCESSES)
    wanted = {one.name for one in every if only is None or only.lower() in one.name.lower()}
    if not wanted:
        names = "; ".join(one.name for one in every)
        raise InputError.UNKNOWN_NAME(
            f"nothing that is timed has `{only}` in its name; there are: {names}"
        )
    wanted |= {case.of for case in CASES if case.name in wanted}
    clock = Clock()
    rows: dict[str, Row] = {}
    runs: dict[str, Callable[[], object]] = {}
    for one in every:
        if one.name not in wanted:
            continue
        if told is not None:
            told(one.name)
        if isinstance(one, Process):
            rows[one.name] = _process(one, clock)
        else:
            runs[one.name] = one.make()
            rows[one.name] = _case(one, clock, rows, runs)
    return list(rows.values())


def _case(
    case: Case, clock: Clock, rows: dict[str, Row], runs: dict[str, Callable[[], object]]
) -> Row:
    run = runs[case.name]
    run()
    row, times = clock.time(case.name, run, case.per, case.target, runs.get(case.of))
    if not case.of or case.target is None:
        return row
    base = rows[case.of]
    assert base.lu135 is not None
    note = f"{times:.2f} times '{case.of}'; target {case.target:.3g} times"
    return replace(row, target=case.target * base.lu135, note=note)


def _process(process: Process, clock: Clock) -> Row:
    try:
        value = process.measure()
    except InputError as problem:  # what has been measured so far must not be lost
        return Row(process.name, None, None, None, str(problem))
    note = f"{value:.3g} {process.unit}; target {process.target:.4g} {process.unit}"
    if process.unit != "s":
        return Row(process.name, None, None, None, note)
    unit = clock.lu135() / _MICROSECONDS
    return Row(process.name, value * _MICROSECONDS, value / unit, process.target / unit, note)


def bench_document(rows: Sequence[Row]) -> dict[str, Any]:
    """Rows, the machine they were taken on, and the figures of others, for `--json`."""
    return {
        "notchflex": __version__,
        "date": date.today().isoformat(),
        "machine": {
            "processor": platform.processor() or platform.machine(),
            "cores": os.cpu_count(),
            "python": platform.python_version(),
            "jax": jax.__version__,
            "backend": jax.default_backend(),
        },
        "unit": "lu135: multiples of numpy.linalg.solve of 135 equations on one core, same run",
        "rows": [asdict(row) for row in rows],
        "peers": {"source": MEASURED, "rows": [asdict(peer) for peer in PEERS]},
    }
