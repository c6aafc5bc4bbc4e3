"""The way from one setting to the next, gone in small steps and not cut short.

Friction remembers, so a slider that was pushed up and back again must have been up: settings that
arrive faster than they are solved are kept, but for those that lie on the way to the next.
"""

from __future__ import annotations

from collections import deque
from threading import Lock

import numpy as np

from notchflex.viewer.controls import Controls

# Change of every number as part of its change between two corners that still counts as none.
_STILL = 1e-12


class Way:
    """Settings still to be reached, in order; several threads may add to it.

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
        """How many corners are still ahead."""
        return len(self._ahead)

    @property
    def end(self) -> Controls:
        """Where it leads to."""
        with self._lock:
            return self._ahead[-1] if self._ahead else self.here

    def add(self, goal: Controls) -> None:
        """Go on to another setting; one before it that lies on the straight way there is passed."""
        with self._lock:
            last = self._ahead[-1] if self._ahead else self.here
            if goal == last:
                return
            if self._ahead:
                before = self._ahead[-2] if len(self._ahead) > 1 else self.here
                if _on_the_way(before, last, goal):
                    self._ahead.pop()
            self._ahead.append(goal)

    def clear(self, here: Controls | None = None) -> None:
        """Forget what is ahead, and stand elsewhere if told so."""
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


def _on_the_way(first: Controls, middle: Controls, last: Controls) -> bool:
    """Whether only one number changes, and goes the same way from first to middle to last."""
    if not (first.same_kind(middle) and middle.same_kind(last)):
        return False
    before, after = middle.numbers - first.numbers, last.numbers - middle.numbers
    changing = np.flatnonzero((np.abs(before) > _STILL) | (np.abs(after) > _STILL))
    return len(changing) == 1 and bool(before[changing[0]] * after[changing[0]] >= 0.0)


__all__ = ["Way"]
