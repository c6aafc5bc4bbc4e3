"""One objective or constraint of a design: what it reads of a solved robot."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Protocol

import numpy as np

from notchflex.designing.model.load_states import Direction
from notchflex.designing.model.reading import Reading, taken
from notchflex.designing.specification.asked import (
    DesignConstraint,
    Measured,
    TargetCurve,
)
from notchflex.errors import InputError


class Source(Protocol):
    """Source of readings: a robot solved under its states."""

    def of_state(self, name: str, state: str) -> Reading:
        """Return a quantity of a state, flat, in the unit of the edges."""
        ...

    def closings(self) -> Reading:
        """Return closing tensions, N."""
        ...

    def of_robot(self, name: str) -> Reading:
        """Return a quantity of the robot alone."""
        ...

    def value(self, path: str) -> Reading:
        """Return the values of the robot file."""
        ...

    def compliance(self, state: str, direction: Direction) -> Reading:
        """Return the tip compliance, mm/N."""
        ...

    def curve(self, curve: TargetCurve) -> Reading:
        """Return the distances of the points of a curve, mm."""
        ...

    def offsets(self, curve: TargetCurve) -> Reading:
        """Return the vectors from the points of a curve to the axis, mm."""
        ...


@dataclass(frozen=True)
class Wish:
    """One objective or constraint, resolved.

    Attributes:
        asked: As it stands in the specification.
        title: What messages and tables call it.
        unit: Its unit.
        parts: What its numbers are called, such as "notch 3"; before they are made one.
        rows: Which of the quantity's numbers are meant.
        read: Takes the quantity from a source, at a state.
        curve: The target curve that it is about.
    """

    asked: Measured
    title: str
    unit: str
    parts: tuple[str, ...]
    rows: np.ndarray
    read: Callable[[Source, str | None], Reading]
    curve: TargetCurve | None = None

    @property
    def take(self) -> str:
        """Reduction of several numbers to one."""
        if isinstance(self.asked, DesignConstraint) and self.asked.order is not None:
            return "steps"
        return self.asked.take or ("each" if len(self.rows) == 1 else self._usual)

    @property
    def _usual(self) -> str:
        if isinstance(self.asked, DesignConstraint):
            return "each"
        return "mean" if "." in self.asked.quantity else ""  # values of the robot file

    def every(self, source: Source) -> Reading:
        """Return its numbers, before they are made one."""
        reading = self.read(source, self.asked.state).pick(self.rows)
        if self.asked.minus is not None:
            reading = reading.minus(self.read(source, self.asked.minus).pick(self.rows))
        return reading

    def measure(self, source: Source) -> Reading:
        """Return its numbers, made one or few as asked."""
        return taken(self.every(source), self.take)

    @property
    def direction(self) -> Direction:
        """Direction of its tip compliance, of length 1."""
        return unit_vector(self.asked)

    @property
    def labels(self) -> tuple[str, ...]:
        """Labels of the numbers of `measure`; "" for a single one."""
        if self.take == "each":
            return self.parts if len(self.parts) > 1 else ("",)
        if self.take == "steps":
            pairs = zip(self.parts, self.parts[1:], strict=False)
            return tuple(f"{before} to {after.split()[-1]}" for before, after in pairs)
        return ("",)


def unit_vector(asked: Measured) -> Direction:
    """Return the direction of a tip compliance, of length 1.

    Raises:
        InputError: It has no length.
    """
    given = asked.direction or (0.0, 0.0, 0.0)
    size = float(np.linalg.norm(given))
    if not 1e-9 < size < 1e9:
        raise InputError.OUT_OF_RANGE("`direction` must be a vector that is not zero.")
    x, y, z = (np.array(given) / size).tolist()
    return x, y, z
