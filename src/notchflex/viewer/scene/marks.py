"""Tendons, and marks of their contacts and of closed notches, outside the tube that hides them."""

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
    """Tendons and marks of a robot at rest as children of a node of a viser scene."""

    def __init__(self, scene: Any, root: str, rest: RobotShape) -> None:
        import trimesh

        self._outer = outer = rest.robot.tube.outer_radius
        ball = trimesh.creation.icosphere(subdivisions=2, radius=_CONTACT * outer)
        self._tendons: list[Any] = []
        self._contacts: list[Any] = []
        for tendon in range(rest.robot.number_of_tendons):
            name, line = f"{root}/tendon_{tendon + 1}", _segments(rest, tendon)
            thick = _TENDON * outer
            self._tendons.append(scene.add_line_segments(name, line, TENDON, thickness=thick))
            points = self._beside(rest, tendon)
            self._contacts.append(
                scene.add_batched_meshes_simple(
                    f"{root}/contacts_{tendon + 1}",
                    ball.vertices,
                    ball.faces,
                    batched_wxyzs=np.tile([1.0, 0.0, 0.0, 0.0], (len(points), 1)),
                    batched_positions=points,
                    batched_colors=linear([UNKNOWN] * len(points)),
                    lod="off",
                )
            )
        self._closed = [
            scene.add_icosphere(f"{root}/closed_{number + 1}", _LIPS * outer, color=CLOSED)
            for number in range(len(rest.flexures))
        ]

    def _beside(self, shape: RobotShape, tendon: int) -> NDArray[np.float32]:
        return shape.contacts(tendon, _CONTACT_AT * self._outer).astype(np.float32)

    def move(self, path: EquilibriumPath, shape: RobotShape, shown: Shown) -> None:
        """Move them to the state of a path of one step, with its shape."""
        for tendon, (line, balls) in enumerate(zip(self._tendons, self._contacts, strict=True)):
            line.visible, balls.visible = shown.tendons, shown.contacts
            if shown.tendons:
                line.points = _segments(shape, tendon)
            if shown.contacts:
                balls.batched_positions = self._beside(shape, tendon)
                balls.batched_colors = linear(contact_colours(path[0], tendon))
        for notch, (ball, closed) in enumerate(zip(self._closed, path.closed[0], strict=True)):
            ball.visible = bool(closed)
            if closed:
                ball.position = shape.lips(notch, _LIPS_AT * self._outer)


def _segments(shape: RobotShape, tendon: int) -> NDArray[np.float32]:
    """Return the straight pieces of a tendon (from 0), (pieces, 2, 3)."""
    points = shape.tendon(tendon).astype(np.float32)
    return np.stack([points[:-1], points[1:]], axis=1)
