"""How far sliders go: far enough to bend a robot well, in round numbers."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from notchflex.analysis import solve
from notchflex.loads import Load
from notchflex.robot import Robot
from notchflex.viewer.controls import STROKE, TENSION

# Tensions from 1/64 N on are tried, each twice the one before, until the robot is well bent; a
# slider goes half as far again.
FIRST, MOST = 2.0**-6, 2.0**12
WELL_BENT = math.radians(60.0)
ROOM = 1.5
# A force across a robot bends it as much as its tendon with a small part of the tension, because
# its lever is the length of the robot and not its radius.
FORCE_PART = 0.05
GRAVITY = 9.81e-3  # N/g
STRIDES = 60
"""Steps from one end of a slider to the other."""
STRETCH = 10.0
"""A slider can be made to go as many times as far as at first, or as many times less far."""


@dataclass(frozen=True)
class Reach:
    """Ends of the sliders of a robot of t tendons; those of forces go as far both ways.

    Attributes:
        tension: Of each tendon, N, (t,).
        stroke: Of each tendon, mm, (t,).
        force: At the tip, N.
        mass: At the tip, g.
    """

    tension: tuple[float, ...]
    stroke: tuple[float, ...]
    force: float
    mass: float

    def ends(self, number: int, by: str) -> tuple[float, float]:
        """Return the ends of the slider of a number of `Controls`.

        Args:
            number: Its place in `Controls.numbers`.
            by: `TENSION` or `STROKE`, where it is a tendon's.
        """
        count = len(self.tension)
        if number < count:
            most = (self.tension if by == TENSION else self.stroke)[number]
            # Drawn on one side, a tendon on the other is let out.
            return (-most if by == STROKE and count > 1 else 0.0), most
        return (0.0, self.mass) if number == count + 3 else (-self.force, self.force)

    def stride(self, by: Sequence[str]) -> np.ndarray:
        """Return the largest step of each number of `Controls`.

        Args:
            by: `TENSION` or `STROKE` for every tendon.
        """
        ends = [self.ends(tendon, one)[1] for tendon, one in enumerate(by)]
        return np.array([*ends, *[2.0 * self.force] * 3, self.mass]) / STRIDES

    def stretched(self, tendon: int, by: str, end: float) -> Reach:
        """Return the same with another end of the slider of a tendon (from 0)."""
        ends = list(self.tension if by == TENSION else self.stroke)
        ends[tendon] = end
        return replace(self, **{by: tuple(ends)})


def reach_of(robot: Robot) -> Reach:
    """Find out how far the sliders of a robot should go, by pulling each of its tendons."""
    ends = [_pulled(robot, tendon) for tendon in range(robot.number_of_tendons)]
    tension, stroke = zip(*ends, strict=True)
    force = round_up(FORCE_PART * max(tension))
    return Reach(tension, stroke, force, round_up(force / GRAVITY))


def round_up(value: float) -> float:
    """The next number above that is 1, 1.5, 2, 3, 4, 5, 6 or 8 times a power of ten.

    Example:
        >>> [round_up(value) for value in (0.031, 2.0, 9.0)]
        [0.04, 2.0, 10.0]
    """
    power = 10.0 ** math.floor(math.log10(value))
    for factor in (1.0, 1.5, 2.0, 3.0, 4.0, 5.0, 6.0, 8.0):
        if factor * power >= value * (1.0 - 1e-9):
            return float(f"{factor * power:.12g}")
    return float(f"{10.0 * power:.12g}")


def _pulled(robot: Robot, tendon: int) -> tuple[float, float]:
    """Tension and stroke at the ends of the sliders of a tendon, which bend the robot as far."""
    tension, drawn = FIRST, 0.0
    while tension <= MOST:
        found = _stroke(robot, tendon, tension)
        if found is None:
            tension *= 0.5 if drawn > 0.0 else 1.0
            break
        drawn, bent = found
        if bent:
            break
        tension *= 2.0
    end = round_up(ROOM * min(tension, MOST))
    found = _stroke(robot, tendon, end)
    return end, round_down(found[0]) if found and found[0] > drawn else round_up(max(drawn, 1e-3))


def round_down(value: float) -> float:
    """The largest number of three digits that is not above.

    Example:
        >>> [round_down(value) for value in (3.7482, 0.0129, 15.0)]
        [3.74, 0.0129, 15.0]
    """
    unit = 10.0 ** (math.floor(math.log10(value)) - 2)
    return float(f"{math.floor(value / unit * (1.0 + 1e-9)) * unit:.12g}")


def _stroke(robot: Robot, tendon: int, tension: float) -> tuple[float, bool] | None:
    """Stroke at a tension and whether the robot is well bent there; None without a solution."""
    state = solve(robot, Load(tension=[None] * tendon + [tension]))
    if not state.converged:
        return None
    well = np.abs(state.notch_angle).sum() >= WELL_BENT or _closed(state.closed, state.gap)
    return float(state.stroke[tendon]), bool(well)


def _closed(closed: np.ndarray, gap: np.ndarray) -> bool:
    """Whether every notch that can close has closed: more tension hardly bends it further."""
    can = np.isfinite(gap)
    return bool(can.any() and closed[can].all())


__all__ = ["STRETCH", "STRIDES", "Reach", "reach_of", "round_down", "round_up"]
