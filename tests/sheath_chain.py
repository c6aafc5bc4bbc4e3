"""A wire over many contacts of equal angle, with elastic pieces between: a sheath in NumPy alone.

It shares nothing with the library: every piece has its tension, every contact a place, and each
load step is solved for all of them by Newton's method on Euler's law of the rope.
"""

from collections.abc import Callable

import numpy as np


class ChainOfContacts:
    """A wire from a drive to a robot over equal contacts, with its memory.

    Contact i lies between the pieces i - 1 and i, the first behind the drive; n + 1 pieces. The end
    pieces are half as long, so that contacts lie in the middle of their parts of the sheath.
    """

    def __init__(self, contacts: int, log_ratio: float, compliance: float) -> None:
        """Make a slack wire: ln of the tension ratio and stretch per tension (mm/N) of it all."""
        self.limit = log_ratio / contacts
        parts = np.ones(contacts + 1)
        parts[[0, -1]] = 0.5
        self.compliance = compliance * parts / contacts
        self.level = np.full(contacts + 1, -6.0)  # ln T of the pieces
        self.place = np.zeros(contacts)  # wire that has gone over every contact toward the drive
        self.dissipated = 0.0

    def places(self, level: np.ndarray, drawn: float) -> np.ndarray:
        """Return the way of the wire over all contacts: the robot's, and the stretch beyond."""
        stretch = self.compliance * np.exp(level)
        return drawn + np.cumsum(stretch[::-1])[::-1][1:]

    def pull(self, tension: float, stroke_at: Callable[[float], tuple[float, float]]) -> None:
        """Set the tension of the drive; `stroke_at` returns the robot's stroke and its slope."""
        count, scale = len(self.place), 30.0
        level = self.level.copy()
        level[0] = np.log(tension)
        for piece in range(1, count + 1):  # a start: nothing slides that need not
            level[piece] = np.clip(level[piece], *(level[piece - 1] + self.limit * np.array([-1, 1])))
        for _ in range(400):
            drawn, by_tension = stroke_at(np.exp(level[-1]))
            place = self.places(level, drawn)
            ratio = level[:-1] - level[1:]
            trial = ratio + scale * (place - self.place)
            residual = ratio - np.clip(trial, -self.limit, self.limit)
            if np.abs(residual).max() < 1e-13:
                break
            # The change of a place by ln T of the pieces beyond it.
            by_level = np.triu(np.tile(self.compliance[1:] * np.exp(level[1:]), (count, 1)))
            by_level[:, -1] += by_tension * np.exp(level[-1])
            by_ratio = np.eye(count, k=-1) - np.eye(count)
            slides = np.abs(trial) >= self.limit
            jacobian = np.where(slides[:, None], by_ratio, -scale * by_level)
            step = np.linalg.solve(jacobian, -residual)
            level[1:] += step * min(1.0, 0.5 / np.abs(step).max())
        else:
            raise AssertionError(f"no equilibrium of the chain: {np.abs(residual).max()}")
        mean = 0.5 * (np.exp(level) + np.exp(self.level))
        self.dissipated += np.sum((mean[:-1] - mean[1:]) * (place - self.place))
        self.level, self.place, self.drawn = level, place, drawn

    @property
    def tension(self) -> float:
        """Tension at the robot, N."""
        return float(np.exp(self.level[-1]))

    @property
    def stroke(self) -> float:
        """Way of the wire's end at the drive, mm."""
        return float(self.drawn + np.sum(self.compliance * np.exp(self.level)))
