"""The model at every row: each from rest, or the rows of each pull as one loading path."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from notchflex.analysis import simulate, solve_each
from notchflex.fit.measurements.measurements import rows_of
from notchflex.loads import LoadPath
from notchflex.robot import Robot

if TYPE_CHECKING:
    from notchflex.results import EquilibriumPath


def solved_rows(
    robot: Robot,
    load: LoadPath,
    pull: Sequence[str],
    from_rest: bool,
    read: Callable[[EquilibriumPath], Mapping[str, NDArray[Any]]],
) -> dict[str, NDArray[Any]]:
    """Solve every row and return what is read from the solved states.

    Args:
        robot: The robot.
        load: P steps.
        pull: Label of the pull of every step.
        from_rest: True if every step is loaded from rest, False if each pull is one path.
        read: Takes arrays by name, steps as leading axis, from solved states; it sees states that
            did not converge too.

    Returns:
        By name, P rows as leading axis.
    """
    if from_rest:
        return dict(read(solve_each(robot, load)))
    made: dict[str, NDArray[Any]] = {}
    labels = np.array(pull)
    for label in dict.fromkeys(pull):
        rows = np.flatnonzero(labels == label)
        for name, part in read(simulate(robot, rows_of(load, rows))).items():
            whole = made.setdefault(name, np.empty((len(load), *part.shape[1:]), part.dtype))
            whole[rows] = part
    return made


__all__ = ["solved_rows"]
