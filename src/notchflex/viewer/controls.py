"""The settings of the page, and the ranges of its sliders.

Tendons go by tension or stroke, with a force and a weight at the tip. The ranges are enough to bend
a robot well, in round numbers.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Final

import numpy as np

from notchflex import Load, Robot, solve

TENSION: Final = "tension"
STROKE: Final = "stroke"
UNITS = {TENSION: "N", STROKE: "mm"}
_AT_TIP = (("force x", "N"), ("force y", "N"), ("force z", "N"), ("hung weight", "g"))

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


def name_of(number: int, by: str, count: int) -> tuple[str, str]:
    """Return name and unit of one of the `Controls.numbers` of a robot with `count` tendons."""
    if number >= count:
        return _AT_TIP[number - count]
    return f"{by} {number + 1}" if count > 1 else by, UNITS[by]


# Tensions are doubled from 1/64 N until the robot is well bent; a slider has half as much more.
FIRST, MOST = 2.0**-6, 2.0**12
WELL_BENT = math.radians(60.0)
ROOM = 1.5
# A lateral force bends a robot as much as a larger tension, because of its longer lever.
FORCE_PART = 0.05
GRAVITY = 9.81e-3  # N/g
STRIDES = 60
"""Steps from one end of a slider to the other."""
STRETCH = 10.0
"""Largest factor by which the end of a slider can be changed."""


@dataclass(frozen=True)
class ControlRanges:
    """Ends of the sliders of a robot; forces have both directions."""

    tension: tuple[float, ...]  # of each tendon [N]
    stroke: tuple[float, ...]  # of each tendon [mm]
    force: float  # at the tip [N]
    mass: float  # at the tip [g]

    def ends(self, number: int, by: str) -> tuple[float, float]:
        """Return the ends of the slider of one of the `Controls.numbers`, of a tendon `by`."""
        count = len(self.tension)
        if number < count:
            most = (self.tension if by == TENSION else self.stroke)[number]
            # While one tendon is pulled, another one is released.
            return (-most if by == STROKE and count > 1 else 0.0), most
        return (0.0, self.mass) if number == count + 3 else (-self.force, self.force)

    def stride(self, by: Sequence[str]) -> np.ndarray:
        """Return the largest step of each number of `Controls`; `by` is that of every tendon."""
        ends = [self.ends(tendon, one)[1] for tendon, one in enumerate(by)]
        return np.array([*ends, *[2.0 * self.force] * 3, self.mass]) / STRIDES

    def stretched(self, tendon: int, by: str, end: float) -> ControlRanges:
        """Return the same with another end of the slider of a tendon (from 0)."""
        ends = list(self.tension if by == TENSION else self.stroke)
        ends[tendon] = end
        return replace(self, **{by: tuple(ends)})


def reach_of(robot: Robot) -> ControlRanges:
    """Return the ranges of the sliders of a robot, found by pulling each of its tendons."""
    ends = [_pulled(robot, tendon) for tendon in range(robot.number_of_tendons)]
    tension, stroke = zip(*ends, strict=True)
    force = round_up(FORCE_PART * max(tension))
    return ControlRanges(tension, stroke, force, round_up(force / GRAVITY))


def round_up(value: float) -> float:
    """Return the next number above that is 1, 1.5, 2, 3, 4, 5, 6 or 8 times a power of ten.

    Example:
        >>> [round_up(value) for value in (0.031, 2.0, 9.0)]
        [0.04, 2.0, 10.0]
    """
    power = 10.0 ** math.floor(math.log10(value))
    factors = (1.0, 1.5, 2.0, 3.0, 4.0, 5.0, 6.0, 8.0, 10.0)
    factor = next(one for one in factors if one * power >= value * (1.0 - 1e-9))
    return float(f"{factor * power:.12g}")


def round_down(value: float) -> float:
    """Return the largest number of three digits that is not above.

    Example:
        >>> [round_down(value) for value in (3.7482, 0.0129, 15.0)]
        [3.74, 0.0129, 15.0]
    """
    unit = 10.0 ** (math.floor(math.log10(value)) - 2)
    return float(f"{math.floor(value / unit * (1.0 + 1e-9)) * unit:.12g}")


def _pulled(robot: Robot, tendon: int) -> tuple[float, float]:
    """Return tension and stroke at the ends of the sliders of a tendon, for the same bend."""
    tension, pulled, bent = FIRST, 0.0, False
    while tension < MOST and not bent:
        solved = _stroke(robot, tendon, tension)
        if solved is None:
            tension *= 0.5 if pulled > 0.0 else 1.0
            break
        pulled, bent = solved
        tension *= 1.0 if bent else 2.0
    end = round_up(ROOM * tension)
    last, _ = _stroke(robot, tendon, end) or (0.0, False)
    return end, round_down(last) if last > pulled else round_up(max(pulled, 1e-3))


def _stroke(robot: Robot, tendon: int, tension: float) -> tuple[float, bool] | None:
    """Return the stroke at a tension and whether the robot is well bent; None if not solved."""
    state = solve(robot, Load(tension=[None] * tendon + [tension]))
    if not state.converged:
        return None
    # With all its notches closed, a robot hardly bends further.
    can_close = np.isfinite(state.gap)
    closed = bool(can_close.any() and state.closed[can_close].all())
    # A backbone may bend to other sides than its notch angles tell.
    bend = max(np.abs(state.notch_angle).sum(), state.tip_axis_angle)
    return float(state.stroke[tendon]), closed or bend >= WELL_BENT
