"""Threads that are kept from one batch to the next."""

from __future__ import annotations

import os
import signal
import threading
import time
from contextlib import closing

import pytest

from notchflex.solver.programs.compiled import on_cores


def test_after_a_failure_nothing_more_is_begun() -> None:
    begun: list[int] = []

    def fails(piece: int) -> None:
        begun.append(piece)
        time.sleep(0.01)
        raise ValueError(piece)

    with pytest.raises(ValueError, match="0"):
        list(on_cores(fails, range(50), 1))
    time.sleep(0.1)
    assert len(begun) < 10
    assert list(on_cores(abs, [-1], 1)) == [1]


def test_closed_early_nothing_more_is_begun() -> None:
    """Also where the traceback of what ended it is kept, and the frames in it with that."""
    begun: list[int] = []

    def slow(piece: int) -> None:
        begun.append(piece)
        time.sleep(0.01)

    def stopped() -> None:
        with closing(on_cores(slow, range(50), 1)) as results:
            next(results)
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt) as kept:
        stopped()
    time.sleep(0.1)
    assert len(begun) < 10
    del kept


def test_a_small_batch_need_not_wait_for_a_long_one() -> None:
    done: list[str] = []

    def piece(whose: str) -> None:
        time.sleep(0.005)
        done.append(whose)

    def long() -> None:
        list(on_cores(piece, ["long"] * 60, 2))

    other = threading.Thread(target=long)
    other.start()
    time.sleep(0.02)
    list(on_cores(piece, ["small"], 2))
    assert done.count("long") < 30
    other.join()
    assert done.count("long") == 60


@pytest.mark.skipif(not hasattr(os, "fork"), reason="this system has no fork")
@pytest.mark.filterwarnings("ignore:.*fork")
def test_a_forked_process_has_threads_of_its_own() -> None:
    assert list(on_cores(abs, [-1], 2)) == [1]
    child = os.fork()
    if child == 0:
        os._exit(0 if list(on_cores(abs, [-2], 2)) == [2] else 1)
    until = time.monotonic() + 30.0
    ended, status = os.waitpid(child, os.WNOHANG)
    while not ended and time.monotonic() < until:
        time.sleep(0.01)
        ended, status = os.waitpid(child, os.WNOHANG)
    if not ended:
        os.kill(child, signal.SIGKILL)
        os.waitpid(child, 0)
    assert ended
    assert status == 0
