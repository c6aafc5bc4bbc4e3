"""Runs a sweep, or what is left of it; estimates before it starts."""

from __future__ import annotations

import os
import shutil
import time
from collections.abc import Mapping
from pathlib import Path
from typing import Any, NamedTuple

from threadpoolctl import threadpool_limits

from notchflex import InputError, Robot, load_robot
from notchflex.pieces.folder import FAILED, check_target, encoded
from notchflex.pieces.run import Progress, check_workers, open_folder, run_pieces
from notchflex.support import check_integer, need, number_of_cores, short_repr
from notchflex.sweeping.plan import SweepPlan, plan_from_table, read_plan
from notchflex.sweeping.result import KIND, Sweep, SweepManifest, read_sweep, write_summary
from notchflex.sweeping.rows import model_of
from notchflex.sweeping.worker import SweepWorker


def sweep(
    plan: SweepPlan | Mapping[str, Any] | str | os.PathLike[str],
    directory: str | os.PathLike[str],
    *,
    workers: int | None = None,
    scheduler: str | None = None,
    part: tuple[int, int] = (1, 1),
    progress: Progress | None = None,
) -> Sweep:
    """Solve many robots that differ by a few numbers, and keep the results as files.

    A sweep is cut into pieces, and each piece is one file. A sweep that was stopped resumes where
    it was. The files do not depend on who works on the pieces, and in which order.

    Args:
        plan: The plan, or the file that holds it; or its tables, as in the file.
        directory: The folder of the sweep; it is made if it is missing.
        workers: Number of processes of this machine; threads of this process if None.
        scheduler: Address of a scheduler of dask, whose workers see the same folder.
        part: Only this part of the pieces, such as (7, 100): the seventh of a hundred.
        progress: Called with rows done, rows in all, rows without a result, and rows done by
            earlier calls.

    Returns:
        The sweep, as `read_sweep` reads it.

    Raises:
        InputError: The plan cannot be used, or the folder holds another sweep, is being written by
            another process, or takes no more files.

    Example:
        >>> import tempfile
        >>> import notchflex as nf
        >>> table = {
        ...     "robot": "pacheco2021-a",
        ...     "variable": [{"value": "notch.depth", "lower": 1.36, "upper": 1.42, "count": 7}],
        ...     "load": {"pulled": {"tension": 1.0}},
        ...     "keep": [{"quantity": "total_angle"}],
        ... }
        >>> with tempfile.TemporaryDirectory() as folder:
        ...     nf.sweep(table, folder).rows
        7
    """
    check_workers(workers, scheduler)
    first, count = check_part(part)
    chosen, robot = plan_and_robot(plan)
    inputs = [Path(plan)] if isinstance(plan, str | os.PathLike) else []
    check_target(directory, KIND, "-o", inputs)
    with threadpool_limits(1):  # more threads may give other last digits
        model = model_of(chosen, robot)
        worker = SweepWorker(SweepManifest.of(chosen, robot, model), model)
    open_folder(worker, directory, "-o", inputs)
    number = worker.manifest.pieces
    run_pieces(
        worker,
        directory,
        pieces=range((first - 1) * number // count, first * number // count),
        workers=workers,
        scheduler=scheduler,
        progress=progress,
    )
    result = read_sweep(directory)
    if result.finished:
        write_summary(result)
    return result


def plan_and_robot(
    plan: SweepPlan | Mapping[str, Any] | str | os.PathLike[str],
) -> tuple[SweepPlan, Robot]:
    """Return a plan and the robot that it names.

    Raises:
        InputError: It is not a plan, or its file or its robot cannot be read.
    """
    if isinstance(plan, Mapping):
        plan = plan_from_table(plan)
    if isinstance(plan, SweepPlan):
        return plan, load_robot(plan.robot)
    if not isinstance(plan, str | os.PathLike):  # pyright: ignore[reportUnnecessaryIsInstance]
        raise InputError.WRONG_TYPE(
            f"a notchflex.SweepPlan is needed, or the path of a file; got {short_repr(plan)}"
        )
    return read_plan(plan)


def check_part(part: tuple[int, int]) -> tuple[int, int]:
    """Return which part of how many, checked.

    Raises:
        InputError: They are not two whole numbers, or not 1 <= part <= parts.
    """
    if not isinstance(part, tuple) or len(part) != 2:  # pyright: ignore[reportUnnecessaryIsInstance]
        raise InputError.WRONG_TYPE(f"part must be two numbers, such as (7, 100); got {part!r}")
    first, count = (check_integer(one, "part") for one in part)
    if not 1 <= first <= count <= 10**9:
        raise InputError.OUT_OF_RANGE(f"part {first} of {count}: give one from 1 to {count}.")
    return first, count


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
        sum(head["codes"][FAILED:]),
    )  # fmt: skip
