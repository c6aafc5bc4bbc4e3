"""Places a camera so that points fill its picture."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

Vector = NDArray[np.float64]

FOV = np.radians(75.0)
"""Vertical angle of view of viser [rad]."""


class CameraPose(NamedTuple):
    """Position of a camera and the point in the centre of its picture [mm]."""

    position: Vector
    target: Vector

    @property
    def rotation(self) -> Vector:
        """Its axes as columns: right, down, forward; z of the world is up."""
        forward, right, up = _axes(self.position - self.target)
        return np.stack([right, -up, forward], axis=1)


def framed(
    points: Vector, toward: Vector, aspect: float, fov: float = FOV, room: float = 1.0
) -> CameraPose:
    """Return a camera that shows points [mm], (p, 3), as large as possible.

    It stands in the direction `toward`, not along z, and has a vertical angle of view `fov` [rad]
    and a picture with width / height `aspect`; `room` is the size of the picture in that of the
    points.

    Example:
        >>> wall = np.array([[-1.0, 0.0, -1.0], [1.0, 0.0, 1.0]])
        >>> framed(wall, np.array([0.0, -1.0, 0.0]), 1.0, np.pi / 2).position.round(9) + 0.0
        array([ 0., -1.,  0.])
    """
    forward, right, up = _axes(toward)
    axes = np.stack([right, up, forward])
    projected = points @ axes.T
    middle = 0.5 * (projected.min(axis=0) + projected.max(axis=0))
    x, y, depth = (projected - middle).T
    slope = np.tan(0.5 * fov)
    # Near points must lie inside the edges of the picture too.
    away = room * np.maximum(np.abs(x) / (slope * aspect), np.abs(y) / slope) - depth
    return CameraPose(
        (middle - float(away.max()) * np.array([0.0, 0.0, 1.0])) @ axes, middle @ axes
    )


def first_eye(
    direction_deg: float, length: float, turn: Vector, side: bool, aspect: float
) -> CameraPose:
    """Return a camera for a robot at rest of a length [mm], with room to bend in a direction.

    `turn` is the rotation of its base. With `side` it looks normal to the plane in which the robot
    bends, else a little from above.
    """
    angle = np.radians(direction_deg)
    across = np.array([np.cos(angle), np.sin(angle), 0.0])
    along = np.array([0.0, 0.0, 1.0])
    # To either side it is about half as wide as it is long.
    corners = [across * x + along * z for x in (-0.2, 0.75) for z in (-0.15, 1.05)]
    toward = turn @ np.cross(across, along)
    if abs(toward[2]) > 0.9:  # its plane is level: from the front
        toward = np.array([0.0, -1.0, 0.0])
    if not side:
        toward = toward + 0.3 * np.cross(along, toward) + 0.35 * along
    return framed(length * np.stack(corners) @ turn.T, toward, aspect, room=1.15)


def quaternions(rotation: Vector) -> Vector:
    """Return rotations (r, 3, 3) as (w, x, y, z)."""
    import viser.transforms as transforms

    return np.asarray(transforms.SO3.from_matrix(rotation).wxyz, np.float64)


def _axes(toward: Vector) -> tuple[Vector, Vector, Vector]:
    """Return forward, right and up of a camera that looks against `toward`."""
    forward = -toward / np.linalg.norm(toward)
    right = np.cross(forward, [0.0, 0.0, 1.0])
    right = right / np.linalg.norm(right)
    return forward, right, np.cross(right, forward)
