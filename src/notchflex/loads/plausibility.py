"""Loads that were probably not meant, such as mN typed as N."""

from collections.abc import Mapping
from math import hypot, pi

import numpy as np

from notchflex.errors import InputWarning
from notchflex.loads.external import HANGING, NO_VECTOR, NOTHING
from notchflex.loads.load_path import LoadPath
from notchflex.mechanics.chain import Chain
from notchflex.robot.problems import unlikely

# Largest usual forces in forces that close a notch, and strokes in lengths of the robot: far more
# than any use, and less than a slip of the unit. What is less has a reason if it fails.
_MOST_FORCES, _MOST_LENGTHS = 100.0, 5.0
_MOST_GRAVITY = 100.0  # m/s2
_ONE_TURN = 2.0 * pi * (1.0 + 1e-9)  # rad, and what rounding adds


def usual_loads(chain: Chain) -> dict[str, tuple[float, str]]:
    """Return the largest usual size of each kind of load, and its unit."""
    force = _MOST_FORCES * float(chain.closing_force)
    length = float(np.sum(chain.body_length) + np.sum(chain.rods.length))
    mass = 1e3 * force / abs(HANGING[2])
    return {
        "tension": (force, "N"),
        "stroke": (_MOST_LENGTHS * length, "mm"),
        "tip_force": (force, "N"),
        "tip_moment": (force * length, "N mm"),
        "body_forces": (force, "N"),
        "tip_mass": (mass, "g"),
        "gravity": (_MOST_GRAVITY, "m/s2"),
        "base_rotation": (_ONE_TURN, "rad"),
    }


def unlikely_loads(load: LoadPath, usual: Mapping[str, tuple[float, str]]) -> list[InputWarning]:
    """Return a warning for each kind of load that is far beyond a robot (`usual_loads`)."""
    # Every solve comes by: lists are faster than arrays of one number; NaN is never above a limit.
    largest = {
        "tension": max([0.0, *load.tension.ravel().tolist()]),
        "base_rotation": hypot(*load.base_rotation.tolist()),
    }
    if load.draws:
        largest["stroke"] = max([0.0, *map(abs, load.stroke.ravel().tolist())])
    for one in load.different:
        if one is not NOTHING:
            sizes = {
                "tip_force": hypot(*one.tip_force),
                "tip_moment": hypot(*one.tip_moment),
                "body_forces": max((hypot(*each.force) for each in one.body_forces), default=0.0),
                "tip_mass": one.tip_mass,
                "gravity": hypot(*(one.gravity or NO_VECTOR)),
            }
            for name, size in sizes.items():
                largest[name] = max(largest.get(name, 0.0), size)
    return [
        unlikely(name, float(size), (0.0, float(f"{usual[name][0]:.2g}")), usual[name][1])
        for name, size in largest.items()
        if size > usual[name][0]
    ]
