"""Which mesh a robot gets: half of the tube where it bends in its plane, else the whole."""

from __future__ import annotations

from collections.abc import Sequence

from notchflex.export.finite_elements.half_tube import half_tube
from notchflex.export.finite_elements.options import DeckOptions
from notchflex.export.finite_elements.tube_mesh import TubeMesh
from notchflex.export.finite_elements.whole_tube import whole_tube
from notchflex.robot import ArcNotch, Robot

# Directions that differ by less are the same, deg.
_SAME = 1e-6


def mesh_of(robot: Robot, options: DeckOptions, tendons: Sequence[int] = (0,)) -> TubeMesh:
    """Mesh a robot.

    Args:
        robot: The robot.
        options: The mesh.
        tendons: The tendons that are pulled, from 0.

    Raises:
        InputError: The robot has another shape than a mesh can have.
    """
    arcs = [one for one in robot.notches if isinstance(one, ArcNotch)]
    sides = [one.direction_deg for one in arcs]
    sides += [robot.tendon[number].direction_deg for number in tendons]
    if all(abs((side - sides[0] + 180.0) % 360.0 - 180.0) < _SAME for side in sides):
        return half_tube(robot, options)
    return whole_tube(robot, options, tendons)
