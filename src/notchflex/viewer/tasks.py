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
from typing import NamedTuple

PAUSE = 0.5
"""A pause of typing [s]."""


class _Entry(NamedTuple):
    task: Callable[[], None]
    key: Hashable | None
    due: float


class Tasks:
    """Tasks in order; any thread may add, one thread takes them."""

    def __init__(self) -> None:
        """Begin without tasks."""
        self._changed = Condition()
        self._waiting: deque[_Entry] = deque()

    def add(
        self, task: Callable[[], None], key: Hashable | None = None, pause: float = 0.0
    ) -> None:
        """Append a task.

        Args:
            task: The task.
            key: Its origin: the last task that waits is dropped if it has the same key.
            pause: How long to wait for another one [s].
        """
        with self._changed:
            if key is not None and self._waiting and self._waiting[-1].key == key:
                self._waiting.pop()
            self._waiting.append(_Entry(task, key, time.monotonic() + pause))
            self._changed.notify()

    def has(self, key: Hashable) -> bool:
        """Return whether a task with a key waits."""
        with self._changed:
            return any(entry.key == key for entry in self._waiting)

    def take(self, timeout: float = 0.0) -> Callable[[], None] | None:
        """Return the next task that is ready; None if there is none within `timeout` [s]."""
        end = time.monotonic() + timeout
        with self._changed:
            while True:
                now = time.monotonic()
                # A later task ends the pause of the earlier ones.
                if self._waiting and (len(self._waiting) > 1 or self._waiting[0].due <= now):
                    return self._waiting.popleft().task
                until = min(end, self._waiting[0].due) if self._waiting else end
                if until <= now:
                    return None
                self._changed.wait(until - now)


class WatchedFile:
    """A file that is edited meanwhile; it may be missing while an editor replaces it."""

    def __init__(self, path: Path) -> None:
        """Remember its current version."""
        self.path = path
        self._seen = self._version()

    def changed(self) -> bool:
        """Return whether it has been saved since the last call."""
        now = self._version()
        if now is None or now == self._seen:
            return False
        self._seen = now
        return True

    def _version(self) -> tuple[int, int, int] | None:
        try:
            found = self.path.stat()
        except OSError:
            return None
        return found.st_mtime_ns, found.st_size, found.st_ino
