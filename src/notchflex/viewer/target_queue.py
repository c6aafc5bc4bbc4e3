"""The targets of the robot in order, approached in small steps.

A number that is set again takes effect at once: its former targets are dropped, wherever the robot
is. Other numbers keep theirs, in the order in which they were set.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Iterable
from dataclasses import replace
from threading import RLock

import numpy as np

from notchflex.viewer.controls import Controls


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

    def restart(self, here: Controls) -> None:
        """Continue from another setting to the same targets; those of another kind are dropped."""
        with self._lock:
            self.here = here
            turned = [replace(target, pointing=here.pointing) for target in self._targets]
            self._replace(target for target in turned if target.same_kind(here))

    def clear(self, here: Controls | None = None) -> None:
        """Drop all targets; with `here` also set the current setting."""
        with self._lock:
            self._targets.clear()
            self.here = self.here if here is None else here

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
