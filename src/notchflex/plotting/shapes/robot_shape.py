"""The shape of a robot as it is drawn: in the frame of its clamped base, with smooth flexures."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

if TYPE_CHECKING:
    from notchflex import EquilibriumPath, Robot, RobotShape


Array = NDArray[np.float64]

# Integrates rotations of less than a radian along the way to 1e-12.
_NODES, _WEIGHTS = np.polynomial.legendre.leggauss(6)


def interpolate_poses(rotation: Array, position: Array, parts: int) -> tuple[Array, Array]:
    """Insert poses between k ones: rotations (..., k, 3, 3) and positions (..., k, 3).

    `parts` is the number of steps from each pose to the next one: (k - 1) parts + 1 poses.

    Example:
        >>> turned = np.array([[0.0, 0.0, 1.0], [0.0, 1.0, 0.0], [-1.0, 0.0, 0.0]])
        >>> line = np.eye(3)[[1, 0]] - np.eye(3)[1]
        >>> _, line = interpolate_poses(np.stack([np.eye(3), turned]), line, 2)
        >>> line.shape
        (3, 3)
    """
    if parts == 1:
        return rotation, position
    first, second = rotation[..., :-1, :, :], rotation[..., 1:, :, :]
    change = (np.swapaxes(first, -1, -2) @ second).reshape(-1, 3, 3)
    vector = Rotation.from_matrix(change).as_rotvec().reshape(*first.shape[:-1])
    step = np.einsum("...ba,...b->...a", first, np.diff(position, axis=-2))
    # The displacement is the mean rotation times the velocity of the twist.
    velocity = np.linalg.solve(_mean_rotation(vector), step[..., None])
    part = (np.arange(parts) / parts)[:, None, None]
    twist = part[..., 0] * vector[..., None, :]  # (..., k - 1, parts, 3)
    from_first = first[..., None, :, :]
    rotations = from_first @ rotation_of(twist)
    moved = from_first @ (_mean_rotation(twist) @ velocity[..., None, :, :]) * part
    positions = position[..., :-1, None, :] + moved[..., 0]
    rows, count = rotation.shape[:-3], rotations.shape[-4] * parts
    return (
        np.concatenate([rotations.reshape(*rows, count, 3, 3), rotation[..., -1:, :, :]], axis=-3),
        np.concatenate([positions.reshape(*rows, count, 3), position[..., -1:, :]], axis=-2),
    )


def rotation_of(vector: Array) -> Array:
    """Return the rotations (..., 3, 3) of rotation vectors (..., 3)."""
    return Rotation.from_rotvec(vector.reshape(-1, 3)).as_matrix().reshape(*vector.shape, 3)


def _mean_rotation(vector: Array) -> Array:
    """Return the mean rotation along a constant twist: the integral of exp(s w) over 0..1."""
    along = 0.5 * (1.0 + _NODES[:, None]) * vector[..., None, :]
    return np.einsum("i,...iab->...ab", 0.5 * _WEIGHTS, rotation_of(along))


FLEXURE_POINTS = 20  # a notch bends by less than a right angle; 2 degrees look smooth
UP = np.array([0.0, 0.0, 1.0])
HELD = 0.8  # length of clamped tube drawn below the base, in outer radii

Walls = list[tuple[float, float] | None]


def shape_at(path: EquilibriumPath, step: int, pieces: int = FLEXURE_POINTS) -> RobotShape:
    """Return the shape of a robot at one step of a path; for `pieces` see `smooth`."""
    return smooth(path[step].shape.from_base(), pieces)


def shape_from_angles(
    robot: Robot, notch_angle: Array, pieces: int = FLEXURE_POINTS, level: str = "tendons"
) -> RobotShape:
    """Return the shape of a robot whose notches have given angles [rad], (n,).

    For `pieces` see `smooth`, for `level` `Geometry.shape`.
    """
    return smooth(robot.geometry.shape(notch_angle, level), pieces)


def smooth(shape: RobotShape, pieces: int) -> RobotShape:
    """Return a shape whose flexures have at least so many straight pieces, (n,)."""
    flexures = list(shape.flexures)
    counts = np.array([len(one.area) for one in flexures])
    for count in np.unique(counts):  # flexures with the same number of sections together
        same_count = np.flatnonzero(counts == count)
        parts = -(-pieces // (int(count) - 1))
        some = [flexures[j] for j in same_count]
        rotation, position = interpolate_poses(
            np.stack([one.rotation for one in some]),
            np.stack([one.position for one in some]),
            parts,
        )
        at = np.arange(position.shape[1]) / parts
        for j, one, turned, points in zip(same_count, some, rotation, position, strict=True):
            widths = (np.interp(at, np.arange(count), x) for x in (one.spine, one.near, one.area))
            flexures[j] = type(one)(turned, points, *widths)
    return replace(shape, flexures=tuple(flexures))


def walls(robot: Robot, side_deg: float) -> Walls:
    """Return the ends of the wall of each body on a side [mm in its frame]; None if no wall."""
    base, *others = robot.geometry.walls(side_deg)
    assert base is not None
    # What is fixed in the last body may enter it beyond its far face.
    ends = [None if one is None else (min(one), max(one)) for one in others]
    return [(-HELD * robot.tube.outer_radius, base[1]), *ends]


def tendon_line(shape: RobotShape, number: int) -> Array:
    """Return the line of a tendon (from 0) from below the base."""
    line = shape.tendon(number)
    line[0] -= HELD * shape.robot.tube.outer_radius * UP
    return line


def lips(shape: RobotShape, notch: int, radius: float | None = None) -> Array:
    """Return the point midway between the edges of a notch (from 0) that meet when it closes.

    It lies at a radius [mm] from the tube axis, by default the outer one.
    """
    outer = shape.robot.tube.outer_radius if radius is None else radius
    candidates: list[tuple[float, Array]] = []
    for turn in (0.0, 180.0):
        side = shape.robot.notches[notch].direction_deg + turn
        ends = walls(shape.robot, side)
        behind = ends[notch + 1]
        if behind is None:
            continue
        before = max(body for body in range(notch + 1) if ends[body] is not None)
        last = ends[before]
        assert last is not None
        angle = np.radians(side)
        across = outer * np.array([np.cos(angle), np.sin(angle), 0.0])
        first = shape.on_body(before, across + last[1] * UP)
        second = shape.on_body(notch + 1, across + behind[0] * UP)
        candidates.append((float(np.linalg.norm(second - first)), 0.5 * (first + second)))
    return min(candidates, key=lambda item: item[0])[1]
