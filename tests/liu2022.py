"""Variants of the ready robot of Liu 2022, and loads for them."""

from __future__ import annotations

from functools import cache

import numpy as np
from numpy.typing import ArrayLike

import notchflex as nf

# Readings of the cable's pull on the strip, by the numbers that the reference tables give them.
PATHS = {0: "straight", 1: "straight-dead", 2: "straight-dead", 3: "straight-follower"}
# All paths have as many steps, for which one program is compiled for each reading.
STEPS = 24


@cache
def liu(model: int, mu: float, turning: str = "chord") -> nf.Robot:
    """The robot in a reading: 0 pull along the gap, 1 small deflection, 2 dead, 3 follower.

    Args:
        model: Number of the reading.
        mu: Coefficient of friction.
        turning: "chord", the paper's friction, or "slope".
    """
    values: dict[str, object] = {"friction.coefficient": mu, "friction.turning": turning}
    values["tendon[*].path"] = PATHS[model]
    if model == 1:
        values["notch[*].deflection"] = "small"
    return nf.load_robot("liu2022").with_values(values)


def pulled(robot: nf.Robot, forces: ArrayLike) -> nf.EquilibriumPath:
    """Pull from rest through the tensions of one cable, or of both [N]."""
    rows = np.asarray(forces, dtype=float)
    assert len(rows) == STEPS
    return nf.simulate(robot, [nf.Load(tension=row.tolist()) for row in rows])


def force_for_chord(robot: nf.Robot, total: float, high: float = 12.0) -> float:
    """Tension of one cable at which the chord angles sum up to a total [rad], to 1e-7 N."""
    low = 0.0
    while high - low > 1e-7:
        forces = np.linspace(low, high, STEPS)
        path = pulled(robot, forces)
        assert path.converged.all(), path.reason
        above = int(np.searchsorted(path.total_chord_angle, total))
        assert 0 < above < STEPS
        low, high = float(forces[above - 1]), float(forces[above])
    return 0.5 * (low + high)
