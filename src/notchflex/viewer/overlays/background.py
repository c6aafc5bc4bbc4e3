"""Background work beside the solver thread, which continues to draw."""

from __future__ import annotations

from collections.abc import Callable
from threading import Lock, Thread
from typing import Generic, TypeVar

Result = TypeVar("Result")


class Background(Generic[Result]):
    """A thread that works while there is work; of requests that wait the last one counts.

    Args:
        ask: Adds a task of the solver thread.
    """

    def __init__(self, ask: Callable[[Callable[[], None]], None]) -> None:
        self._ask = ask
        self._lock = Lock()
        self._waiting: tuple[Callable[[], Result], Callable[[Result], None]] | None = None
        self._at_work = False

    def request(self, work: Callable[[], Result], use: Callable[[Result], None]) -> None:
        """Work, unless another request comes before; any thread may call this.

        Args:
            work: What takes long; its errors are raised in the solver thread.
            use: What the solver thread does with the result.
        """
        with self._lock:
            self._waiting = work, use
            if self._at_work:
                return
            self._at_work = True
        Thread(target=self._run, daemon=True).start()

    def _run(self) -> None:
        while True:
            with self._lock:
                if self._waiting is None:
                    self._at_work = False
                    return
                (work, use), self._waiting = self._waiting, None
            self._ask(_delivery(work, use))


def _delivery(work: Callable[[], Result], use: Callable[[Result], None]) -> Callable[[], None]:
    """Work now; return what hands the result over, or raises what went wrong."""
    try:
        result = work()
    except Exception as problem:
        error = problem

        def fail() -> None:
            raise error

        return fail
    return lambda: use(result)
