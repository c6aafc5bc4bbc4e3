"""Throughput of sweeps beside the bare batch, and their memory, for growing numbers of rows.

    python benchmarks/sweeps.py [--rows 1e7] [--workers 2]

A row is a wrist with two variables, a code and two quantities. The bare batch solves the same
wrists in pieces of 1e6 and keeps nothing. The time is that of processors, of the workers too. The
folder of results (32 bytes a row at most) is deleted after each size; `TMPDIR` says where it is.
What kills of processes leave is tested by `tests/sweeping/test_workers.py`.
"""

from __future__ import annotations

import os
import resource
import tempfile
from pathlib import Path

from harness import options, show

import notchflex as nf
from notchflex.sweeping.sweep import numbers_between

OUTPUTS = ("total_angle", "tip_position", "converged")
CHUNK = 1_000_000


def plan(rows: int) -> nf.SweepPlan:
    """Return the plan: depth and height of the notches of wrist A, under 1 N."""
    return nf.SweepPlan(
        robot="pacheco2021-a",
        variable=[
            {"value": "notch.depth", "lower": 1.36, "upper": 1.42},
            {"value": "notch.height", "lower": 0.8, "upper": 1.2},
        ],
        sampling={"points": rows},
        load={"pulled": {"tension": 1.0}},
        keep=[{"quantity": "total_angle"}, {"quantity": "tip_position", "axis": "x"}],
    )


def spent() -> float:
    """Return the processor time of this process and of its children that have ended, s."""
    both = map(resource.getrusage, (resource.RUSAGE_SELF, resource.RUSAGE_CHILDREN))
    return sum(usage.ru_utime + usage.ru_stime for usage in both)


def bare(cores: int) -> float:
    """Return the time of the batch alone for a row, s; the first batch compiles."""
    robot, numbers = nf.load_robot("pacheco2021-a"), numbers_between(plan(CHUNK), 0, CHUNK)
    for _ in range(2):
        begin = spent()
        nf.batch(robot, numbers, nf.Load(tension=1.0), outputs=OUTPUTS, cores=cores)
    return (spent() - begin) / CHUNK


def sweep(rows: int, workers: int, of_bare: float) -> dict[str, object]:
    """Sweep so many rows."""
    begin = spent()
    with tempfile.TemporaryDirectory() as folder:
        nf.sweep(plan(rows), folder, workers=workers)
        disk = sum(file.stat().st_size for file in Path(folder).rglob("*") if file.is_file())
    each = (spent() - begin) / rows
    return {
        "rows": f"{rows:.0e}",
        "us a row": 1e6 * each,
        "of the bare throughput": of_bare / each,
        "MiB of a worker": resource.getrusage(resource.RUSAGE_CHILDREN).ru_maxrss / 1024,
        "bytes a row": disk / rows,
    }


if __name__ == "__main__":
    os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
    chosen = options(__doc__, rows=1e7, workers=2)
    alone = bare(chosen.workers)
    sizes = [CHUNK * 10**power for power in range(4) if CHUNK * 10**power < chosen.rows]
    show(sweep(size, chosen.workers, alone) for size in [*sizes, int(chosen.rows)])
