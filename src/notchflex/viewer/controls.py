"""The settings of the page: tendons by tension or stroke, a force and a weight at the tip."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from notchflex.loads import Load
from notchflex.robot import Robot

TENSION, STROKE = "tension", "stroke"

# Rotation vectors [rad] of the tube, whose axis is z of the world at first. Sideways the robot lies
# along -x, so that notches of direction 0 lift it when they bend.
POINTING: dict[str, tuple[float, float, float]] = {
    "up": (0.0, 0.0, 0.0),
    "sideways": (0.0, -0.5 * np.pi, 0.0),
    "down": (0.0, float(np.pi), 0.0),
}


@dataclass(frozen=True)
class Controls:
    """Loads of a robot.

    Every tendon has a tension [N] or a stroke [mm] as `value`, by `TENSION` or `STROKE`. The force
    at the tip is in the world [N], the mass hangs there [g]; `pointing` is a key of `POINTING`.

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
        """Return no loads: a tension of 0 N for all tendons."""
        count = robot.number_of_tendons
        return cls((TENSION,) * count, (0.0,) * count, pointing=pointing)

    def load(self) -> Load:
        """Return them as a load."""
        pairs = list(zip(self.by, self.value, strict=True))
        return Load(
            tension=tuple(value if by == TENSION else None for by, value in pairs),
            stroke=tuple(value if by == STROKE else None for by, value in pairs),
            tip_force=self.tip_force,
            tip_mass=self.tip_mass,
            base_rotation=POINTING[self.pointing],
        )

    def with_tendon(self, tendon: int, by: str, value: float) -> Controls:
        """Return the same with another tension or stroke of one tendon (from 0)."""
        kinds, values = list(self.by), list(self.value)
        kinds[tendon], values[tendon] = by, float(value)
        return replace(self, by=tuple(kinds), value=tuple(values))

    def command(self, number: int) -> str:
        """Return `TENSION` or `STROKE` of one of the `numbers`; "" if it is not of a tendon."""
        return self.by[number] if number < len(self.by) else ""

    @property
    def numbers(self) -> np.ndarray:
        """All numbers: tendons, force, mass."""
        return np.array([*self.value, *self.tip_force, self.tip_mass])

    def with_numbers(self, numbers: Sequence[float] | np.ndarray) -> Controls:
        """Return the same with other `numbers`."""
        every = tuple(float(number) for number in numbers)
        x, y, z, mass = every[-4:]
        return replace(self, value=every[:-4], tip_force=(x, y, z), tip_mass=mass)

    def same_kind(self, other: Controls) -> bool:
        """Return whether other settings can be approached in small steps."""
        return (self.by, self.pointing) == (other.by, other.pointing)
