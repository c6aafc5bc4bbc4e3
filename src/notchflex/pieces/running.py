"""Execution of pieces by threads, by processes or by workers of dask, with equal results."""

from __future__ import annotations

import contextlib
import ctypes
import logging
import multiprocessing
import os
import re
import sys
import threading
import time
from collections import Counter, deque
from collections.abc import Callable, Generator, Iterable
from concurrent.futures import Future, ProcessPoolExecutor, as_completed
from concurrent.futures.process import BrokenProcessPool
from contextlib import closing
from functools import lru_cache, partial
from itertools import islice
from queue import Empty, SimpleQueue
from typing import Any, TypeVar

from threadpoolctl import threadpool_limits

from notchflex import InputError
from notchflex.pieces.folder import Done, PieceTask, Recipe, make_piece, task_of
from notchflex.support import need, number_of_cores, on_cores

T = TypeVar("T")

_ADDRESS = re.compile(r"(\w+://)?[^\s/]+:\d{1,5}")

_CONNECT, _WAIT = 20, 60
"""Seconds to wait for a scheduler, and for its first worker."""

_ASK, _ANSWER, _ALONE = 5.0, 20.0, 30.0
"""Seconds between two questions for workers, to wait for an answer, and without any worker."""

_POLL = 0.2
"""Seconds between two questions for the first worker."""

_CLOSE = 5.0
"""Seconds for a client to close."""


def check_address(address: str) -> None:
    """Raise if a text is not an address of a scheduler.

    Raises:
        InputError: It is not written as HOST:PORT.
    """
    if not _ADDRESS.fullmatch(address):
        raise InputError.BAD_SYNTAX(
            f"{address!r} is not an address of a scheduler; write it like tcp://10.0.0.1:8786."
        )


@contextlib.contextmanager
def scheduler_at(address: str) -> Generator[Any]:
    """Connect to a scheduler of dask.

    Args:
        address: Its address, such as "tcp://10.0.0.1:8786".

    Raises:
        InputError: Nothing answers there, or it has no workers.
    """
    need("distributed", "cluster", "--scheduler")
    import distributed
    from distributed.utils import silence_logging_cmgr

    def connect() -> Any:
        return distributed.Client(address, timeout=_CONNECT, set_as_default=False)

    client = None
    with silence_logging_cmgr(logging.CRITICAL + 1):  # an error of ours reports the loss
        try:
            client = within(_CONNECT + _CLOSE, connect)
            _wait_for_workers(ClusterConnection(client))
        except (OSError, ValueError, TypeError) as problem:
            if client is not None:
                _close(client)
            raise InputError.NO_CONNECTION(
                f"no scheduler with workers answers at {address}: {_in_words(problem)}. Start one "
                f"with `dask scheduler`, and workers with `dask worker {address}`."
            ) from None
        try:
            yield client
        finally:
            _close(client)


def _wait_for_workers(connection: ClusterConnection) -> None:
    """Wait for the first worker; dask's own way waits on if the scheduler dies meanwhile.

    Raises:
        OSError: There is none in time, or the scheduler is gone.
    """
    until = time.monotonic() + _WAIT
    while True:
        if connection.lost:
            raise OSError("the connection was closed")
        if connection.threads():
            return
        if time.monotonic() > until:
            raise TimeoutError(f"no worker in {_WAIT} s")
        time.sleep(_POLL)


def _in_words(problem: object) -> str:
    """Return an error of dask without names of its objects and tasks."""
    words = " ".join(str(problem).split())
    if "closed" in words or "connection-lost" in words:
        return "the connection was closed"
    return words[:200]


def _close(client: Any) -> None:
    with contextlib.suppress(Exception):
        within(2 * _CLOSE, partial(client.close, timeout=_CLOSE))


def within(seconds: float, call: Callable[[], T]) -> T:
    """Return the result of a call, or go on without it.

    A call of dask whose scheduler dies may wait for ever, in spite of its time limit.

    Args:
        seconds: Longest time to wait.
        call: What is called, in a thread of its own.

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
    try:
        return future.result(seconds)
    except TimeoutError as problem:
        raise TimeoutError(str(problem) or f"no answer in {seconds:.0f} s") from None


def scheduler_gone(why: object) -> InputError:
    """Return the error of a scheduler, or of all its workers, that are gone.

    Args:
        why: What was found.
    """
    return InputError.NO_CONNECTION(
        f"the scheduler or its workers are gone ({_in_words(why)}); all finished pieces are kept: "
        "start them again, and call again."
    )


class ClusterConnection:
    """The connection of a client to its scheduler, to be checked while results are awaited.

    dask cancels its futures when the scheduler dies, but not all: one that is submitted while the
    client notices the loss stays pending for ever. And it waits without limit for new workers.

    Args:
        client: The client, connected.
    """

    def __init__(self, client: Any) -> None:
        self._client = client
        self._stream = client.scheduler_comm
        self._asked = self._manned = time.monotonic()

    @property
    def lost(self) -> bool:
        """Whether the connection was lost, even if there is a new one: its futures are void."""
        client, stream = self._client, self._stream
        return client.status != "running" or client.scheduler_comm is not stream or stream.closed()

    def threads(self) -> int:
        """Ask for the number of threads of all workers.

        Raises:
            OSError: There is no answer.
        """
        return sum(within(_ANSWER, self._client.nthreads).values())

    def check(self) -> None:
        """Raise if the scheduler is gone, or has had no worker for long.

        Raises:
            InputError: It is.
        """
        if self.lost:
            raise scheduler_gone("the connection was closed")
        now = time.monotonic()
        if now - self._asked < _ASK:
            return
        self._asked = now
        try:
            threads = self.threads()
        except OSError as problem:
            raise scheduler_gone(problem) from None
        if threads:
            self._manned = now
        elif now - self._manned > _ALONE:
            raise scheduler_gone(f"no worker for {_ALONE:.0f} s")


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


def in_processes(
    workers: int, task: PieceTask, folder: str, pieces: Iterable[int]
) -> Generator[Done]:
    """Work on pieces in other processes of this machine, which listen to pipes alone.

    A port on this machine is open to all of its users; who reaches a worker runs any code in it.

    Args:
        workers: How many processes.
        task: What is worked on.
        folder: Path of the folder.
        pieces: Numbers of the pieces.

    Raises:
        InputError: A file cannot be written, or processes are lost again and again.
    """
    recipe, text = task.recipe, task.manifest.text
    waiting = deque(pieces)
    for _ in range(_TRIES):
        spawn = multiprocessing.get_context("spawn")
        pool = ProcessPoolExecutor(workers, mp_context=spawn, initializer=_end_with_parent)
        running: dict[Future[Done], int] = {}
        try:
            while waiting or running:
                while waiting and len(running) < _AHEAD * workers:
                    # It waits until it is submitted: a process may be lost here too.
                    running[pool.submit(_work, recipe, text, folder, waiting[0])] = waiting[0]
                    waiting.popleft()
                future = next(as_completed(running))
                done = future.result()
                del running[future]
                yield done
            return
        except BrokenProcessPool:  # what was lost with a process is worked on anew
            waiting.extendleft(running.values())
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
    """Work on one piece, in another process."""
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
