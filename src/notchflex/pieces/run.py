"""Runs the pieces of a task that are not in its folder: by threads, processes or dask."""

from __future__ import annotations

import contextlib
import logging
import multiprocessing
import os
import pickle
import re
import threading
from collections.abc import Callable, Generator, Iterable
from concurrent.futures import (
    FIRST_COMPLETED,
    CancelledError,
    Executor,
    Future,
    ProcessPoolExecutor,
    wait,
)
from concurrent.futures.process import BrokenProcessPool
from dataclasses import dataclass
from functools import lru_cache, partial
from itertools import islice
from typing import Any, TypeVar

from threadpoolctl import threadpool_limits

from notchflex import ErrorCode, InputError
from notchflex.pieces.folder import (
    PieceTask,
    check_target,
    locked,
    open_folder,
    stored_piece,
    versions,
    write_piece,
)
from notchflex.specification import whole
from notchflex.support import AnyPath, check_is_path, need, on_cores

T = TypeVar("T")

Progress = Callable[[int, int, int, int], None]
"""Called with rows done, rows in all, rows without a result, and rows done by earlier calls."""

_Work = Callable[[int], tuple[int, int]]
"""Works out a piece; returns its number, and its rows without a result."""

_KEPT = "finished pieces are kept; the same call goes on"
"""What an interruption says."""

_AHEAD = 2
"""Pieces that wait for each worker, so that none is idle."""

_TRIES = 20
"""Lost processes after which the work is given up."""

_CONNECT, _WAIT, _CLOSE = 20.0, 60.0, 10.0
"""Seconds to wait for a scheduler, for its first worker, and for the end of a connection."""

_BEAT, _ANSWER, _ALONE = 1.0, 20.0, 30.0
"""Seconds to wait for a piece before the scheduler is asked for its workers, for the answer, and
for new workers where all are lost."""


@dataclass(frozen=True)
class PieceFolder:
    """A folder that keeps the finished pieces of a long computation, and who works on them.

    The same call resumes an interrupted computation.

    Args:
        directory: The folder; it is made if it is missing.
        workers: Number of processes of this machine; threads of this process if None.
        scheduler: Address of a scheduler of dask, whose workers see the same folder.

    Raises:
        InputError: Workers or scheduler cannot be used, or an extra is missing.
    """

    directory: AnyPath
    workers: int | None = None
    scheduler: str | None = None

    def __post_init__(self) -> None:
        """Check workers and scheduler."""
        check_is_path(self.directory, "a folder")
        need("polars", "data", "pieces")
        if self.workers is not None and self.scheduler is not None:
            raise InputError.CONFLICT("workers and a scheduler exclude each other; give one.")
        if self.workers is not None:
            whole(self.workers, "workers", 1, 1024)
        if self.scheduler is not None:
            need("distributed", "cluster", "scheduler")
            if not re.fullmatch(r"(\w+://)?[^\s/]+:\d{1,5}", self.scheduler):
                raise InputError.BAD_SYNTAX(
                    f"{self.scheduler!r} is not an address of a scheduler; write it like "
                    "tcp://10.0.0.1:8786."
                )

    @classmethod
    def of(cls, folder: PieceFolder | AnyPath) -> PieceFolder:
        """Return a folder, given as one or as its path."""
        return folder if isinstance(folder, PieceFolder) else cls(folder)

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
            task: The task; it is pickled for other processes.
            pieces: The pieces; all where not given.
            cores: Number of threads; one per core where not given.
            progress: See `Progress`.

        Raises:
            InputError: The folder belongs to another task, is being written by another process, or
                takes no more files.
            KeyboardInterrupt: It was interrupted; the message says what is kept.
        """
        manifest, folder = task.manifest, os.path.abspath(self.directory)
        check_target(self.directory, manifest.kind, "--folder")
        open_folder(self.directory, manifest)
        pieces = range(manifest.pieces) if pieces is None else pieces
        if not pieces:
            return
        rows = {
            piece: stop - start for piece in pieces for start, stop in [manifest.between(piece)]
        }
        total = sum(rows.values())
        # Products of matrices by several threads may have other last digits.
        with threadpool_limits(1), locked(self.directory, pieces):
            try:
                stored = {piece: stored_piece(folder, manifest, piece) for piece in pieces}
                left = [piece for piece, lost in stored.items() if lost is None]
                before = done = total - sum(rows[piece] for piece in left)
                lost = sum(filter(None, stored.values()))
                with contextlib.closing(self._finished(task, folder, left, cores)) as finished:
                    for piece, lost_here in finished:
                        done, lost = done + rows[piece], lost + lost_here
                        if progress is not None:
                            progress(done, total, lost, before)
            except KeyboardInterrupt:
                raise KeyboardInterrupt(_KEPT) from None
            except InputError as problem:
                if problem.code is not ErrorCode.FILE_UNWRITABLE:
                    raise
                message = f"{problem} All finished pieces are kept: make room, and call again."
                raise InputError.FILE_UNWRITABLE(message) from None

    def _finished(
        self, task: PieceTask, folder: str, pieces: list[int], cores: int | None
    ) -> Generator[tuple[int, int]]:
        """Work on pieces; yield number and rows without a result of each."""
        if not pieces:
            return
        if self.workers is None and self.scheduler is None:
            yield from on_cores(partial(write_piece, task, folder), pieces, cores)
            return
        work = partial(_work, pickle.dumps(task), versions(), folder)
        if self.workers is not None:
            yield from _in_processes(self.workers, work, pieces)
        else:
            with _connected(self.scheduler or "") as client:
                yield from _on_cluster(client, work, pieces)


def _work(task: bytes, needed: dict[str, str], folder: str, piece: int) -> tuple[int, int]:
    """Work on one piece, in another process."""
    here = versions()
    for name, there in needed.items():
        if here[name] != there:
            raise InputError.CONFLICT(
                f"a worker has {name} {here[name]}, and the folder was begun with {there}, which "
                "may give other digits; give all workers the same versions."
            )
    if not os.path.isdir(folder):
        raise InputError.FILE_NOT_FOUND(
            f"a worker sees no folder {folder}; give a folder that all workers share."
        )
    with threadpool_limits(1):
        return write_piece(_task(task), folder, piece)


@lru_cache(maxsize=2)
def _task(pickled: bytes) -> PieceTask:
    """Return a task; one for a process, since what it derives takes time."""
    return pickle.loads(pickled)


def _submitted(
    executor: Executor,
    work: _Work,
    pieces: Iterable[int],
    ahead: int,
    check: Callable[[], None] = lambda: None,
) -> Generator[tuple[int, int]]:
    """Work on pieces by an executor, so many at once; `check` may raise while none is finished."""
    waiting = iter(pieces)
    running = {executor.submit(work, piece) for piece in islice(waiting, ahead)}
    while running:
        finished, running = wait(running, timeout=_BEAT, return_when=FIRST_COMPLETED)
        if not finished:
            check()
        for future in finished:
            result = future.result()
            running |= {executor.submit(work, piece) for piece in islice(waiting, 1)}
            yield result


def _in_processes(workers: int, work: _Work, pieces: list[int]) -> Generator[tuple[int, int]]:
    """Work on pieces in processes of this machine, which speak through pipes.

    A port would be open to all users of the machine, and who reaches a worker runs any code in it.
    """
    left = dict.fromkeys(pieces)
    for _ in range(_TRIES):
        spawn = multiprocessing.get_context("spawn")
        pool = ProcessPoolExecutor(workers, mp_context=spawn, initializer=_end_with_parent)
        try:
            for result in _submitted(pool, work, list(left), _AHEAD * workers):
                del left[result[0]]
                yield result
            return
        except BrokenProcessPool:  # pieces that were lost with a process are worked on again
            continue
        finally:
            pool.shutdown(cancel_futures=True)
    raise InputError.PROCESS_FAILED(
        f"the work was given up: a process was lost {_TRIES} times. All finished pieces are kept."
    )


def _end_with_parent() -> None:
    """End this process when that which started it ends, however it ends."""

    def watch() -> None:
        parent = multiprocessing.parent_process()
        if parent is not None:
            parent.join()
        os._exit(1)

    threading.Thread(target=watch, daemon=True).start()


@contextlib.contextmanager
def _connected(address: str) -> Generator[Any]:
    """Connect to a scheduler of dask.

    Raises:
        InputError: Nothing answers there, or it has no workers.
    """
    import distributed
    from distributed.utils import silence_logging_cmgr

    def connect() -> Any:
        client = distributed.Client(address, timeout=_CONNECT, set_as_default=False)
        client.wait_for_workers(1, timeout=_WAIT)
        return client

    with silence_logging_cmgr(logging.CRITICAL + 1):  # an error of ours reports the loss
        try:
            client = _within(_CONNECT + _WAIT + _CLOSE, connect)
        except (OSError, ValueError, TypeError) as problem:
            raise InputError.NO_CONNECTION(
                f"no scheduler with workers answers at {address}: {_in_words(problem)}. Start one "
                f"with `dask scheduler`, and workers with `dask worker {address}`."
            ) from None
        try:
            yield client
        finally:
            with contextlib.suppress(Exception):
                _within(_CLOSE, partial(client.close, timeout=_CLOSE / 2))


def _on_cluster(client: Any, work: _Work, pieces: Iterable[int]) -> Generator[tuple[int, int]]:
    """Work on pieces with the workers of a client of dask.

    dask may wait for ever: for a piece that is submitted while the scheduler dies, or for workers.
    """
    from distributed import KilledWorker

    stream = client.scheduler_comm
    alone = 0.0  # seconds without a worker

    def is_lost() -> bool:
        return client.status != "running" or client.scheduler_comm is not stream or stream.closed()

    def check() -> None:
        nonlocal alone
        if is_lost():
            raise OSError("the connection was closed")
        alone = 0.0 if _within(_ANSWER, client.nthreads) else alone + _BEAT
        if alone > _ALONE:
            raise OSError(f"no worker for {_ALONE:.0f} s")

    # A piece is not a pure function: its file may be gone while its result is remembered.
    executor = client.get_executor(pure=False)
    try:
        threads = sum(_within(_ANSWER, client.nthreads).values())
        yield from _submitted(executor, work, pieces, _AHEAD * max(threads, 1), check)
    except KilledWorker as problem:
        raise InputError.PROCESS_FAILED(
            f"the work was given up: {_in_words(problem)}. All finished pieces are kept."
        ) from None
    except Exception as problem:
        # dask raises errors of many types if its connection is lost in the middle of a call.
        is_expected = isinstance(problem, OSError | CancelledError) or is_lost()
        if isinstance(problem, InputError) or not is_expected:
            raise
        raise InputError.NO_CONNECTION(
            f"the scheduler or its workers are gone ({_in_words(problem)}); all finished pieces "
            "are kept: start them again, and call again."
        ) from None
    finally:
        if not is_lost():
            with contextlib.suppress(Exception):
                executor.shutdown(wait=False)


def _in_words(problem: Exception) -> str:
    silent = "no answer" if isinstance(problem, TimeoutError) else "the connection was closed"
    return " ".join(str(problem).split())[:200] or silent


def _within(seconds: float, call: Callable[[], T]) -> T:
    """Return the result of a call; a call of dask whose scheduler dies may wait for ever.

    Raises:
        TimeoutError: It takes longer.
    """
    future: Future[T] = Future()

    def work() -> None:
        try:
            future.set_result(call())
        except Exception as problem:
            future.set_exception(problem)

    threading.Thread(target=work, daemon=True).start()
    return future.result(seconds)
