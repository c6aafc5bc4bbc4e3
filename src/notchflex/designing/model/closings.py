"""Tensions that close the notches, and their derivatives.

The gap of a notch is zero at its closing tension T: 0 = gap(T, x). So
dT/dx = -(dgap/dx) / (dgap/dT), on the side where the notch is still open.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np
from jaxtyping import Float

from notchflex.analysis.closing_loads.closing import Closing
from notchflex.analysis.derivatives.forward_model import ForwardModel
from notchflex.analysis.derivatives.tangent import Change
from notchflex.loads import LoadPath
from notchflex.robot import Robot

# So much below its closing tension a notch is taken to be open, relative.
_BELOW = 1e-7


def closing_slopes(
    robot: Robot, table: Closing, changes: Callable[[ForwardModel, LoadPath], Sequence[Change]]
) -> Float[np.ndarray, "n v"]:
    """Differentiate the closing tension of every notch.

    Args:
        robot: The robot.
        table: Its closing; every notch closes.
        changes: Gives the direction of every variable for a model and its loads.

    Returns:
        Derivatives, N per unit of the variable.
    """
    count = len(table.tension)
    rows = np.arange(count)
    unit = np.zeros((count, robot.number_of_tendons))
    unit[rows, table.tendon - 1] = 1.0
    nothing = np.full_like(unit, np.nan)
    load = LoadPath((1.0 - _BELOW) * table.tension[:, None] * unit, nothing)
    model = ForwardModel(robot, load, from_rest=True)
    path = model.solve(robot, load)
    more = LoadPath(load.tension + unit, nothing)
    directions = list(changes(model, load))
    still = np.zeros(model.ready.long.chain_layout.size)
    directions.append(Change(model.load_change(path, more), still))
    by = model.derivatives(path, directions, ("gap",))["gap"][:, rows, rows]
    return -(by[:-1] / by[-1]).T
