"""A wire over many contacts of equal angle, with elastic pieces between: a sheath in NumPy alone.

Every piece of wire has its tension, every contact the way of the wire over it, and each load step
must satisfy Euler's law of the rope at every contact. It shares nothing with the library.
"""

from collections.abc import Callable

import numpy as np
from scipy.optimize import brentq

ROUNDING = 1e-9
"""Largest imbalance of a contact, as part of its friction."""


class ChainOfContacts:
    """A wire from a drive to a robot over equal contacts, with its memory.

    Contact i lies between pieces i and i + 1 of the wire. The end pieces are half as long, so that
    contacts lie in the middle of their parts of the sheath.
    """

    def __init__(self, contacts: int, log_ratio: float, compliance: float) -> None:
        """Make a slack wire: ln of the tension ratio and stretch per tension (mm/N) of it all."""
        self.limit = log_ratio / contacts
        parts = np.ones(contacts + 1)
        parts[[0, -1]] = 0.5
        self.compliance = compliance * parts / contacts
        self.level = np.full(contacts + 1, -60.0)  # ln T of the pieces
        self.way = np.zeros(contacts)  # of the wire over every contact, toward the drive
        self.dissipated = self.work = self.stroke = self.drawn = 0.0

    def set_tension(self, tension: float, stroke_of: Callable[[float], float]) -> None:
        """Set the tension of the drive; `stroke_of` returns the stroke of the robot at a tension.

        Raises:
            AssertionError: A contact does not obey Euler's law.
        """
        drive, whole = np.log(tension), len(self.way) * self.limit

        def held(base: float) -> float:
            """Return the way of the wire over the contact that is farthest from sliding."""
            level = self._levels(drive, base)
            contact = np.argmin(np.abs(np.diff(level)))
            return self._ways(level, stroke_of(np.exp(base)))[contact] - self.way[contact]

        least, most = drive - whole, drive + whole
        base = least
        if held(least) < 0.0:
            base = most if held(most) < 0.0 else brentq(held, least, most, xtol=1e-15, rtol=1e-15)
        level, drawn = self._levels(drive, base), stroke_of(np.exp(base))
        way = self._ways(level, drawn)
        self._check(level, way)
        middle = 0.5 * (np.exp(level) + np.exp(self.level))
        stroke = float(drawn + np.sum(self.compliance * np.exp(level)))
        self.dissipated -= np.sum(np.diff(middle) * (way - self.way))
        self.work += middle[0] * (stroke - self.stroke)
        self.level, self.way, self.drawn, self.stroke = level, way, drawn, stroke

    def _levels(self, drive: float, base: float) -> np.ndarray:
        """Return ln T of all pieces: what neither end has to change stays."""
        level = self.level.copy()
        level[0], level[-1] = drive, base
        inner = range(1, len(level) - 1)
        for step, pieces in ((-1, inner), (1, reversed(inner))):
            for piece in pieces:
                beside = level[piece + step]
                level[piece] = np.clip(level[piece], beside - self.limit, beside + self.limit)
        return level

    def _ways(self, level: np.ndarray, drawn: float) -> np.ndarray:
        """Return the way of the wire over all contacts: the robot's, and the stretch beyond."""
        stretch = self.compliance * np.exp(level)
        return drawn + np.cumsum(stretch[::-1])[::-1][1:]

    def _check(self, level: np.ndarray, way: np.ndarray) -> None:
        """Check that every contact sticks, or slides in the direction of its friction."""
        ratio, slip = -np.diff(level), way - self.way
        assert np.abs(ratio).max() < self.limit * (1.0 + ROUNDING)
        part = np.clip(ratio / self.limit + slip / 1e-6, -1.0, 1.0) - ratio / self.limit
        assert np.abs(part).max() < 1e-3, (part.min(), part.max())

    @property
    def tension(self) -> float:
        """Tension at the robot, N."""
        return float(np.exp(self.level[-1]))
