"""What the thread that solves is asked to do: in order, and typed numbers only when complete.

A field on the page sends a number after every key: on the way to 1.5 it sends 1. Friction
remembers where a robot has been, so such a number waits for a pause, and a newer one from the same
field takes its place. Anything else that is asked for ends the pause.
"""

from __future__ import annotations

import time
from collections import deque
from collections.abc import Callable, Hashable
from dataclasses import dataclass
from threading import Condition

PAUSE = 0.5
"""Typing pauses after this long, s."""


@dataclass
class _Entry:
    task: Callable[[], None]
    key: Hashable | None
    due: float


class Tasks:
    """Tasks in order; any thread may add, one thread takes them."""

    def __init__(self) -> None:
        """Begin with nothing to do."""
        self._changed = Condition()
        self._waiting: deque[_Entry] = deque()

    def add(
        self, task: Callable[[], None], key: Hashable | None = None, pause: float = 0.0
    ) -> None:
        """Let a task be done after all others.

        Args:
            task: What to do.
            key: What sends it: a task of the same key that waits directly before it is dropped.
            pause: How long to wait for another one, s.
        """
        with self._changed:
            if key is not None and self._waiting and self._waiting[-1].key == key:
                self._waiting.pop()
            self._waiting.append(_Entry(task, key, time.monotonic() + pause))
            self._changed.notify()

    def has(self, key: Hashable) -> bool:
        """Whether a task of a key waits."""
        with self._changed:
            return any(entry.key == key for entry in self._waiting)

    def take(self, timeout: float = 0.0) -> Callable[[], None] | None:
        """Return the next task that is ready, or None if there is none.

        Args:
            timeout: How long to wait for one, s.
        """
        end = time.monotonic() + timeout
        with self._changed:
            while True:
                now = time.monotonic()
                # Whatever came later has ended the pause of the ones before.
                if self._waiting and (len(self._waiting) > 1 or self._waiting[0].due <= now):
                    return self._waiting.popleft().task
                until = min(end, self._waiting[0].due) if self._waiting else end
                if until <= now:
                    return None
                self._changed.wait(until - now)


__all__ = ["PAUSE", "Tasks"]
