"""Numbers with their slopes, and how several are made one."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from jaxtyping import Float


class Reading(NamedTuple):
    """Numbers of a robot, and how they change with the variables of a design.

    Attributes:
        values: The numbers, (k,).
        slopes: Their derivatives by every variable, (k, variables); None where not asked.
    """

    values: Float[np.ndarray, " k"]
    slopes: Float[np.ndarray, "k v"] | None

    def map(self, matrix: Float[np.ndarray, "m k"]) -> Reading:
        """Return linear combinations."""
        return Reading(matrix @ self.values, None if self.slopes is None else matrix @ self.slopes)

    def pick(self, rows: np.ndarray) -> Reading:
        """Return some of the numbers."""
        return Reading(self.values[rows], None if self.slopes is None else self.slopes[rows])

    def scaled(self, factor: float) -> Reading:
        """Return the numbers in another unit."""
        return Reading(factor * self.values, None if self.slopes is None else factor * self.slopes)

    def minus(self, other: Reading) -> Reading:
        """Return the difference."""
        slopes = None
        if self.slopes is not None and other.slopes is not None:
            slopes = self.slopes - other.slopes
        return Reading(self.values - other.values, slopes)


def differences(count: int) -> Float[np.ndarray, "m k"]:
    """Return the matrix that takes each number from the next.

    Example:
        >>> differences(3) @ np.array([1.0, 3.0, 7.0])
        array([2., 4.])
    """
    return np.eye(count)[1:] - np.eye(count)[:-1]


def pairs(count: int) -> Float[np.ndarray, "m k"]:
    """Return the matrix that takes each number from every other one.

    Example:
        >>> pairs(2) @ np.array([1.0, 3.0])
        array([-2.,  2.])
    """
    eye = np.eye(count)
    rows = [eye[i] - eye[j] for i in range(count) for j in range(count) if i != j]
    return np.array(rows).reshape(-1, count)


def taken(reading: Reading, take: str) -> Reading:
    """Make several numbers one; `each` leaves them, `steps` takes each from the next."""
    count = len(reading.values)
    if take == "each":
        return reading
    if take == "steps":
        return reading.map(differences(count))
    if take in ("sum", "mean"):
        return reading.map(np.full((1, count), 1.0 if take == "sum" else 1.0 / count))
    if take == "rms":
        size = float(np.sqrt(np.mean(reading.values**2)))
        by = reading.values / (count * size) if size > 0.0 else np.zeros(count)
        slopes = None if reading.slopes is None else by[None] @ reading.slopes
        return Reading(np.array([size]), slopes)
    high, low = int(np.argmax(reading.values)), int(np.argmin(reading.values))
    if take == "range":
        row = np.zeros((1, count))
        row[0, high] += 1.0
        row[0, low] -= 1.0
        return reading.map(row)
    return reading.pick(np.array([high if take == "largest" else low]))
