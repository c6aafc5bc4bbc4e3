"""A pool of threads for the pieces of a table, started once: each reuses its memory."""

from __future__ import annotations

import os
from collections import deque
from collections.abc import Callable, Generator, Iterable
from concurrent.futures import Future, ThreadPoolExecutor, wait
from functools import lru_cache
from typing import TypeVar

Piece = TypeVar("Piece")
Result = TypeVar("Result")

# Number of pieces queued per thread, so that none is idle while results are collected.
_AHEAD = 4


def number_of_cores() -> int:
    """Return the default number of threads."""
    return os.cpu_count() or 1


@lru_cache(maxsize=4)
def _threads(cores: int) -> ThreadPoolExecutor:
    return ThreadPoolExecutor(cores, thread_name_prefix="notchflex")


# The child of a fork has none of its parent's threads.
if hasattr(os, "register_at_fork"):
    os.register_at_fork(after_in_child=_threads.cache_clear)


def on_cores(
    work: Callable[[Piece], Result], pieces: Iterable[Piece], cores: int | None = None
) -> Generator[Result]:
    """Process pieces in several threads; yield the results in the order of the pieces.

    Only a few pieces are queued, so that other callers can run. After an early close
    (`contextlib.closing`) no more pieces start, and the function waits for those that run.

    Args:
        work: Function of a piece.
        pieces: The pieces.
        cores: Number of threads, one per core where not given; 1 is the calling thread.
    """
    cores = cores or number_of_cores()
    if cores == 1:
        yield from map(work, pieces)
        return
    threads, begun = _threads(cores), deque[Future[Result]]()
    try:
        for piece in pieces:
            begun.append(threads.submit(work, piece))
            if len(begun) > _AHEAD * cores:
                yield begun.popleft().result()
        while begun:
            yield begun.popleft().result()
    finally:
        for one in begun:
            one.cancel()
        wait(begun)
