"""Tasks of the solver thread in order, and targets of the robot.

A field on the page sends a number after every key: 1 before 1.5. Friction is history-dependent, so
a typed number waits for a pause, and a newer one from the same field replaces it. Any other task
ends the pause.

A number that is set again takes effect at once: its former targets are dropped, wherever the robot
is. Other numbers keep theirs, in the order in which they were set.
"""

from __future__ import annotations

import time
from collections import deque
from collections.abc import Callable, Hashable, Iterable
from dataclasses import replace
from pathlib import Path
from threading import Condition, RLock

import numpy as np

from notchflex.viewer.controls import Controls

Task = Callable[[], None]

PAUSE = 0.5
"""A pause of typing [s]."""


class Tasks:
    """Tasks in order; any thread may add, one thread takes them."""

    def __init__(self) -> None:
        self._changed = Condition()
        self._waiting: deque[tuple[Task, Hashable, float]] = deque()  # task, key, due time [s]

    def add(
        self, task: Task, key: Hashable = None, pause: float = 0.0, now: Task | None = None
    ) -> None:
        """Append a task that waits for a pause [s].

        The last task that waits is dropped if it has the same key, its origin. What is to be done
        `now` is done before the task can be taken, however long that lasts.
        """
        with self._changed:
            if key is not None and self._waiting and self._waiting[-1][1] == key:
                self._waiting.pop()
            self._waiting.append((task, key, time.monotonic() + pause))
            if now is not None:
                now()
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


class TargetQueue:
    """Settings to reach, in order; several threads may use it.

    It begins at a setting, without targets. `stride` is the largest change of each of the
    `Controls.numbers` in one step.
    """

    def __init__(self, start: Controls, stride: np.ndarray) -> None:
        self._lock = RLock()
        self._targets: deque[Controls] = deque()
        self.here = start
        self.stride = stride

    def __len__(self) -> int:
        """Number of targets."""
        return len(self._targets)

    @property
    def end(self) -> Controls:
        """The last target; where the robot is if there is none."""
        with self._lock:
            return self._targets[-1] if self._targets else self.here

    def add(self, target: Controls) -> None:
        """Append a target."""
        with self._lock:
            if target != self.end:
                self._targets.append(target)

    def set_number(self, number: int, value: float) -> None:
        """Set one of the `Controls.numbers`: its former targets are dropped."""
        with self._lock:
            self.hold(number)
            numbers = self.end.numbers
            numbers[number] = value
            self.add(self.end.with_numbers(numbers))

    def hold(self, number: int) -> None:
        """Keep one of the `Controls.numbers` at its current value: its targets are dropped."""
        with self._lock:
            held: list[Controls] = []
            for target in self._targets:
                numbers = target.numbers
                numbers[number] = self.here.numbers[number]
                held.append(target.with_numbers(numbers))
            self._replace(held)

    def _replace(self, targets: Iterable[Controls]) -> None:
        self._targets.clear()
        for target in targets:
            self.add(target)

    def restart(self, controls: Controls) -> None:
        """Continue from another setting to the same targets; those of another kind are dropped."""
        with self._lock:
            self.here = controls
            turned = [replace(target, pointing=controls.pointing) for target in self._targets]
            self._replace(target for target in turned if target.same_kind(controls))

    def clear(self, controls: Controls | None = None) -> None:
        """Drop all targets; with `controls` also set the current setting."""
        with self._lock:
            self._targets.clear()
            self.here = self.here if controls is None else controls

    def next(self) -> Controls | None:
        """Return the next setting to solve; None if all targets are reached."""
        with self._lock:
            while self._targets and self._targets[0] == self.here:
                self._targets.popleft()
            if not self._targets:
                return None
            target = step = self._targets[0]
            if self.here.same_kind(target):
                change = target.numbers - self.here.numbers
                strides = float(np.max(np.abs(change) / self.stride))
                if strides > 1.0 + 1e-9:
                    step = target.with_numbers(self.here.numbers + change / strides)
            if step == target:
                self._targets.popleft()
            self.here = step
            return step
