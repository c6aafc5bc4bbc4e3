"""Execution of pieces by threads of this process or workers of dask, with equal results."""

from __future__ import annotations

import contextlib
import ctypes
import os
import sys
from collections import Counter
from collections.abc import Generator, Iterable
from contextlib import closing
from functools import lru_cache, partial
from itertools import islice
from queue import Empty, SimpleQueue
from typing import Any

from threadpoolctl import threadpool_limits

from notchflex.errors import InputError
from notchflex.pieces.connection import ClusterConnection, scheduler_gone
from notchflex.pieces.piece import Done, PieceTask, Recipe, make_piece, task_of
from notchflex.solver.programs.threads import number_of_cores, on_cores

_TRIM_THRESHOLD, _TOP_PAD, _MMAP_THRESHOLD = -1, -2, -3
"""Numbers of the options in <malloc.h>."""
_KEPT = 2**25
"""glibc takes no larger threshold."""
_USUAL_PAD = 2**17
"""glibc's own pad."""
_SPARE = 2**26
"""The size of a heap of a thread: glibc gives back every heap that is empty but for so much."""

_AHEAD = 2
"""So many pieces wait for each worker of dask, so that none is idle."""

_TRIES = 20
"""Largest number of lost workers for one piece."""

_BEAT, _FETCH = 1.0, 10.0
"""Seconds to wait for a piece, and for its result, until the connection is checked."""


def in_threads(
    task: PieceTask, folder: str, pieces: Iterable[int], cores: int | None = None
) -> Generator[Done]:
    """Work on pieces in threads of this process; each piece keeps to one of them.

    Until the end the C library keeps more memory than it does by itself, for all of the process.
    """
    cores = cores or number_of_cores()
    work = partial(make_piece, task, folder)
    keep_memory()
    try:
        if cores == 1:
            yield from map(work, pieces)
            return
        with closing(on_cores(work, pieces, cores)) as results:
            yield from results
    finally:
        give_memory_back()


def on_cluster(client: Any, task: PieceTask, folder: str, pieces: Iterable[int]) -> Generator[Done]:
    """Work on pieces with the workers of a client of dask.

    Args:
        client: The client.
        task: What is worked on.
        folder: Path of the folder, the same for all workers.
        pieces: Numbers of the pieces.

    Raises:
        InputError: A file cannot be written, or the scheduler or all workers are gone.
    """
    import distributed

    connection = ClusterConnection(client)
    recipe, text = task.recipe, task.manifest.text
    lost: Counter[int] = Counter()
    waiting = iter(pieces)
    running: dict[Any, int] = {}
    finished: SimpleQueue[Any] = SimpleQueue()

    def submit(numbers: Iterable[int]) -> None:
        for piece in numbers:
            # A piece is not a pure function: its file may be gone while its result is remembered.
            future = client.submit(_work, recipe, text, folder, piece, pure=False)
            running[future] = piece
            future.add_done_callback(finished.put)

    try:
        submit(islice(waiting, _AHEAD * max(connection.threads(), 1)))
        while running:
            future = _next_of(finished, connection)
            piece = running.pop(future)
            try:
                done = _result_of(future, connection)
            except distributed.KilledWorker:
                lost[piece] += 1
                if lost[piece] >= _TRIES:
                    raise InputError.PROCESS_FAILED(
                        f"piece {piece} was given up: its worker was lost {_TRIES} times."
                    ) from None
                submit([piece])
                continue
            submit(islice(waiting, 1))
            yield done
    except (distributed.CancelledError, OSError) as problem:
        raise scheduler_gone(problem) from None
    except Exception as problem:
        # dask raises errors of many types if its connection is lost in the middle of a call.
        if isinstance(problem, InputError) or not connection.lost:
            raise
        raise scheduler_gone(problem) from None
    finally:
        if not connection.lost:
            with contextlib.suppress(Exception):
                client.cancel(list(running))


def _next_of(finished: SimpleQueue[Any], connection: ClusterConnection) -> Any:
    """Wait for the next future."""
    while True:
        try:
            return finished.get(timeout=_BEAT)
        except Empty:
            connection.check()


def _result_of(future: Any, connection: ClusterConnection) -> Done:
    """Fetch the result of a future; dask asks the workers again if it was lost with one."""
    while True:
        try:
            return future.result(timeout=_FETCH)
        except TimeoutError:
            if future.status == "error":  # raised by the piece itself
                raise
            connection.check()


def _work(recipe: Recipe, text: str, folder: str, piece: int) -> Done:
    """Work on one piece, in a process of dask."""
    if not os.path.isdir(folder):
        raise InputError.FILE_NOT_FOUND(
            f"a worker sees no folder {folder}; give a folder that all workers share."
        )
    keep_memory()
    with threadpool_limits(1):
        return make_piece(task_of(recipe, text), folder, piece)


def keep_memory() -> None:
    """Let the C library keep the memory that arrays gave back, for the next ones.

    Threads give theirs back to the system at once, and so does all of a worker of dask, which sets
    MALLOC_TRIM_THRESHOLD_: a batch then spends as much time on new pages as on solving.
    """
    if (library := _c_library()) is not None:
        library.mallopt(_TRIM_THRESHOLD, _KEPT)
        library.mallopt(_MMAP_THRESHOLD, _KEPT)
        library.mallopt(_TOP_PAD, _SPARE)


def give_memory_back() -> None:
    """Give the system what `keep_memory` kept; the process is not ours alone.

    The thresholds stay where glibc takes its own to, once a program has freed an array of 32 MB.
    """
    if (library := _c_library()) is not None:
        library.mallopt(_TRIM_THRESHOLD, 2 * _KEPT)
        library.mallopt(_TOP_PAD, _USUAL_PAD)
        library.malloc_trim(0)


@lru_cache(maxsize=1)
def _c_library() -> Any:
    """Return the C library, None where it is not glibc."""
    if not sys.platform.startswith("linux"):
        return None
    library = ctypes.CDLL(None)
    return library if hasattr(library, "mallopt") and hasattr(library, "malloc_trim") else None
