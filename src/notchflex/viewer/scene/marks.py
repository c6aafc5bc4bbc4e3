"""Tendons, and marks of their contacts and of closed notches.

Marks lie outside the tube, where the wall does not hide them.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from notchflex.plotting.shapes.robot_shape import RobotShape
from notchflex.results import EquilibriumPath
from notchflex.viewer.scene.colours import CLOSED, TENDON, UNKNOWN, contact_colours, linear

# In outer radii of the tube: thickness of tendons, radius of marks, distance of their centres from
# the tube axis.
_TENDON, _CONTACT, _LIPS = 0.09, 0.13, 0.2
_CONTACT_AT, _LIPS_AT = 1.2, 1.55


@dataclass
class Shown:
    """What is visible in the scene."""

    tendons: bool = True
    contacts: bool = True
    frames: bool = True
    loads: bool = True
    see_through: bool = False


class Marks:
    """Tendons and marks of a robot in a scene of viser.

    Args:
        scene: The scene.
        root: Name of the parent node.
        rest: The shape of the robot at rest.
    """

    def __init__(self, scene: Any, root: str, rest: RobotShape) -> None:
        """Add them."""
        import trimesh

        self._outer = outer = rest.robot.tube.outer_radius
        ball = trimesh.creation.icosphere(subdivisions=2, radius=_CONTACT * outer)
        tendons = range(rest.robot.number_of_tendons)
        self._tendons = [
            scene.add_line_segments(
                f"{root}/tendon_{number + 1}",
                _segments(rest.tendon(number)),
                TENDON,
                thickness=_TENDON * outer,
            )
            for number in tendons
        ]
        places = [self._beside(rest, number) for number in tendons]
        self._contacts = [
            scene.add_batched_meshes_simple(
                f"{root}/contacts_{number + 1}",
                ball.vertices,
                ball.faces,
                batched_wxyzs=np.tile([1.0, 0.0, 0.0, 0.0], (len(place), 1)),
                batched_positions=place,
                batched_colors=linear([UNKNOWN] * len(place)),
                lod="off",
            )
            for number, place in enumerate(places)
        ]
        self._closed = [
            scene.add_icosphere(f"{root}/closed_{number + 1}", _LIPS * outer, color=CLOSED)
            for number in range(len(rest.flexures))
        ]

    def _beside(self, shape: RobotShape, tendon: int) -> NDArray[np.float32]:
        """Return the positions of the contact marks of a tendon (from 0)."""
        return shape.contacts(tendon, _CONTACT_AT * self._outer).astype(np.float32)

    def move(self, path: EquilibriumPath, shape: RobotShape, shown: Shown) -> None:
        """Move them to a new state.

        Args:
            path: The state, as a path of one step.
            shape: The shape of the robot in that state.
            shown: What is visible.
        """
        for number, (line, balls) in enumerate(zip(self._tendons, self._contacts, strict=True)):
            line.visible, balls.visible = shown.tendons, shown.contacts
            if shown.tendons:
                line.points = _segments(shape.tendon(number)).astype(np.float32)
            if shown.contacts:
                balls.batched_positions = self._beside(shape, number)
                codes = contact_colours(path[0], number)
                balls.batched_colors = linear(codes)
        for number, (ball, closed) in enumerate(zip(self._closed, path.closed[0], strict=True)):
            ball.visible = bool(closed)
            if closed:
                ball.position = shape.lips(number, _LIPS_AT * self._outer)


def _segments(points: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the straight pieces between points, (pieces, 2, 3)."""
    return np.stack([points[:-1], points[1:]], axis=1)
