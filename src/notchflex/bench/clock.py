"""Timing: medians, beside the time of a known computation taken in the same run."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from threadpoolctl import threadpool_limits

# Time one case may take when it is repeated, s, and how often it is repeated at least.
_ENOUGH, _FEWEST = 1.5, 5
# What is compared takes turns, so many times: the speed of a machine changes from second to second.
_ROUNDS = 10
_UNKNOWNS = 135


@dataclass(frozen=True)
class Row:
    """One line of the table.

    Attributes:
        name: What was timed.
        us: Its time, microseconds; of one solve, step or call, as the name says. None where
            something else was measured, which the note tells.
        lu135: The same in multiples of one solution of 135 linear equations, timed around it.
        target: What is aimed at, in the same multiples; None where nothing is.
        note: What else there is to say.
    """

    name: str
    us: float | None
    lu135: float | None
    target: float | None
    note: str = ""


class Clock:
    """Times functions beside LU135.

    LU135 is `numpy.linalg.solve` of a random system of 135 equations on one core: about as many
    unknowns as a robot of 27 links with five strain modes each has.
    """

    def __init__(self) -> None:
        """Make the system."""
        random = np.random.default_rng(0)
        self._matrix = random.normal(size=(_UNKNOWNS, _UNKNOWNS))
        self._right = np.ones(_UNKNOWNS)

    def lu135(self, repeats: int = 60) -> float:
        """Time of one solution of 135 linear equations, median, us."""
        with threadpool_limits(1):
            return _median(lambda: np.linalg.solve(self._matrix, self._right), repeats)

    def time(
        self,
        name: str,
        run: Callable[[], object],
        per: float,
        target: float | None,
        other: Callable[[], object] | None = None,
    ) -> tuple[Row, float]:
        """Time a function that has been called before.

        Args:
            name: What it is.
            run: The function.
            per: How many solves or steps it does.
            target: What is aimed at, multiples of LU135.
            other: What else it is compared with.

        Returns:
            The line of the table, and the time in multiples of that of the other.
        """
        started = time.perf_counter()
        run()
        once = time.perf_counter() - started
        repeats = max(_FEWEST, min(300, int(_ENOUGH / max(once, 1e-6))))
        rounds = min(_ROUNDS, repeats)
        taken, unit, others = (np.full(rounds, np.nan) for _ in range(3))
        for number in range(rounds):
            unit[number] = self.lu135(_FEWEST)
            taken[number] = _median(run, -(-repeats // rounds)) / per
            if other is not None:
                others[number] = _median(other, -(-repeats // rounds))
        row = Row(name, float(np.median(taken)), float(np.median(taken / unit)), target)
        return row, float(np.median(taken / others))


def _median(run: Callable[[], object], repeats: int) -> float:
    taken: list[float] = []
    for _ in range(repeats):
        started = time.perf_counter()
        run()
        taken.append(time.perf_counter() - started)
    return 1e6 * float(np.median(taken))
