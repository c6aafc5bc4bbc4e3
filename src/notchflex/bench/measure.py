"""Timing: medians, beside the time of a reference computation measured in the same run."""

from __future__ import annotations

import os
import platform
import time
from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass
from datetime import date
from typing import Any

import numpy as np
from threadpoolctl import threadpool_limits

from notchflex import InputError, __version__
from notchflex._jax import jax
from notchflex.bench.cases import CASES, Case, Run

# Time that repeats of one case may take, s, and their least number.
_LONGEST, _FEWEST = 1.5, 5
# Rounds in which the things compared take turns: the clock of a machine changes within seconds.
_ROUNDS = 10
_UNKNOWNS = 135
_MICROSECONDS = 1e6

MEASURED = (
    "measured by the authors of notchflex in November 2026 on a 2-core AMD EPYC, one thread, CPU "
    "time per static solution, each peer's own code and example"
)

# Program, what it solves, and the times of its fastest and its slowest model [ms].
PEERS: tuple[tuple[str, str, tuple[float, float]], ...] = (
    ("tdcr-modeling (C++)", "2 segments x 10 disks, four models", (6.0, 233.0)),
    ("ContinuumRobotExamples (C++)", "tendon rod by force", (3.4, 14.5)),
    ("ContinuumRobotExamples (C++)", "tendon rod by displacement", (92.0, 92.0)),
    ("PyElastica 1.0 (numba)", "tip-loaded rod, time steps to rest", (3800.0, 7400.0)),
    ("soromox 0.2 + Newton (JAX)", "10 / 20 segments, tip load", (1.04, 4.3)),
    ("opencr-mujoco", "20 links, settling", (81.0, 81.0)),
    ("Pacheco 2021's class (Octave)", "4-5 notches, friction, superelastic", (17.0, 377.0)),
)


@dataclass(frozen=True)
class BenchRow:
    """One line of the table.

    Attributes:
        name: What was timed.
        us: Its time, microseconds; of one solve, step or call, as the name says. None where
            something else was measured, which the note gives.
        lu135: The same in multiples of one solution of 135 linear equations, timed around it.
        target: The target in the same multiples; None where there is none.
        note: Further information.
    """

    name: str
    us: float | None = None
    lu135: float | None = None
    target: float | None = None
    note: str = ""


def measured(
    only: str | None = None, progress: Callable[[str], None] = lambda name: None
) -> list[BenchRow]:
    """Measure all cases, or those with a text in their names and what these are compared with.

    `progress` is called with the name of each case before it is measured.

    Raises:
        InputError: No case has that text in its name.
    """
    wanted = {one.name for one in CASES if only is None or only.lower() in one.name.lower()}
    if not wanted:
        names = "; ".join(one.name for one in CASES)
        raise InputError.UNKNOWN_NAME(f"no case has `{only}` in its name; there are: {names}")
    wanted |= {one.of for one in CASES if one.name in wanted}
    rows: dict[str, BenchRow] = {}
    runs: dict[str, Run] = {}
    for one in (one for one in CASES if one.name in wanted):
        progress(one.name)
        if one.unit != "LU135":
            rows[one.name] = _process(one)
        else:
            runs[one.name] = one.make()
            rows[one.name] = _timed(one, rows, runs)
    return list(rows.values())


def bench_document(rows: Sequence[BenchRow]) -> dict[str, Any]:
    """Return rows, the machine they were measured on, and the figures of others, for `--json`."""
    peers = [{"name": name, "what": what, "ms": ms} for name, what, ms in PEERS]
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
        "peers": {"source": MEASURED, "rows": peers},
    }


def _process(case: Case) -> BenchRow:
    try:
        value = case.make()
    except InputError as problem:  # what has been measured so far must not be lost
        return BenchRow(case.name, note=str(problem))
    note = f"{value:.3g} {case.unit}; target {case.target:.4g} {case.unit}"
    if case.unit != "s":
        return BenchRow(case.name, note=note)
    unit = _lu135(60) / _MICROSECONDS
    target = (case.target or np.nan) / unit
    return BenchRow(case.name, value * _MICROSECONDS, value / unit, target, note)


def _timed(case: Case, rows: dict[str, BenchRow], runs: dict[str, Run]) -> BenchRow:
    """Time a case in turns with LU135, and with the case that its target is a multiple of."""
    run, other = runs[case.name], runs.get(case.of)
    run()
    started = time.perf_counter()
    run()
    once = time.perf_counter() - started
    repeats = max(_FEWEST, min(300, int(_LONGEST / max(once, 1e-6))))
    rounds = min(_ROUNDS, repeats)
    taken, unit, others = (np.full(rounds, np.nan) for _ in range(3))
    for number in range(rounds):
        unit[number] = _lu135(_FEWEST)
        taken[number] = _median(run, -(-repeats // rounds)) / case.per
        if other is not None:
            others[number] = _median(other, -(-repeats // rounds))
    us, lu135 = float(np.median(taken)), float(np.median(taken / unit))
    if other is None or case.target is None:
        return BenchRow(case.name, us, lu135, case.target)
    base = rows[case.of].lu135 or np.nan
    ratio = float(np.median(taken / others))
    note = f"{ratio:.2f} times '{case.of}'; target {case.target:.3g} times"
    return BenchRow(case.name, us, lu135, case.target * base, note)


def _lu135(repeats: int) -> float:
    """Return the median time of one solution of 135 random linear equations on one core, us.

    A robot of 27 links with five strain modes each has about as many unknowns.
    """
    random = np.random.default_rng(0)
    matrix, right = random.normal(size=(_UNKNOWNS, _UNKNOWNS)), np.ones(_UNKNOWNS)
    with threadpool_limits(1):
        return _median(lambda: np.linalg.solve(matrix, right), repeats)


def _median(run: Run, repeats: int) -> float:
    taken: list[float] = []
    for _ in range(repeats):
        started = time.perf_counter()
        run()
        taken.append(time.perf_counter() - started)
    return _MICROSECONDS * float(np.median(taken))
