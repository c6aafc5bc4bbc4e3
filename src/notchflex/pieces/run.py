"""Runs the pieces of a task, or those of them that are not there yet."""

from __future__ import annotations

import contextlib
import os
from collections.abc import Callable, Generator, Iterable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Self

from threadpoolctl import threadpool_limits

from notchflex import ErrorCode, InputError
from notchflex.pieces.folder import (
    Done,
    Manifest,
    PieceTask,
    check_target,
    done_piece,
    locked,
    prepare_folder,
)
from notchflex.pieces.running import (
    check_address,
    in_processes,
    in_threads,
    on_cluster,
    scheduler_at,
)
from notchflex.support import check_integer, need, short_repr

Progress = Callable[[int, int, int, int], None]
"""Called with rows done, rows in all, rows without a result, and rows done by earlier calls."""


def check_workers(workers: int | None, scheduler: str | None) -> None:
    """Raise unless pieces can be worked on as asked for.

    Args:
        workers: Number of processes of this machine; threads of this process if None.
        scheduler: Address of a scheduler of dask.

    Raises:
        InputError: Both are given, one of them is none, or an extra is missing.
    """
    need("polars", "data", "pieces")
    if workers is not None and scheduler is not None:
        raise InputError.CONFLICT("workers and a scheduler exclude each other; give one of them.")
    if workers is not None and not 1 <= check_integer(workers, "workers") <= 1024:
        raise InputError.OUT_OF_RANGE(f"workers must be 1 to 1024; got {workers}")
    if scheduler is not None:
        need("distributed", "cluster", "scheduler")
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
        workers: Number of processes of this machine; threads of this process if None.
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
    elif workers is not None:
        with contextlib.closing(in_processes(workers, task, folder, pieces)) as running:
            yield running
    else:
        with (
            scheduler_at(scheduler or "") as client,
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


@dataclass(frozen=True)
class PieceFolder:
    """A folder that keeps the finished pieces of a long computation, and who works on them.

    The same call resumes an interrupted computation.

    Args:
        directory: The folder; it is made if it is missing.
        workers: Number of processes of this machine; this process alone if None.
        scheduler: Address of a scheduler of dask, whose workers see the same folder.

    Raises:
        InputError: Workers or scheduler cannot be used, or an extra is missing.
    """

    directory: str | os.PathLike[str]
    workers: int | None = None
    scheduler: str | None = None

    def __post_init__(self) -> None:
        """Check workers and scheduler."""
        if not isinstance(self.directory, str | os.PathLike):  # pyright: ignore
            raise InputError.WRONG_TYPE(
                f"folder must be the path of a folder; got {short_repr(self.directory)}"
            )
        check_workers(self.workers, self.scheduler)

    @classmethod
    def of(cls, folder: PieceFolder | str | os.PathLike[str]) -> Self:
        """Return a folder, given as one or as its path."""
        return folder if isinstance(folder, cls) else cls(folder)  # pyright: ignore

    def run(
        self,
        task: PieceTask,
        *,
        pieces: range | None = None,
        cores: int | None = None,
        progress: Progress | None = None,
    ) -> None:
        """Work on those pieces of a task that are not there.

        Args:
            task: The task.
            pieces: The pieces; all where not given.
            cores: Number of threads; one per core where not given.
            progress: As for `run_pieces`.
        """
        open_folder(task, self.directory, "--folder")
        run_pieces(
            task,
            self.directory,
            pieces=pieces,
            workers=self.workers,
            scheduler=self.scheduler,
            cores=cores,
            progress=progress,
        )
