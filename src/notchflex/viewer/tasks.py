"""Tasks of the solver thread: in order, and typed numbers only when complete.

A field on the page sends a number after every key: 1 before 1.5. Friction is history-dependent, so
a typed number waits for a pause, and a newer one from the same field replaces it. Any other task
ends the pause.
"""

from __future__ import annotations

import time
from collections import deque
from collections.abc import Callable, Hashable
from pathlib import Path
from threading import Condition

Task = Callable[[], None]

PAUSE = 0.5
"""A pause of typing [s]."""


class Tasks:
    """Tasks in order; any thread may add, one thread takes them."""

    def __init__(self) -> None:
        self._changed = Condition()
        self._waiting: deque[tuple[Task, Hashable, float]] = deque()  # task, key, due time [s]

    def add(self, task: Task, key: Hashable = None, pause: float = 0.0) -> None:
        """Append a task that waits for a pause [s].

        The last task that waits is dropped if it has the same key, its origin.
        """
        with self._changed:
            if key is not None and self._waiting and self._waiting[-1][1] == key:
                self._waiting.pop()
            self._waiting.append((task, key, time.monotonic() + pause))
            self._changed.notify()

    def has(self, key: Hashable) -> bool:
        """Return whether a task with a key waits."""
        with self._changed:
            return any(waiting == key for _, waiting, _ in self._waiting)

    def take(self, timeout: float = 0.0) -> Task | None:
        """Return the next task that is ready; None if there is none within `timeout` [s]."""
        end = time.monotonic() + timeout
        with self._changed:
            while True:
                now = time.monotonic()
                # A later task ends the pause of the earlier ones.
                due = self._waiting[0][2] if self._waiting else end
                if self._waiting and (len(self._waiting) > 1 or due <= now):
                    return self._waiting.popleft()[0]
                until = min(end, due)
                if until <= now:
                    return None
                self._changed.wait(until - now)


class WatchedFile:
    """A file that is edited meanwhile; it may be missing while an editor replaces it."""

    def __init__(self, path: Path) -> None:
        self.path = path
        self._seen = self._version()

    def changed(self) -> bool:
        """Return whether it has been saved since the last call."""
        before, now = self._seen, self._version()
        self._seen = now or before
        return self._seen != before

    def _version(self) -> tuple[int, int, int] | None:
        try:
            file = self.path.stat()
        except OSError:
            return None
        return file.st_mtime_ns, file.st_size, file.st_ino
