"""Runs a sweep, or what is left of it."""

from __future__ import annotations

import contextlib
import os
from collections.abc import Callable, Generator, Iterable, Iterator, Mapping
from pathlib import Path
from typing import Any

from threadpoolctl import threadpool_limits

from notchflex._extras import need
from notchflex.errors import ErrorCode, InputError
from notchflex.loads.validation import check_integer, short_repr
from notchflex.robot import Robot, load_robot
from notchflex.sweeping.engine.connection import check_address, local_cluster, scheduler_at
from notchflex.sweeping.engine.folder import (
    check_target,
    done_piece,
    locked,
    prepare_folder,
    tidy,
)
from notchflex.sweeping.engine.manifest import Manifest
from notchflex.sweeping.engine.piece import Done, Worker
from notchflex.sweeping.engine.running import in_threads, on_cluster
from notchflex.sweeping.model import model_of
from notchflex.sweeping.plan import SweepPlan, read_plan
from notchflex.sweeping.plan.reading import plan_from_table
from notchflex.sweeping.result import Sweep, read_sweep, write_summary

Progress = Callable[[int, int, int, int], None]
"""Called with rows done, rows in all, rows without a result, and rows done by earlier calls."""


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

    A sweep is cut into pieces, and each piece is one file. A sweep that was stopped goes on where
    it was. The files do not depend on who works on the pieces, and in which order.

    Args:
        plan: The plan, or the file that holds it; or its tables, as in the file.
        directory: The folder of the sweep; it is made if it is missing.
        workers: Number of processes of dask on this machine; threads of this process if None.
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
    need("polars", "data", "sweep")
    if workers is not None and scheduler is not None:
        raise InputError.CONFLICT("workers and a scheduler exclude each other; give one of them.")
    if workers is not None and not 1 <= check_integer(workers, "workers") <= 1024:
        raise InputError.OUT_OF_RANGE(f"workers must be 1 to 1024; got {workers}")
    if workers is not None or scheduler is not None:
        need("distributed", "cluster", "workers")
    if scheduler is not None:
        check_address(scheduler)
    first, count = check_part(part)
    chosen, robot = plan_and_robot(plan)
    inputs = [plan] if isinstance(plan, str | os.PathLike) else []
    check_target(directory, [Path(one) for one in inputs])
    # Products of matrices by several threads may have other last digits.
    with threadpool_limits(1):
        model = model_of(chosen, robot)
        manifest = Manifest.of(chosen, robot, model)
        pieces = range((first - 1) * manifest.pieces // count, first * manifest.pieces // count)
        prepare_folder(directory, manifest)
        if pieces:
            with locked(directory, pieces.start, pieces.stop):
                worker = Worker(manifest, model)
                _work_on(worker, os.path.abspath(directory), pieces, workers, scheduler, progress)
    result = read_sweep(directory)
    if result.finished:
        write_summary(result)
    return result


def _work_on(
    worker: Worker,
    folder: str,
    pieces: range,
    workers: int | None,
    scheduler: str | None,
    progress: Progress | None,
) -> None:
    """Work on those of the pieces that are not there."""
    manifest = worker.manifest
    tidy(folder, pieces.start, pieces.stop)
    found = [done_piece(folder, manifest, piece) for piece in pieces]
    there = [one for one in found if one is not None]
    left = [piece for piece, one in zip(pieces, found, strict=True) if one is None]
    try:
        with _running(worker, folder, left, workers, scheduler) as running:
            _watch(running, there, manifest, pieces, progress)
    except InputError as problem:
        if problem.code is not ErrorCode.FILE_UNWRITABLE:
            raise
        message = f"{problem} All finished pieces are kept: make room, and call again."
        raise InputError.FILE_UNWRITABLE(message) from None
    tidy(folder, pieces.start, pieces.stop)


def plan_and_robot(
    plan: SweepPlan | Mapping[str, Any] | str | os.PathLike[str],
) -> tuple[SweepPlan, Robot]:
    """Return a plan and the robot that it names.

    Raises:
        InputError: It is no plan, or its file or its robot cannot be read.
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


@contextlib.contextmanager
def _running(
    worker: Worker, folder: str, pieces: list[int], workers: int | None, scheduler: str | None
) -> Generator[Iterator[Done]]:
    """Work on pieces; yields what becomes of them, as they are finished."""
    if not pieces:
        yield iter(())
    elif workers is None and scheduler is None:
        assert worker.scales  # in the calling thread: all threads need the same preparations
        assert worker.model.chains
        with contextlib.closing(in_threads(worker, folder, pieces)) as running:
            yield running
    else:
        cluster = local_cluster(workers) if workers else scheduler_at(scheduler or "")
        text = worker.manifest.text
        with (
            cluster as client,
            contextlib.closing(on_cluster(client, text, folder, pieces)) as running,
        ):
            yield running


def _watch(
    running: Iterable[Done],
    there: list[Done],
    manifest: Manifest,
    pieces: range,
    progress: Progress | None,
) -> None:
    """Count what is done."""
    before = done = sum(one.rows for one in there)
    unsolved = sum(one.unsolved for one in there)
    total = manifest.between(pieces.stop - 1)[1] - manifest.between(pieces.start)[0]
    for one in running:
        done, unsolved = done + one.rows, unsolved + one.unsolved
        if progress is not None:
            progress(done, total, unsolved, before)
