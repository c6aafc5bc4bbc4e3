"""Runs the pieces of a task, or those of them that are not there yet."""

from __future__ import annotations

import contextlib
import os
from collections.abc import Callable, Generator, Iterable, Iterator
from pathlib import Path

from threadpoolctl import threadpool_limits

from notchflex._extras import need
from notchflex.errors import ErrorCode, InputError
from notchflex.loads.validation import check_integer
from notchflex.pieces.connection import check_address, local_cluster, scheduler_at
from notchflex.pieces.folder import check_target, done_piece, locked, prepare_folder, tidy
from notchflex.pieces.manifest import Manifest
from notchflex.pieces.piece import Done, PieceTask
from notchflex.pieces.running import in_threads, on_cluster

Progress = Callable[[int, int, int, int], None]
"""Called with rows done, rows in all, rows without a result, and rows done by earlier calls."""


def check_workers(workers: int | None, scheduler: str | None) -> None:
    """Raise unless pieces can be worked on as asked for.

    Args:
        workers: Number of processes of dask on this machine; threads of this process if None.
        scheduler: Address of a scheduler of dask.

    Raises:
        InputError: Both are given, one of them is none, or an extra is missing.
    """
    need("polars", "data", "pieces")
    if workers is not None and scheduler is not None:
        raise InputError.CONFLICT("workers and a scheduler exclude each other; give one of them.")
    if workers is not None and not 1 <= check_integer(workers, "workers") <= 1024:
        raise InputError.OUT_OF_RANGE(f"workers must be 1 to 1024; got {workers}")
    if workers is not None or scheduler is not None:
        need("distributed", "cluster", "workers")
    if scheduler is not None:
        check_address(scheduler)


def open_folder(
    task: PieceTask,
    folder: str | os.PathLike[str],
    option: str,
    inputs: Iterable[str | Path] = (),
) -> None:
    """Make the folder of a task, or check that it is that of this one.

    Args:
        task: The task.
        folder: The folder.
        option: What messages call the folder.
        inputs: Files that are read.

    Raises:
        InputError: It holds something else, or cannot be written.
    """
    check_target(folder, task.manifest.kind, option, inputs)
    prepare_folder(folder, task.manifest)


def run_pieces(
    task: PieceTask,
    folder: str | os.PathLike[str],
    *,
    pieces: range | None = None,
    workers: int | None = None,
    scheduler: str | None = None,
    cores: int | None = None,
    progress: Progress | None = None,
) -> None:
    """Work on those of the pieces that are not there.

    Args:
        task: The task.
        folder: Its folder, opened.
        pieces: The pieces; all where not given.
        workers: Number of processes of dask on this machine; threads of this process if None.
        scheduler: Address of a scheduler of dask, whose workers see the same folder.
        cores: Number of threads; one per core where not given.
        progress: Called with rows done, rows in all, rows without a result, and rows done by
            earlier calls.

    Raises:
        InputError: The folder is being written by another process, or takes no more files.
    """
    manifest = task.manifest
    pieces = range(manifest.pieces) if pieces is None else pieces
    if not pieces:
        return
    # Products of matrices by several threads may have other last digits.
    with threadpool_limits(1), locked(folder, pieces.start, pieces.stop):
        tidy(folder, manifest.kind, pieces.start, pieces.stop)
        stored = [done_piece(folder, manifest, piece) for piece in pieces]
        finished = [one for one in stored if one is not None]
        left = [piece for piece, one in zip(pieces, stored, strict=True) if one is None]
        absolute = os.path.abspath(folder)
        try:
            with _running(task, absolute, left, workers, scheduler, cores) as running:
                _watch(running, finished, manifest, pieces, progress)
        except InputError as problem:
            if problem.code is not ErrorCode.FILE_UNWRITABLE:
                raise
            message = f"{problem} All finished pieces are kept: make room, and call again."
            raise InputError.FILE_UNWRITABLE(message) from None
        tidy(folder, manifest.kind, pieces.start, pieces.stop)


@contextlib.contextmanager
def _running(
    task: PieceTask,
    folder: str,
    pieces: list[int],
    workers: int | None,
    scheduler: str | None,
    cores: int | None,
) -> Generator[Iterator[Done]]:
    """Work on pieces; yields what becomes of them, as they are finished."""
    if not pieces:
        yield iter(())
    elif workers is None and scheduler is None:
        task.prepare()  # in the calling thread: all threads need the same preparations
        with contextlib.closing(in_threads(task, folder, pieces, cores)) as running:
            yield running
    else:
        cluster = local_cluster(workers) if workers else scheduler_at(scheduler or "")
        with (
            cluster as client,
            contextlib.closing(on_cluster(client, task, folder, pieces)) as running,
        ):
            yield running


def _watch(
    running: Iterable[Done],
    finished: list[Done],
    manifest: Manifest,
    pieces: range,
    progress: Progress | None,
) -> None:
    """Count what is done."""
    before = done = sum(one.rows for one in finished)
    unsolved = sum(one.unsolved for one in finished)
    total = manifest.between(pieces.stop - 1)[1] - manifest.between(pieces.start)[0]
    for one in running:
        done, unsolved = done + one.rows, unsolved + one.unsolved
        if progress is not None:
            progress(done, total, unsolved, before)
