"""A mesh of half a notched tube that bends in one plane.

The tube is cut by the plane in which it bends; z runs along it, the notches open toward +x and
the half with y >= 0 is meshed. Angles are counted from the spine (-x).
"""

from __future__ import annotations

import numpy as np
from jaxtyping import Float

from notchflex.export.finite_elements.layers import check_shape, edge_angle, layers_of
from notchflex.export.finite_elements.options import DeckOptions
from notchflex.export.finite_elements.tube_mesh import GridOpening, TubeMesh, numbered
from notchflex.robot import Robot


def half_tube(robot: Robot, options: DeckOptions) -> TubeMesh:
    """Mesh half of a robot.

    Raises:
        InputError: The robot has another shape than the mesh can have.
    """
    notches = check_shape(robot)
    height, edges_at, faces = layers_of(robot, notches, options)
    radius = np.linspace(robot.tube.inner_radius, robot.tube.outer_radius, 2 * options.wall + 1)
    edge = np.stack([edge_angle(notch, robot, radius) for notch in notches])  # (n, radii)
    # Between two notches the lines go over from the edge of one to that of the next.
    edge = np.repeat(edge, 2, axis=0)
    at = np.stack([np.interp(height, edges_at, each) for each in edge.T])
    to_edge = 1.0 - _graded(2 * options.spine)[::-1]
    beyond = _graded(2 * options.opening)[1:]
    angle = np.concatenate(
        [to_edge[:, None, None] * at, at + beyond[:, None, None] * (np.pi - at)]
    ).transpose(1, 0, 2)
    position = np.stack(
        [
            -radius[:, None, None] * np.cos(angle),
            radius[:, None, None] * np.sin(angle),
            np.broadcast_to(height, angle.shape),
        ],
        axis=-1,
    )
    openings = [GridOpening(2 * options.spine, options.opening, low, high) for low, high in faces]
    x_deg = notches[0].direction_deg
    return numbered(position, height, openings, is_half=True, x_deg=x_deg)


def _graded(count: int) -> Float[np.ndarray, " k"]:
    """Places from 0 to 1, closer at 0; middle nodes half way between corners."""
    corner = np.linspace(0.0, 1.0, count // 2 + 1) ** 1.4
    return np.interp(np.arange(count + 1), np.arange(0, count + 1, 2), corner)
