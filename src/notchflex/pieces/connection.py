"""Connects to workers of dask, and notices when they or their scheduler are gone."""

from __future__ import annotations

import contextlib
import logging
import re
import threading
import time
from collections.abc import Callable, Generator
from concurrent.futures import Future
from functools import partial
from typing import Any, TypeVar

from notchflex._extras import need
from notchflex.errors import InputError

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

_QUIET = {
    "distributed.worker.profile.enabled": False,
    "distributed.worker.memory.monitor-interval": "1s",
    "distributed.admin.tick.interval": "500ms",
    "distributed.admin.system-monitor.interval": "2s",
}
"""Settings of dask on this machine. By default it samples the stacks of its workers 100 times, and
asks its event loops 50 times a second: in all a tenth of a core, which the pieces need."""


@contextlib.contextmanager
def local_cluster(workers: int) -> Generator[Any]:
    """Start a scheduler and workers on this machine, one process each.

    Args:
        workers: How many.
    """
    need("distributed", "cluster", "--workers")
    import dask.config
    import distributed

    with (
        dask.config.set(_QUIET),
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
