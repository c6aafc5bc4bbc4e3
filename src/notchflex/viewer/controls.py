"""What a person has set: tendons by tension or stroke, a force and a weight at the tip."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import TypeVar

import numpy as np

from notchflex.loads import Load
from notchflex.robot import Robot

T = TypeVar("T")

TENSION, STROKE = "tension", "stroke"

# Rotation vectors [rad] that point the tube, whose axis is z of the world, another way. Sideways
# the robot lies along -x, so that notches of direction 0 lift it when they bend.
POINTING: dict[str, tuple[float, float, float]] = {
    "up": (0.0, 0.0, 0.0),
    "sideways": (0.0, -0.5 * np.pi, 0.0),
    "down": (0.0, float(np.pi), 0.0),
}


@dataclass(frozen=True)
class Controls:
    """Settings of everything that loads a robot of t tendons.

    Args:
        by: `TENSION` or `STROKE` for every tendon.
        value: Its tension (N) or stroke (mm).
        tip_force: Force at the tip in the world, N.
        tip_mass: Mass that hangs at the tip, g.
        pointing: Where the tube points, a key of `POINTING`.

    Example:
        >>> Controls(("tension",), (2.0,)).load()
        Load(tension=(2.0,), stroke=(None,))
    """

    by: tuple[str, ...]
    value: tuple[float, ...]
    tip_force: tuple[float, float, float] = (0.0, 0.0, 0.0)
    tip_mass: float = 0.0
    pointing: str = "up"

    @classmethod
    def at_rest(cls, robot: Robot, pointing: str = "up") -> Controls:
        """Nothing loads a robot: all its tendons have a tension of 0 N."""
        count = robot.number_of_tendons
        return cls((TENSION,) * count, (0.0,) * count, pointing=pointing)

    def load(self) -> Load:
        """The load that they stand for."""
        pairs = list(zip(self.by, self.value, strict=True))
        return Load(
            tension=tuple(value if by == TENSION else None for by, value in pairs),
            stroke=tuple(value if by == STROKE else None for by, value in pairs),
            tip_force=self.tip_force,
            tip_mass=self.tip_mass,
            base_rotation=POINTING[self.pointing],
        )

    def with_tendon(self, tendon: int, by: str, value: float) -> Controls:
        """The same with one tendon (from 0) driven otherwise."""
        return replace(
            self, by=_put(self.by, tendon, by), value=_put(self.value, tendon, float(value))
        )

    def command(self, number: int) -> str:
        """Return how one of the `numbers` is commanded: "" where it is no tendon's."""
        return self.by[number] if number < len(self.by) else ""

    @property
    def numbers(self) -> np.ndarray:
        """All that can be changed bit by bit: tendons, force, mass."""
        return np.array([*self.value, *self.tip_force, self.tip_mass])

    def with_numbers(self, numbers: Sequence[float] | np.ndarray) -> Controls:
        """The same with other `numbers`."""
        every = tuple(float(number) for number in numbers)
        x, y, z, mass = every[-4:]
        return replace(self, value=every[:-4], tip_force=(x, y, z), tip_mass=mass)

    def same_kind(self, other: Controls) -> bool:
        """Whether the way to other settings can be gone bit by bit."""
        return (self.by, self.pointing) == (other.by, other.pointing)


def _put(values: tuple[T, ...], index: int, value: T) -> tuple[T, ...]:
    return (*values[:index], value, *values[index + 1 :])


__all__ = ["POINTING", "STROKE", "TENSION", "Controls"]
