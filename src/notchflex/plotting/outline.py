"""The outline of a bent robot, to scale, its faces in space, and the solids of its bodies.

It is in the frame of the clamped base [mm], with smooth flexures. The horizontal axis of a view is
a direction across the base, the vertical axis is the tube axis of the base. A body is drawn as its
walls on both sides and what joins them, a flexure as a bent strip as thick as its section.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np
from scipy.spatial.transform import RigidTransform, Rotation

from notchflex import EquilibriumPath, Robot, RobotShape, Tube
from notchflex.plotting.marks import Array, box
from notchflex.support import FlexureShape

if TYPE_CHECKING:
    from manifold3d import Manifold


FLEXURE_POINTS = 20  # a notch bends by less than a right angle; 2 degrees look smooth
UP = np.array([0.0, 0.0, 1.0])
HELD = 0.8  # length of clamped tube drawn below the base, in outer radii
_CLAMP = 1.7  # half the width of the clamp, in outer radii

Corners = list[tuple[float, float]]


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
    """Return a shape whose flexures have at least so many straight pieces, (n,).

    Between two sections a flexure is the arc of a constant twist.
    """
    flexures = shape.flexures
    counts = np.array([len(one.area) for one in flexures])
    parts = -(-pieces // (counts - 1))
    first, total = np.cumsum(counts) - counts, counts.sum()
    places = [
        start + np.arange((count - 1) * part + 1) / part
        for start, count, part in zip(first, counts, parts, strict=True)
    ]
    place = np.concatenate(places)
    rotation, position, *widths = (
        np.concatenate([getattr(one, name) for one in flexures])
        for name in ("rotation", "position", "spine", "near", "area")
    )
    poses = RigidTransform.from_components(position, Rotation.from_matrix(rotation))
    before = place.astype(int)
    twist = (poses[before].inv() * poses[np.minimum(before + 1, total - 1)]).as_exp_coords()
    line = poses[before] * RigidTransform.from_exp_coords((place - before)[:, None] * twist)
    columns = [line.rotation.as_matrix(), line.translation]
    columns += [np.interp(place, np.arange(total), width) for width in widths]
    ends = np.cumsum([len(part) for part in places])[:-1]
    rows = zip(*(np.split(column, ends) for column in columns), strict=True)
    return replace(shape, flexures=tuple(FlexureShape(*row) for row in rows))


def walls(robot: Robot, side_deg: float) -> list[tuple[float, float] | None]:
    """Return the ends of the wall of each body on a side [mm in its frame]; None if no wall."""
    base, *others = robot.geometry.walls(side_deg)
    assert base is not None
    # What is fixed in the last body may enter it beyond its far face.
    ends = [None if one is None else (min(one), max(one)) for one in others]
    return [(-HELD * robot.tube.outer_radius, base[1]), *ends]


def tendon_line(shape: RobotShape, number: int) -> Array:
    """Return the line of a tendon (from 0) from below the base."""
    points = shape.tendon(number)
    points[0] -= HELD * shape.robot.tube.outer_radius * UP
    return points


def lips(shape: RobotShape, notch: int, radius: float | None = None) -> Array:
    """Return the point midway between the edges of a notch (from 0) that meet when it closes.

    It lies at a radius [mm] from the tube axis, by default the outer one.
    """
    outer = shape.robot.tube.outer_radius if radius is None else radius
    pairs: list[Array] = []
    for turn in (0.0, 180.0):
        side = shape.robot.notches[notch].direction_deg + turn
        ends = walls(shape.robot, side)
        if (behind := ends[notch + 1]) is not None:
            before, last = max((body, wall) for body, wall in enumerate(ends[: notch + 1]) if wall)
            edge = outer * across_of(np.radians(side))
            first = shape.on_body(before, edge + last[1] * UP)
            pairs.append(np.stack([first, shape.on_body(notch + 1, edge + behind[0] * UP)]))
    return min(pairs, key=lambda pair: float(np.linalg.norm(pair[1] - pair[0]))).mean(axis=0)


@dataclass(frozen=True)
class ShapeOutline:
    """Polygons and lines in the plane of a view [mm], each (k, 2)."""

    bodies: list[Array]  # base first
    bores: list[Array]  # inner wall of every body, one for each side with a wall
    flexures: list[Array]  # the strip of every notch
    tendons: list[Array]
    centre_line: Array  # from base to tip
    held: Array  # the clamp below the base


def across_of(view: float) -> Array:
    """Return the direction across the base that a view [rad] has on the right."""
    return np.array([np.cos(view), np.sin(view), 0.0])


def project(points: Any, view: float) -> Array:
    """Return points (..., 3) as a view shows them: across the base and along it, (..., 2)."""
    points = np.asarray(points)
    return np.stack([points @ across_of(view), points[..., 2]], axis=-1)


def bending_plane(robot: Robot, offset: float = 1e-9) -> float | None:
    """Return the direction [rad] of the plane in which all notches bend, up to an offset [rad]."""
    directions = np.radians([notch.direction_deg for notch in robot.notches])
    first = float(directions[0])
    return first if np.all(np.abs(np.sin(directions - first)) < offset) else None


def outline(shape: RobotShape, view: float) -> ShapeOutline:
    """Return the outline of a robot, with a direction [rad] of the base drawn to the right."""
    outer, inner = shape.robot.tube.outer_radius, shape.robot.tube.inner_radius

    def place(body: int, corners: Any) -> Array:
        local = np.asarray(corners, float)
        return project(
            shape.on_body(body, local[:, :1] * across_of(view) + local[:, 1:] * UP), view
        )

    bodies = range(len(shape.position))
    side, below = _CLAMP * outer, -HELD * outer
    return ShapeOutline(
        bodies=[place(body, body_corners(shape, body, view)) for body in bodies],
        bores=[
            place(body, [(sign * inner, end) for end in wall])
            for body in bodies
            for sign, wall in zip((1.0, -1.0), _sides(shape, body, view), strict=True)
            if wall is not None
        ],
        flexures=[project(strip(one), view) for one in shape.flexures],
        tendons=[project(tendon_line(shape, i), view) for i in range(len(shape.robot.tendon))],
        centre_line=project(_centre_line(shape), view),
        held=place(0, box(-side, below, side, 0.0)),
    )


def strip(one: FlexureShape) -> Array:
    """Return the outline of a flexure: along its spine and back along its other edge, (k, 3)."""
    return np.concatenate([one.fibre(-one.spine), one.fibre(one.near)[::-1]])


def body_corners(shape: RobotShape, body: int, view: float) -> Corners:
    """Return the outline of a body (0 is the base): corners (across, along) in its frame [mm]."""
    outer, ends = shape.robot.tube.outer_radius, _sides(shape, body, view)
    reach = _reach(shape, body, view)
    sides: list[Corners] = []
    for sign, wall, inside in zip((1.0, -1.0), ends, reach, strict=True):
        if wall is not None:
            ring = [(outer, wall[0]), (outer, wall[1]), (inside, wall[1]), (inside, wall[0])]
            sides.append([(sign * across, along) for across, along in ring])
    if len(sides) == 1:
        return sides[0]
    right, left = sides
    low, high = max(right[0][1], left[0][1]), min(right[1][1], left[1][1])
    # Walls that overlap are connected at right angles, others diagonally.
    top = [(reach[0], high), (-reach[1], high)] if high > low else []
    foot = [(-reach[1], low), (reach[0], low)] if high > low else []
    return [*right[:3], *top, *left[2::-1], left[3], *foot, right[3]]


def _sides(shape: RobotShape, body: int, view: float) -> list[tuple[float, float] | None]:
    """Return the ends of the wall of a body on the right and the left; None if no wall."""
    return [walls(shape.robot, np.degrees(view) + turn)[body] for turn in (0.0, 180.0)]


def _reach(shape: RobotShape, body: int, view: float) -> list[float]:
    """Return the distance of the wall of a body from the axis on the right and the left.

    The inner radius, or less where a flexure is attached.
    """
    reach = [shape.robot.tube.inner_radius] * 2
    joined = [(one, -1) for one in shape.flexures[max(body - 1, 0) : body]]
    joined += [(one, 0) for one in shape.flexures[body : body + 1]]
    for one, end in joined:
        edges = np.stack([one.fibre(-one.spine)[end], one.position[end], one.fibre(one.near)[end]])
        local = (edges - shape.position[body]) @ shape.rotation[body] @ across_of(view)
        side, sign = (0, 1.0) if local[1] > 0.0 else (1, -1.0)
        reach[side] = min(reach[side], max(float(np.min(sign * local)), 0.0))
    return reach


def _centre_line(shape: RobotShape) -> Array:
    """Return the tube axis along the bodies, and along notches with a spine beside it."""
    geometry = shape.robot.geometry
    points: list[Array] = []
    for body, length in enumerate(geometry.body_length):
        if body and geometry.has_spine[body - 1]:
            flexure = shape.flexures[body - 1]
            end = (shape.position[body] - flexure.position[-1]) @ flexure.rotation[-1]
            points.append(flexure.fibre(*end[:2]))
        points.append(shape.on_body(body, [[0.0, 0.0, 0.0], [0.0, 0.0, length]]))
    return np.concatenate(points)


_ROUND = 32  # flat pieces round the tube in space


def body_faces(shape: RobotShape) -> Iterator[Array]:
    """Yield the outer wall of every body, (pieces, 4, 3)."""
    edges = 2.0 * np.pi * np.arange(_ROUND + 1) / _ROUND
    rim = shape.robot.tube.outer_radius * np.stack([np.cos(edges), np.sin(edges)], axis=1)
    sides = [walls(shape.robot, float(np.degrees(angle))) for angle in edges[:-1] + np.pi / _ROUND]
    for body in range(len(shape.position)):
        corners = [
            np.column_stack([rim[[i, i + 1, i + 1, i]], np.repeat(wall, 2)])
            for i in range(_ROUND)
            if (wall := sides[i][body]) is not None and wall[1] > wall[0]
        ]
        if corners:
            yield shape.on_body(body, corners)


def flexure_faces(shape: RobotShape) -> Iterator[Array]:
    """Yield every flexure: the wall at its spine, or a band with its thickness and area."""
    outer = shape.robot.tube.outer_radius
    for one, spine in zip(shape.flexures, shape.robot.geometry.has_spine, strict=True):
        if spine:
            axis = outer - one.spine  # from the neutral axis to the axis of the tube
            half = float(np.arccos(np.clip((axis[0] - one.near[0]) / outer, -1.0, 1.0)))
            angles = np.pi + np.linspace(-half, half, 9)
            edges = [(axis + outer * np.cos(angle), outer * np.sin(angle)) for angle in angles]
        else:
            half = 0.5 * one.area / (one.spine + one.near)
            edges = [(-one.spine, -half), (-one.spine, half), (one.near, half), (one.near, -half)]
            edges.append(edges[0])
        along = np.stack([one.fibre(across, out) for across, out in edges], axis=1)
        corners = [along[:-1, :-1], along[:-1, 1:], along[1:, 1:], along[1:, :-1]]
        yield np.stack(corners, axis=2).reshape(-1, 4, 3)


def tube_wall(tube: Tube, ends: tuple[float, float], sides: int, *, fair: bool = False) -> Manifold:
    """Return the wall of a tube along z.

    Args:
        tube: The tube.
        ends: Its lower and its upper end [mm].
        sides: Flat sides of each surface.
        fair: Whether the sides lie half inside and half outside the round surface, so that the
            volume is that of the round tube; otherwise their corners lie on it.
    """
    from manifold3d import Manifold

    grown = fair_growth(sides) if fair else 1.0
    outer, inner = (
        Manifold.cylinder(ends[1] - ends[0], grown * radius, circular_segments=sides)
        for radius in (tube.outer_radius, tube.inner_radius)
    )
    return (outer - inner).translate((0.0, 0.0, ends[0]))


def fair_growth(sides: int) -> float:
    """Return the factor by which a polygon's corners lie outside the circle of equal area."""
    part = 2.0 * math.pi / sides
    return math.sqrt(part / math.sin(part))


def prism(polygon: Any, view: float, depth: float) -> Manifold:
    """Return the prism of a polygon (across, along) seen from the side.

    Args:
        polygon: Corners [mm], (k, 2): across toward the direction `view`, and along z.
        view: Direction about z that the first coordinate has [rad].
        depth: Length of the prism across that plane, half of it on each side [mm].
    """
    from manifold3d import CrossSection, FillRule, Manifold

    solid = Manifold.extrude(CrossSection([polygon], FillRule.NonZero), depth)
    axes = np.stack([across_of(view), UP, np.cross(across_of(view), UP)], axis=1)
    middle = -0.5 * depth * axes[:, 2:]
    return solid.transform(np.concatenate([axes, middle], axis=1))
