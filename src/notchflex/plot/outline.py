"""The outline of a bent robot, to scale, as seen from the side.

A view looks across the tube: its horizontal axis is the tube axis of the base turned up, its other
axis a direction across the base. Bodies are rectangles as wide as the tube; what a cut leaves is a
bent strip, as wide as the remaining section is in that view.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from notchflex.robot import Robot

ARC_POINTS = 17  # a notch bends by less than a right angle; 2 degrees a piece look round

HELD = 0.8  # length of held tube drawn below the base, in outer radii


@dataclass(frozen=True)
class Outline:
    """Polygons and lines in the plane of a view [mm], each (k, 2).

    Attributes:
        bodies: Rectangle of every body, base first.
        bores: Lines of the inner wall of every body, two each.
        flexures: Strip of every notch.
        tendons: Line of every tendon.
        lips: Point between the lips of every notch, where it closes.
        centre_line: The tube axis from base to tip.
        held: Line across the base where the tube is held.
    """

    bodies: list[NDArray[np.float64]]
    bores: list[NDArray[np.float64]]
    flexures: list[NDArray[np.float64]]
    tendons: list[NDArray[np.float64]]
    lips: list[NDArray[np.float64]]
    centre_line: NDArray[np.float64]
    held: NDArray[np.float64]


def bending_planes(robot: Robot, offset: float = 1e-9) -> list[float]:
    """Return the directions [rad] that the robot should be drawn in.

    One if all notches bend in one plane, otherwise two at right angles.

    Args:
        robot: The robot.
        offset: How far directions may differ and still be one plane.
    """
    directions = np.radians([notch.direction_deg for notch in robot.notches])
    first = float(directions[0])
    if np.all(np.abs(np.sin(directions - first)) < offset):
        return [first]
    return [first, first + np.pi / 2]


def outline(
    robot: Robot,
    body_position: NDArray[np.float64],
    body_rotation: NDArray[np.float64],
    view: float,
) -> Outline:
    """Return the outline of a robot in one state.

    Args:
        robot: The robot, n notches.
        body_position: Proximal face centre of each body in the base frame [mm], (n + 1, 3).
        body_rotation: Rotation of each body, (n + 1, 3, 3).
        view: Direction across the base that is drawn to the right [rad]; 0 is x.

    Returns:
        The outline, in a frame that turns with the base: a turned base draws the same picture.
    """
    turn = body_rotation[0]
    origin = body_position[0]
    across = np.array([np.cos(view), np.sin(view), 0.0])

    def flat(position: NDArray[np.float64], rotation: NDArray[np.float64], points: Any) -> Any:
        """Carry points (k, 3) of a body into the view."""
        local = (position + np.asarray(points) @ rotation.T - origin) @ turn
        return np.stack([local @ across, local[:, 2]], axis=1)

    outer = robot.tube.outer_diameter / 2
    inner = robot.tube.inner_diameter / 2
    lengths = [robot.tube.base_length, *(notch.uncut_length for notch in robot.notches)]
    bodies, bores, flexures, lips, centre = [], [], [], [], []
    for index, length in enumerate(lengths):
        pose = body_position[index], body_rotation[index]
        # A little of the held tube goes on below the base, so that the first notch stands out.
        start = -HELD * outer if index == 0 else 0.0
        ends = np.array([[0.0, 0.0, start], [0.0, 0.0, length]])
        sides = [ends + side * across for side in (-outer, outer)]
        bodies.append(flat(*pose, np.concatenate([sides[0], sides[1][::-1]])))
        bores += [flat(*pose, ends + side * across) for side in (-inner, inner)]
        centre.append(flat(*pose, [[0.0, 0.0, 0.0], [0.0, 0.0, length]]))
    for index, notch in enumerate(robot.notches):
        rotations, positions = _between(body_position, body_rotation, lengths[index], index)
        near, far = _extent(robot, notch, view)
        edges = [
            np.concatenate(
                [flat(p, r, [side * across]) for p, r in zip(positions, rotations, strict=True)]
            )
            for side in (near, far)
        ]
        flexures.append(np.concatenate([edges[0], edges[1][::-1]]))
        direction = np.radians(notch.direction_deg)
        lip = outer * np.array([[np.cos(direction), np.sin(direction), 0.0]])
        middle = ARC_POINTS // 2
        lips.append(flat(positions[middle], rotations[middle], lip)[0])
        centre.insert(
            2 * index + 1,
            np.concatenate(
                [flat(p, r, [[0.0, 0.0, 0.0]]) for p, r in zip(positions, rotations, strict=True)]
            ),
        )
    return Outline(
        bodies=bodies,
        bores=bores,
        flexures=flexures,
        tendons=[
            _tendon(robot, tendon, body_position, body_rotation, lengths, flat)
            for tendon in robot.tendon
        ],
        lips=lips,
        centre_line=np.concatenate(centre),
        held=bodies[0][[0, -1]],
    )


def _tendon(
    robot: Robot,
    tendon: Any,
    body_position: NDArray[np.float64],
    body_rotation: NDArray[np.float64],
    lengths: list[float],
    flat: Any,
) -> NDArray[np.float64]:
    direction = np.radians(tendon.direction_deg)
    channel = tendon.radius * np.array([np.cos(direction), np.sin(direction), 0.0])
    last = robot.number_of_notches if tendon.end_body is None else tendon.end_body
    below = np.array([0.0, 0.0, -HELD * robot.tube.outer_radius])
    points = [flat(body_position[0], body_rotation[0], [channel + below])]
    for index in range(last + 1):
        pose = body_position[index], body_rotation[index]
        points.append(flat(*pose, [channel, channel + np.array([0.0, 0.0, lengths[index]])]))
        if index < last and tendon.path == "wall-arc":
            rotations, positions = _between(body_position, body_rotation, lengths[index], index)
            points += [flat(p, r, [channel]) for p, r in zip(positions, rotations, strict=True)]
    return np.concatenate(points)


def _extent(robot: Robot, notch: Any, view: float) -> tuple[float, float]:
    """Return from where to where the remaining section of a notch reaches in a view [mm]."""
    outer = robot.tube.outer_diameter / 2
    inner = robot.tube.inner_diameter / 2
    depth = getattr(notch, "depth", None)
    if depth is None:
        return -outer, outer
    cut = depth - outer  # distance of the cut plane from the axis, toward the spine
    radii = (outer, inner)
    if notch.cut == "on-axis":  # radial edges: one angle for both walls
        halves = [np.arccos(np.clip(cut / outer, -1, 1))] * 2
    else:
        halves = [np.arccos(np.clip(cut / radius, -1, 1)) for radius in radii]
    reach: list[float] = []
    for radius, half in zip(radii, halves, strict=True):
        # Seen from the spine, which lies opposite the direction of the notch.
        angles = np.radians(notch.direction_deg) + np.pi + np.linspace(-half, half, 181)
        reach += [*(radius * np.cos(angles - view))]
    return min(reach), max(reach)


def _between(
    body_position: NDArray[np.float64],
    body_rotation: NDArray[np.float64],
    length: float,
    index: int,
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return poses along notch `index`: one constant twist, which is how a plain notch bends.

    Args:
        body_position: (n + 1, 3).
        body_rotation: (n + 1, 3, 3).
        length: Length of the body before the notch [mm].
        index: The notch, from 0.

    Returns:
        Rotations (k, 3, 3) and positions (k, 3) from the body before to the body after.
    """
    first, second = body_rotation[index], body_rotation[index + 1]
    start = body_position[index] + length * first[:, 2]
    relative = first.T @ second
    step = first.T @ (body_position[index + 1] - start)
    vector = _rotation_vector(relative)
    # Solve V(1) v = step for the velocity v of the twist, then follow it.
    velocity = np.linalg.solve(_left_jacobian(vector), step)
    parts = np.linspace(0.0, 1.0, ARC_POINTS)
    rotations = np.stack([first @ _rotation(part * vector) for part in parts])
    positions = np.stack(
        [start + first @ (_left_jacobian(part * vector) @ velocity) * part for part in parts]
    )
    return rotations, positions


def _cross(vector: NDArray[np.float64]) -> NDArray[np.float64]:
    x, y, z = vector
    return np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])


def _rotation(vector: NDArray[np.float64]) -> NDArray[np.float64]:
    """Rodrigues' formula."""
    angle = float(np.linalg.norm(vector))
    cross = _cross(vector)
    return np.eye(3) + np.sinc(angle / np.pi) * cross + _half(angle) * cross @ cross


def _left_jacobian(vector: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the mean rotation along a constant twist: the integral of exp(s w) over 0..1."""
    angle = float(np.linalg.norm(vector))
    cross = _cross(vector)
    third = (1.0 - np.sinc(angle / np.pi)) / angle**2 if angle > 1e-4 else 1.0 / 6.0
    return np.eye(3) + _half(angle) * cross + third * cross @ cross


def _half(angle: float) -> float:
    """Return (1 - cos a) / a^2, which is 1/2 at 0."""
    return 0.5 * np.sinc(angle / (2 * np.pi)) ** 2


def _rotation_vector(rotation: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the rotation vector of a rotation of less than half a turn."""
    axis = 0.5 * np.array(
        [
            rotation[2, 1] - rotation[1, 2],
            rotation[0, 2] - rotation[2, 0],
            rotation[1, 0] - rotation[0, 1],
        ]
    )
    sine = float(np.linalg.norm(axis))
    angle = np.arctan2(sine, (np.trace(rotation) - 1) / 2)
    return axis * (angle / sine if sine > 1e-12 else 1.0)
