"""Where a camera stands so that points fill its picture."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

Vector = NDArray[np.float64]

FOV = np.radians(75.0)
"""Angle of view of the page from its lower to its upper edge, rad: that of viser."""


class Eye(NamedTuple):
    """A camera.

    Attributes:
        position: Where it stands, mm.
        target: The point in the middle of its picture, mm.
    """

    position: Vector
    target: Vector

    @property
    def rotation(self) -> Vector:
        """Axes of its picture as columns: right, down, forward; with z of the world upward."""
        forward, right, up = _axes(self.position - self.target)
        return np.stack([right, -up, forward], axis=1)


def framed(
    points: Vector, toward: Vector, aspect: float, fov: float = FOV, room: float = 1.0
) -> Eye:
    """Return a camera that sees points as large as they can be seen, in the middle.

    Args:
        points: What is to be seen, mm, (p, 3).
        toward: Direction from the points to the camera, not along z.
        aspect: Width of the picture by its height.
        fov: Angle of view from the lower to the upper edge, rad.
        room: How many times as large as the points the picture is.

    Example:
        >>> wall = np.array([[-1.0, 0.0, -1.0], [1.0, 0.0, 1.0]])
        >>> framed(wall, np.array([0.0, -1.0, 0.0]), 1.0, np.pi / 2).position.round(9) + 0.0
        array([ 0., -1.,  0.])
    """
    forward, right, up = _axes(toward)
    axes = np.stack([right, up, forward])
    own = points @ axes.T
    middle = 0.5 * (own.min(axis=0) + own.max(axis=0))
    x, y, depth = (own - middle).T
    slope = np.tan(0.5 * fov)
    # A point that is nearer must be as far inside the edges of the picture.
    away = room * np.maximum(np.abs(x) / (slope * aspect), np.abs(y) / slope) - depth
    return Eye((middle - float(away.max()) * np.array([0.0, 0.0, 1.0])) @ axes, middle @ axes)


def first_eye(direction_deg: float, length: float, turn: Vector, side: bool, aspect: float) -> Eye:
    """Return a camera that sees a robot at rest, with room for it to bend.

    Args:
        direction_deg: Direction in which it bends.
        length: Its length, mm.
        turn: Rotation of its base, (3, 3).
        side: Look at right angles on the plane in which it bends; else a little from above.
        aspect: Width of the picture by its height.
    """
    angle = np.radians(direction_deg)
    across = np.array([np.cos(angle), np.sin(angle), 0.0])
    along = np.array([0.0, 0.0, 1.0])
    # RobotShape to either side it is about half as wide as it is long.
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
    """Forward, right and up of a camera that looks against `toward`."""
    forward = -toward / np.linalg.norm(toward)
    right = np.cross(forward, [0.0, 0.0, 1.0])
    right = right / np.linalg.norm(right)
    return forward, right, np.cross(right, forward)


__all__ = ["FOV", "Eye", "first_eye", "framed", "quaternions"]
