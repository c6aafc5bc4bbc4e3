"""Surfaces of the flexures: fixed triangles whose corners follow the sections.

A spine is one piece of the wall; a strip across the tube is two, one on each side of the bore.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from notchflex.plotting.shapes.robot_shape import FlexureShape, RobotShape, shape_from_angles
from notchflex.robot import Robot

PIECES = 12  # straight pieces of a bent flexure, at least
ROUND = 12  # flat pieces of a spine, as seen along the tube
ACROSS = 3  # corners of a strip across its thickness

Points = NDArray[np.float64]


@dataclass(frozen=True)
class FlexureSurface:
    """The surface of a flexure with k sections.

    Attributes:
        across: Coordinate of every corner along the first axis of its section [mm], (c, k).
        out: The same along the second axis.
        faces: Corners of triangles, counter-clockwise as seen from outside, (f, 3); corners are
            counted section by section.
    """

    across: Points
    out: Points
    faces: NDArray[np.int64]

    def at(self, sections: FlexureShape) -> Points:
        """Return all corners of a bent flexure [mm], (k c, 3)."""
        x, y = self.across.T[..., None], self.out.T[..., None]
        rotation = sections.rotation[:, None]
        points = sections.position[:, None] + x * rotation[..., 0] + y * rotation[..., 1]
        return points.reshape(-1, 3)


def at_rest(robot: Robot, level: str = "tendons") -> RobotShape:
    """Return the shape of a robot without loads, with `PIECES`; `level` is that of its chain."""
    free = np.radians([notch.precurvature_deg for notch in robot.notches])
    return shape_from_angles(robot, free, PIECES, level)


def skins(rest: RobotShape) -> list[FlexureSurface]:
    """Return the surfaces of all flexures of a robot, base to tip.

    Args:
        rest: The shape from `at_rest`; other states have the same number of pieces.
    """
    spine = np.asarray(rest.chain.rods.has_closure) > 0.0
    return [
        _spine(rest, notch) if spine[notch] else _strip(rest, notch)
        for notch in range(len(rest.flexures))
    ]


def _spine(rest: RobotShape, notch: int) -> FlexureSurface:
    """Return a piece of the wall between radial edges, or beside one straight cut."""
    one, tube = rest.flexures[notch], rest.robot.tube
    outer, inner = tube.outer_radius, tube.inner_radius
    description = rest.robot.notches[notch]
    axis = outer - one.spine  # from the neutral axis to the axis of the tube
    # Where the cut meets the outer surface; radial edges continue to the axis.
    depth, radial = description.spine_cut or (outer - float(one.near[0] - axis[0]), False)
    cut = outer - depth
    half_outer = float(np.arccos(np.clip(-cut / outer, -1.0, 1.0)))
    half_inner = half_outer if radial else float(np.arccos(np.clip(-cut / inner, -1.0, 1.0)))
    part = np.linspace(-1.0, 1.0, ROUND + 1)
    outside = np.stack([-outer * np.cos(part * half_outer), -outer * np.sin(part * half_outer)])
    if radial or cut > -inner:
        angle = part * half_inner
        inside = np.stack([-inner * np.cos(angle), -inner * np.sin(angle)])
    else:  # less than the wall is left
        inside = np.stack([np.full(len(part), cut), -outer * np.sin(half_outer) * part])
    corners = np.stack([outside, inside], axis=1)  # (2, layers, angles)
    across = corners[0].reshape(-1, 1) + axis[None]
    out = np.broadcast_to(corners[1].reshape(-1, 1), across.shape)
    return FlexureSurface(across, out, _box(len(axis), ROUND + 1))


def _strip(rest: RobotShape, notch: int) -> FlexureSurface:
    """Return a strip across the tube, as wide as the wall of the tube."""
    one, tube = rest.flexures[notch], rest.robot.tube
    view = np.radians(rest.robot.notches[notch].direction_deg)
    direction = np.array([np.cos(view), np.sin(view), 0.0])
    place = np.linspace(0.0, 1.0, ACROSS)[:, None] * (one.spine + one.near) - one.spine
    outside, inside = [], []
    for row in place:
        own = (one.fibre(row) - rest.position[notch]) @ rest.rotation[notch] @ direction
        beside = np.minimum(np.abs(own), tube.outer_radius)
        outside.append(np.sqrt(tube.outer_radius**2 - beside**2))
        inside.append(np.sqrt(np.maximum(tube.inner_radius**2 - beside**2, 0.0)))
    count = len(one.area)
    walls = np.stack([np.stack(outside), np.stack(inside)])  # (layers, across, sections)
    # The other wall is the mirror image, with reversed triangles.
    across = np.concatenate([np.tile(place, (2, 1))] * 2)
    out = np.concatenate([walls.reshape(-1, count), -walls.reshape(-1, count)])
    box = _box(count, ACROSS)
    corners = 2 * ACROSS
    section, corner = np.divmod(box, corners)
    first, second = section * 2 * corners + corner, section * 2 * corners + corners + corner
    return FlexureSurface(across, out, np.concatenate([first[:, ::-1], second]))


def _box(sections: int, row: int) -> NDArray[np.int64]:
    """Return the triangles of a curved box with two rows of corners, outer first, per section."""
    ring = np.concatenate([np.arange(row), np.arange(2 * row - 1, row - 1, -1)])
    following = np.roll(ring, -1)
    faces: list[NDArray[np.int64]] = []
    for at in range(sections - 1):
        here, there = at * 2 * row, (at + 1) * 2 * row
        a, b, c, d = ring + here, following + here, following + there, ring + there
        faces += [np.stack([a, b, c], axis=1), np.stack([a, c, d], axis=1)]
    first = np.arange(row - 1)
    a, b, c, d = first, first + 1, first + 1 + row, first + row
    cap = np.concatenate([np.stack([a, c, b], axis=1), np.stack([a, d, c], axis=1)])
    last = (sections - 1) * 2 * row
    return np.concatenate([*faces, cap, cap[:, ::-1] + last])
