"""The rigid bodies of the tube as solids, and the flexures as surfaces that follow their sections.

Cuts go straight through the tube, so a body is its outline from the side, extruded across the tube
and intersected with the wall, without the flexures across the tube. The surface of a spine is one
piece of the wall; that of a strip across the tube is two, one on each side of the bore.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from notchflex.plotting.shapes.outline import body_corners
from notchflex.plotting.shapes.prisms import prism, tube_wall
from notchflex.plotting.shapes.robot_shape import FlexureShape, RobotShape, shape_from_angles
from notchflex.robot import Robot

if TYPE_CHECKING:
    from manifold3d import Manifold

Points = NDArray[np.float64]
Triangles = NDArray[np.int64]

ROUND = 96  # flat sides of the tube
PIECES = 12  # straight pieces of a bent flexure, at least
_SPINE = 12  # flat pieces of a spine, as seen along the tube
_ACROSS = 3  # corners of a strip across its thickness
_END_MARGIN = 1.0  # extra length of the tube at both ends of a body [mm]


def body_solids(rest: RobotShape) -> list[tuple[Points, Triangles]]:
    """Return the rigid bodies of a robot at rest, base first, each in its own frame.

    Each is a closed surface: vertices [mm], (v, 3), and corners of triangles, counter-clockwise as
    seen from outside, (f, 3).
    """
    return [_body(rest, body) for body in range(len(rest.position))]


def _body(rest: RobotShape, body: int) -> tuple[Points, Triangles]:
    notch = rest.robot.notches[max(body - 1, 0)]
    view = float(np.radians(notch.direction_deg))
    corners = np.array(body_corners(rest, body, view))
    solid = _through(corners, view, rest) ^ _tube(rest, corners[:, 1])
    spine = np.asarray(rest.chain.rods.has_closure) > 0.0
    for flexure in (body - 1, body):
        # A flexure on a spine lies between the bodies; one across the tube overlaps with them.
        if 0 <= flexure < len(rest.flexures) and not spine[flexure]:
            one = rest.flexures[flexure]
            line = np.concatenate([one.fibre(-one.spine), one.fibre(one.near)[::-1]])
            local = (line - rest.position[body]) @ rest.rotation[body]
            corners = np.stack([local @ _across(view), local[:, 2]], axis=-1)
            solid = solid - _through(corners, view, rest)
    mesh = solid.to_mesh64()
    return np.asarray(mesh.vert_properties)[:, :3], np.asarray(mesh.tri_verts, np.int64)


def _across(view: float) -> Points:
    return np.array([np.cos(view), np.sin(view), 0.0])


def _tube(rest: RobotShape, along: Points) -> Manifold:
    """Return the wall of the tube, longer than the body."""
    ends = float(along.min()) - _END_MARGIN, float(along.max()) + _END_MARGIN
    return tube_wall(rest.robot.tube, ends, ROUND)


def _through(polygon: Points, view: float, rest: RobotShape) -> Manifold:
    """Return the prism of a polygon (across, along) seen from the side."""
    return prism(polygon, view, 2.0 * rest.robot.tube.outer_diameter)


@dataclass(frozen=True)
class FlexureSurface:
    """The surface of a flexure with k sections: fixed triangles whose c corners move.

    `across` and `out` are the coordinates of every corner along the first and the second axis of
    its section [mm], (c, k). `faces` are corners of triangles, counter-clockwise as seen from
    outside, (f, 3); corners are counted section by section.
    """

    across: Points
    out: Points
    faces: Triangles

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
    """Return the surfaces of all flexures, base to tip, of the shape from `at_rest`."""
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
    part = np.linspace(-1.0, 1.0, _SPINE + 1)
    outside = np.stack([-outer * np.cos(part * half_outer), -outer * np.sin(part * half_outer)])
    if radial or cut > -inner:
        angle = part * half_inner
        inside = np.stack([-inner * np.cos(angle), -inner * np.sin(angle)])
    else:  # less than the wall is left
        inside = np.stack([np.full(len(part), cut), -outer * np.sin(half_outer) * part])
    corners = np.stack([outside, inside], axis=1)  # (2, layers, angles)
    across = corners[0].reshape(-1, 1) + axis[None]
    out = np.broadcast_to(corners[1].reshape(-1, 1), across.shape)
    return FlexureSurface(across, out, _box(len(axis), _SPINE + 1))


def _strip(rest: RobotShape, notch: int) -> FlexureSurface:
    """Return a strip across the tube, as wide as the wall of the tube."""
    one, tube = rest.flexures[notch], rest.robot.tube
    direction = _across(np.radians(rest.robot.notches[notch].direction_deg))
    position = np.linspace(0.0, 1.0, _ACROSS)[:, None] * (one.spine + one.near) - one.spine
    outside, inside = [], []
    for row in position:
        local = (one.fibre(row) - rest.position[notch]) @ rest.rotation[notch] @ direction
        beside = np.minimum(np.abs(local), tube.outer_radius)
        outside.append(np.sqrt(tube.outer_radius**2 - beside**2))
        inside.append(np.sqrt(np.maximum(tube.inner_radius**2 - beside**2, 0.0)))
    count = len(one.area)
    walls = np.stack([np.stack(outside), np.stack(inside)])  # (layers, across, sections)
    # The other wall is the mirror image, with reversed triangles.
    across = np.concatenate([np.tile(position, (2, 1))] * 2)
    out = np.concatenate([walls.reshape(-1, count), -walls.reshape(-1, count)])
    box = _box(count, _ACROSS)
    corners = 2 * _ACROSS
    first = box + box // corners * corners
    second = first + corners
    return FlexureSurface(across, out, np.concatenate([first[:, ::-1], second]))


def _box(sections: int, row: int) -> Triangles:
    """Return the triangles of a curved box with two rows of corners, outer first, per section."""
    ring = np.concatenate([np.arange(row), np.arange(2 * row - 1, row - 1, -1)])
    following = np.roll(ring, -1)
    faces: list[Triangles] = []
    for at in range(sections - 1):
        lower, upper = at * 2 * row, (at + 1) * 2 * row
        a, b, c, d = ring + lower, following + lower, following + upper, ring + upper
        faces += [np.stack([a, b, c], axis=1), np.stack([a, c, d], axis=1)]
    first = np.arange(row - 1)
    a, b, c, d = first, first + 1, first + 1 + row, first + row
    cap = np.concatenate([np.stack([a, c, b], axis=1), np.stack([a, d, c], axis=1)])
    last = (sections - 1) * 2 * row
    return np.concatenate([*faces, cap, cap[:, ::-1] + last])
