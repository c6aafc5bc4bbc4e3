"""Loads of tendons that share spools."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from notchflex.analysis.solve import solve
from notchflex.errors import InputError
from notchflex.loads import LoadPath
from notchflex.loads.load import check_is_robot, check_table
from notchflex.robot import Robot


def spool_path(
    robot: Robot,
    ways: ArrayLike,
    *,
    base_rotation: Sequence[float] | np.ndarray = (0.0, 0.0, 0.0),
    **external: Any,
) -> LoadPath:
    """Return the loads of the tendons where the spools of a robot turn.

    The first step has the pretension of every spool. From the strokes of that state, on the side of
    the drives, a spool draws one tendon by its way and releases the other by as much.

    Args:
        robot: A robot with `drive` in its description.
        ways: Ways of the spools, mm: steps by spools, NaN for one that stands at 0; of a single
            spool a list of steps.
        base_rotation: Rotation vector of the base in the world, rad.
        external: Loads of all steps, by their names in `LoadPath.loaded`. The spools stand at 0
            where the pretension is under these.

    Returns:
        The path: the pretension, then a step for each row of `ways`. Other tendons hang slack.

    Raises:
        InputError: The robot has no spool, or there are ways of more or fewer; no state has the
            pretension.

    Example:
        >>> from notchflex import load_robot, simulate
        >>> from notchflex.robot import Drive
        >>> robot = load_robot("two-axis-wrist").with_value("tendon.axial_stiffness", 2000.0)
        >>> robot = robot.replace(drive=(Drive(tendon=1, antagonist=2, pretension=0.2),))
        >>> path = simulate(robot, spool_path(robot, [0.0, 0.1]))
        >>> path.converged.tolist()
        [True, True, True]
    """
    drives = check_is_robot(robot).drive
    if not drives:
        raise InputError.NO_DATA(f"{robot.name} has no spool; give [[drive]] in its robot file")
    table = check_table(ways, "the ways of spools")
    table = np.where(np.isnan(table), 0.0, table)
    table = table[:, None] if table.ndim == 1 else table
    if table.ndim != 2 or table.shape[1] != len(drives):
        raise InputError.WRONG_SHAPE(
            f"ways of spools are numbers, steps by {len(drives)} spools; got {table.shape}"
        )
    tension, stroke = np.full((2, len(table) + 1, robot.number_of_tendons), np.nan)
    both = np.array([(drive.tendon, drive.antagonist) for drive in drives]) - 1
    tension[0, both] = [[drive.pretension] for drive in drives]
    path = LoadPath(tension, stroke, np.array(base_rotation)).loaded(**external)
    state = solve(robot, path[0])
    if not state.converged:
        raise InputError.NOT_CONVERGED(
            f"no state of {robot.name} has the pretension of its spools: {state.reason}; give a "
            "smaller drive.pretension"
        )
    stroke[1:, both] = state.stroke[both] + table[..., None] * [1.0, -1.0]
    return replace(path, stroke=stroke)
