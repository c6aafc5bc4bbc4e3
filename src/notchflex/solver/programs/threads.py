"""Threads that work on the pieces of a table, started once: each keeps its memory for the next."""

from __future__ import annotations

import os
from collections import deque
from collections.abc import Callable, Generator, Iterable
from concurrent.futures import Future, ThreadPoolExecutor
from functools import lru_cache
from typing import TypeVar

Piece = TypeVar("Piece")
Result = TypeVar("Result")

# So many pieces wait for each thread, that none stands still while results are put together.
_AHEAD = 4


def number_of_cores() -> int:
    """How many threads work where nothing else is told."""
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
    """What comes of pieces of work, done by several threads, in the order of the pieces.

    Only a few pieces are begun ahead, so that those of others who ask meanwhile have their turn.
    Closed early (`contextlib.closing`), no more of them are begun.

    Args:
        work: What is done with a piece.
        pieces: The pieces.
        cores: How many threads; one per core where not given.

    Yields:
        The results.
    """
    cores = cores or number_of_cores()
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


__all__ = ["number_of_cores", "on_cores"]
