"""Estimate of a sweep before it starts: rows, time and bytes, from a timed sample."""

from __future__ import annotations

import os
import shutil
import time
from typing import NamedTuple

from notchflex._extras import need
from notchflex.pieces.codes import FAILED
from notchflex.pieces.piece import encoded
from notchflex.solver.programs.threads import number_of_cores
from notchflex.sweeping.manifest import SweepManifest
from notchflex.sweeping.model import model_of
from notchflex.sweeping.plan import SweepPlan
from notchflex.sweeping.sweep import plan_and_robot
from notchflex.sweeping.worker import SweepWorker

_LONG = 1.0
"""Seconds: a shorter piece is timed once more, without what the first one prepares."""


class Estimate(NamedTuple):
    """Estimated size and time of a sweep.

    Attributes:
        rows: Its rows.
        pieces: Its pieces.
        piece_rows: Rows of a piece.
        workers: Threads or processes.
        row_seconds: Time of one row on one core, s.
        seconds: Time of the sweep, s.
        bytes: Size of its files.
        free: Free space where the sweep would be written from, in bytes.
        solved: Rows that were solved for this.
        unsolved: How many of them have no result.
        one_by_one: Whether robots are assembled one by one, which takes long.
    """

    rows: int
    pieces: int
    piece_rows: int
    workers: int
    row_seconds: float
    seconds: float
    bytes: float
    free: int
    solved: int
    unsolved: int
    one_by_one: bool


def estimate(plan: SweepPlan | str | os.PathLike[str], *, workers: int | None = None) -> Estimate:
    """Solve the first piece of a sweep, and estimate its whole time and size; nothing is written.

    Args:
        plan: The plan, or the file that holds it.
        workers: As for `sweep`.
    """
    need("polars", "data", "sweep")
    chosen, robot = plan_and_robot(plan)
    model = model_of(chosen, robot)
    manifest = SweepManifest.of(chosen, robot, model)
    worker = SweepWorker(manifest, model)
    worker.prepare()
    start = time.perf_counter()
    data, head = encoded(worker, 0)
    taken = time.perf_counter() - start
    if taken < _LONG:
        start = time.perf_counter()
        data, head = encoded(worker, 0)
        taken = time.perf_counter() - start
    solved = manifest.between(0)[1]
    cores = min(workers or number_of_cores(), manifest.pieces)
    each = taken / solved
    size = len(data) * (manifest.rows / solved if chosen.output.rows else manifest.pieces)
    return Estimate(
        manifest.rows, manifest.pieces, manifest.document["piece"], cores, each,
        each * manifest.rows / cores, size, shutil.disk_usage(".").free, solved,
        sum(head["codes"][FAILED:]), model.one_by_one,
    )  # fmt: skip
