"""The way from one setting to the next, gone in small steps.

A number that is set anew is obeyed at once: its old goal is dropped, wherever the robot is on its
way there. Other numbers keep theirs, in the order in which they were set.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Iterable
from dataclasses import replace
from threading import Lock

import numpy as np

from notchflex.viewer.controls import Controls


class Way:
    """Settings still to be reached, in order; several threads may use it.

    Args:
        start: The setting where the robot is.
        stride: Largest change of each number of the settings in one step.
    """

    def __init__(self, start: Controls, stride: np.ndarray) -> None:
        """Begin with nothing to do."""
        self._lock = Lock()
        self._ahead: deque[Controls] = deque()
        self.here = start
        self.stride = stride

    def __len__(self) -> int:
        """How many settings are still ahead."""
        return len(self._ahead)

    @property
    def end(self) -> Controls:
        """Where it leads to."""
        with self._lock:
            return self._end()

    def _end(self) -> Controls:
        return self._ahead[-1] if self._ahead else self.here

    def add(self, goal: Controls) -> None:
        """Go on to another setting after those that are ahead."""
        with self._lock:
            if goal != self._end():
                self._ahead.append(goal)

    def turn(self, number: int, value: float) -> None:
        """Set one of the `numbers` anew: what was ahead for it is dropped.

        Args:
            number: Its place in `Controls.numbers`.
            value: Its new value.
        """
        with self._lock:
            self._hold(number)
            numbers = self._end().numbers
            numbers[number] = value
            goal = self._end().with_numbers(numbers)
            if goal != self._end():
                self._ahead.append(goal)

    def hold(self, number: int) -> None:
        """Leave one of the `numbers` where it is: what is ahead for it is dropped."""
        with self._lock:
            self._hold(number)

    def _hold(self, number: int) -> None:
        now = self.here.numbers[number]
        kept: list[Controls] = []
        for goal in self._ahead:
            numbers = goal.numbers
            numbers[number] = now
            kept.append(goal.with_numbers(numbers))
        self._keep(kept)

    def _keep(self, goals: Iterable[Controls]) -> None:
        self._ahead.clear()
        for goal in goals:
            if goal != self._end():
                self._ahead.append(goal)

    def restart(self, here: Controls) -> None:
        """Stand elsewhere, under another kind of command it may be, and go on to the same goals.

        Goals that are commanded otherwise than the robot is now are dropped.
        """
        with self._lock:
            self.here = here
            turned = [replace(goal, pointing=here.pointing) for goal in self._ahead]
            self._keep(goal for goal in turned if goal.same_kind(here))

    def clear(self, here: Controls | None = None) -> None:
        """Forget what is ahead, and stand elsewhere if so told."""
        with self._lock:
            self._ahead.clear()
            if here is not None:
                self.here = here

    def next(self) -> Controls | None:
        """Take the next step: the setting to solve now; None where the end is reached."""
        with self._lock:
            while self._ahead and self._ahead[0] == self.here:
                self._ahead.popleft()
            if not self._ahead:
                return None
            goal = self._ahead[0]
            step = goal
            if self.here.same_kind(goal):
                change = goal.numbers - self.here.numbers
                strides = float(np.max(np.abs(change) / self.stride))
                if strides > 1.0 + 1e-9:
                    step = goal.with_numbers(self.here.numbers + change / strides)
            if step == goal:
                self._ahead.popleft()
            self.here = step
            return step


__all__ = ["Way"]
