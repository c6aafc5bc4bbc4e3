"""Who works on pieces: threads of this process, or workers of dask; the pieces do not tell."""

from __future__ import annotations

import contextlib
import ctypes
import os
import re
import sys
from collections import Counter
from collections.abc import Generator, Iterable, Iterator
from contextlib import closing
from functools import lru_cache, partial
from itertools import islice
from typing import Any

from threadpoolctl import threadpool_limits

from notchflex._extras import need
from notchflex.errors import InputError
from notchflex.solver.programs.threads import number_of_cores, on_cores
from notchflex.sweeping.engine.piece import Done, Worker, make_piece, worker_of

_TRIM_THRESHOLD, _MMAP_THRESHOLD = -1, -3
"""Numbers of the options in <malloc.h>."""
_KEPT = 2**25
"""glibc takes no larger one."""

_AHEAD = 2
"""So many pieces wait for each worker of dask, so that none is idle."""

_TRIES = 20
"""A piece whose worker is lost so many times is given up."""

_ADDRESS = re.compile(r"(\w+://)?[^\s/]+:\d{1,5}")

_CONNECT, _WAIT = 20, 60
"""Seconds to wait for a scheduler, and for its first worker."""


def in_threads(
    worker: Worker, folder: str, pieces: Iterable[int], cores: int | None = None
) -> Generator[Done]:
    """Work on pieces in threads of this process; each piece keeps to one of them."""
    cores = cores or number_of_cores()
    work = partial(make_piece, worker, folder)
    if cores == 1:
        yield from map(work, pieces)
        return
    with closing(on_cores(work, pieces, cores)) as found:
        yield from found


@contextlib.contextmanager
def local_cluster(workers: int) -> Generator[Any]:
    """Start a scheduler and workers on this machine, one process each.

    Args:
        workers: How many.
    """
    need("distributed", "cluster", "--workers")
    import distributed

    with (
        distributed.LocalCluster(
            n_workers=workers,
            threads_per_worker=1,
            processes=True,
            dashboard_address=None,  # pyright: ignore[reportArgumentType] - no dashboard
            silence_logs=50,
        ) as cluster,
        distributed.Client(cluster, set_as_default=False) as client,
    ):
        yield client


def check_address(address: str) -> None:
    """Raise if a text is no address of a scheduler.

    Raises:
        InputError: It is not written as HOST:PORT.
    """
    if not _ADDRESS.fullmatch(address):
        raise InputError.BAD_SYNTAX(
            f"{address!r} is no address of a scheduler; write it like tcp://10.0.0.1:8786."
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

    client = None
    try:
        client = distributed.Client(address, timeout=_CONNECT, set_as_default=False)
        client.wait_for_workers(1, timeout=_WAIT)
    except (OSError, ValueError, TypeError) as problem:
        if client is not None:
            with contextlib.suppress(Exception):
                client.close(timeout=5)
        words = " ".join(str(problem).split())[:200]
        raise InputError.NO_CONNECTION(
            f"no scheduler with workers answers at {address}: {words}. Start one with `dask "
            f"scheduler`, and workers with `dask worker {address}`."
        ) from None
    with contextlib.closing(client):
        yield client


def on_cluster(client: Any, text: str, folder: str, pieces: Iterable[int]) -> Generator[Done]:
    """Work on pieces with the workers of a client of dask.

    Args:
        client: The client.
        text: Text of the manifest.
        folder: Path of the folder, the same for all workers.
        pieces: Numbers of the pieces.

    Raises:
        InputError: A file cannot be written, or the scheduler is gone.
    """
    import distributed

    lost: Counter[int] = Counter()
    waiting = iter(pieces)
    running: dict[Any, int] = {}
    finished = distributed.as_completed(loop=client.loop)

    def submit(numbers: Iterator[int]) -> None:
        for piece in numbers:
            # A piece is no pure function: its file may be gone while its result is remembered.
            future = client.submit(_work, text, folder, piece, pure=False)
            running[future] = piece
            finished.add(future)

    try:
        submit(islice(waiting, _AHEAD * max(sum(client.nthreads().values()), 1)))
        for future in finished:
            piece = running.pop(future)
            try:
                done: Done = future.result()
            except distributed.KilledWorker:
                lost[piece] += 1
                if lost[piece] >= _TRIES:
                    raise InputError.PROCESS_FAILED(
                        f"piece {piece} was given up: its worker was lost {_TRIES} times."
                    ) from None
                submit(iter([piece]))
                continue
            submit(islice(waiting, 1))
            yield done
    except (distributed.CancelledError, OSError) as problem:
        words = " ".join(str(problem).split())[:100]
        raise InputError.NO_CONNECTION(
            f"the scheduler is gone ({words}); all finished pieces are kept: start it again, and "
            "call again."
        ) from None
    finally:
        with contextlib.suppress(Exception):
            client.cancel(list(running))


def _work(text: str, folder: str, piece: int) -> Done:
    """Work on one piece, in a process of dask."""
    if not os.path.isdir(folder):
        raise InputError.FILE_NOT_FOUND(
            f"a worker sees no folder {folder}; give a folder that all workers share."
        )
    _keep_memory()
    with threadpool_limits(1):
        return make_piece(worker_of(text), folder, piece)


@lru_cache(maxsize=1)
def _keep_memory() -> None:
    """Let the C library keep the memory that arrays gave back, for the next ones.

    dask sets MALLOC_TRIM_THRESHOLD_ for its workers, so that all memory is given back to the system
    at once: a batch then spends as much time on new pages as on solving.
    """
    if not sys.platform.startswith("linux"):
        return
    mallopt = getattr(ctypes.CDLL(None), "mallopt", None)
    if mallopt is not None:
        mallopt(_TRIM_THRESHOLD, _KEPT)
        mallopt(_MMAP_THRESHOLD, _KEPT)
