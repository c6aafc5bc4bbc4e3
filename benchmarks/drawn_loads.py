"""Random numbers, and random paths of loads for a robot that is drawn already.

Loads are sized by the robot: by the tension that would close its softest notch, were it linear and
alone, and by the moment for that.
"""

from __future__ import annotations

from math import pi, radians
from typing import NamedTuple

import numpy as np
from shapes import Shape

import notchflex as nf

UNUSUAL = 0.1  # part of the numbers that comes from the wider range


class Size(NamedTuple):
    """How a notch alone answers: angle of closing (rad), moment for it (N mm), lever (mm)."""

    angle: float
    moment: float
    lever: float


class Numbers:
    """Random numbers, most of them usual, a few not."""

    def __init__(self, generator: np.random.Generator) -> None:
        self.generator = generator

    def usual(self, low: float, high: float, least: float, most: float) -> float:
        """Uniform between low and high, at times between least and most."""
        if self.chance(UNUSUAL):
            return float(self.generator.uniform(least, most))
        return float(self.generator.uniform(low, high))

    def uniform(self, low: float, high: float) -> float:
        """Uniform between low and high."""
        return float(self.generator.uniform(low, high))

    def log(self, low: float, high: float) -> float:
        """Uniform in the logarithm."""
        return float(np.exp(self.generator.uniform(np.log(low), np.log(high))))

    def chance(self, part: float) -> bool:
        """True so often."""
        return bool(self.generator.uniform() < part)

    def choice(self, values: tuple) -> object:
        """One of some values, each as often as the others."""
        return values[self.generator.integers(len(values))]

    def direction(self, in_space: bool) -> np.ndarray:
        """Unit vector, in the x-z plane or anywhere."""
        vector = self.generator.normal(size=3)
        vector[1] *= in_space
        return vector / np.linalg.norm(vector)


def drawn_loads(
    numbers: Numbers, shape: Shape, robot: nf.Robot, sizes: list[Size]
) -> tuple[nf.Load, ...]:
    """One to four loads; each later one pulls on, lets go, or holds, and so do other loads."""
    steps = int(numbers.generator.integers(1, 5))
    pulled = _tendon_values(numbers, robot, sizes)
    others = _external(numbers, shape, robot, sizes)
    pull, push = 1.0, 1.0
    every = []
    for _ in range(steps):
        tension = [None if value is None else pull * value for value in pulled[0]]
        stroke = [None if value is None else pull * value for value in pulled[1]]
        every.append(nf.Load(tension=tension, stroke=stroke, **others(push)))
        pull = numbers.choice((pull, numbers.uniform(0.0, 1.3), 0.0))
        push = numbers.choice((push, push, numbers.uniform(0.1, 1.2)))
    return tuple(every)


def _tendon_values(
    numbers: Numbers, robot: nf.Robot, sizes: list[Size]
) -> tuple[list[float | None], list[float | None]]:
    """Tensions up to 1.3 times the one that closes the softest notch; at times one stroke.

    The stroke is up to 85 % of what the tendon would be drawn by that tension over notches that
    are linear up to their closing. Of opposite tendons only one is drawn: two could not both be.
    """
    count = robot.number_of_tendons
    closes = min(size.moment / size.lever for size in sizes)
    most = numbers.log(0.02, 1.3) * closes
    tension: list[float | None] = [most]
    stroke: list[float | None] = [None] * count
    for _ in range(1, count):
        tension.append(numbers.choice((None, most * numbers.uniform(0.0, 1.0))))
    if numbers.chance(0.3):
        first = robot.tendon[0]
        reach = 0.0
        for notch, size in zip(robot.notches, sizes, strict=True):
            toward = np.cos(radians(first.direction_deg - notch.direction_deg))
            lever = max(size.lever - first.radius * (1.0 - toward), 0.0)
            reach += lever * size.angle * min(closes * lever / size.moment, 1.0)
        tension[0], stroke[0] = None, numbers.uniform(0.02, 0.85) * float(reach)
    return tension, stroke


def _external(numbers: Numbers, shape: Shape, robot: nf.Robot, sizes: list[Size]):
    """Loads beside the tendons as a function of their part; nothing where tendons act alone."""
    if shape.loads == "tendons":
        return lambda _: {}
    space = shape.loads == "space"
    lengths = [notch.height + notch.spacing(None) for notch in robot.notches]
    whole = robot.tube.base_length + sum(lengths)
    moment = numbers.log(0.01, 1.0) * min(size.moment for size in sizes)
    force = moment / whole
    tip_force = force * numbers.direction(space)
    # In the plane a moment turns about its normal, y; in space about anything.
    about = numbers.direction(True) if space else np.array([0.0, numbers.choice((-1.0, 1.0)), 0.0])
    tip_moment = (0.5 * moment * about) if numbers.chance(0.3) else np.zeros(3)
    following = numbers.chance(0.2)
    mass = 1e3 * force / 9.81 if numbers.chance(0.3) else 0.0
    gravity = tuple(9.81 * numbers.direction(space)) if numbers.chance(0.3) else None
    turned = (0.0, pi * numbers.uniform(-0.5, 0.5), 0.0) if numbers.chance(0.2) else (0.0,) * 3
    body = int(numbers.generator.integers(1, robot.number_of_notches + 1))
    on_body = 0.5 * force * numbers.direction(space) if numbers.chance(0.2) else None

    def at(part: float) -> dict[str, object]:
        forces = [] if on_body is None else [nf.BodyForce(body, tuple(part * on_body))]
        return {
            "tip_force": tuple(part * tip_force),
            "tip_moment": tuple(part * tip_moment),
            "following": following,
            "tip_mass": part * mass,
            "gravity": gravity,
            "base_rotation": turned,
            "body_forces": forces,
        }

    return at
