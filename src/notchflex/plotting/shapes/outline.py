"""The outline of a bent robot, to scale, and the solids that its bodies are made of.

The horizontal axis of a view is a direction across the base, the vertical axis is the tube axis of
the base. A body is drawn as its walls on both sides and what joins them, a flexure as a bent strip
with the thickness of its section.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from notchflex import Robot
from notchflex.plotting.shapes.robot_shape import HELD, UP, lips, tendon_line, walls

if TYPE_CHECKING:
    from manifold3d import Manifold

    from notchflex import RobotShape, Tube


Wall = tuple[float, float] | None
_CLAMP = 1.7  # half the width of the clamp, in outer radii


@dataclass(frozen=True)
class ShapeOutline:
    """Polygons and lines in the plane of a view [mm], each (k, 2)."""

    bodies: list[NDArray[np.float64]]  # base first
    bores: list[NDArray[np.float64]]  # inner wall of every body, one for each side with a wall
    flexures: list[NDArray[np.float64]]  # the strip of every notch
    tendons: list[NDArray[np.float64]]
    lips: list[NDArray[np.float64]]  # where the edges of every notch meet when it closes
    centre_line: NDArray[np.float64]  # from base to tip
    held: NDArray[np.float64]  # the clamp below the base


def project(points: Any, view: float) -> NDArray[np.float64]:
    """Return points (..., 3) as a view shows them: across the base and along it, (..., 2)."""
    points = np.asarray(points)
    return np.stack([points @ _across(view), points[..., 2]], axis=-1)


def _across(view: float) -> NDArray[np.float64]:
    return np.array([np.cos(view), np.sin(view), 0.0])


def bending_plane(robot: Robot, offset: float = 1e-9) -> float | None:
    """Return the direction [rad] of the plane in which all notches bend, up to an offset [rad]."""
    directions = np.radians([notch.direction_deg for notch in robot.notches])
    first = float(directions[0])
    return first if np.all(np.abs(np.sin(directions - first)) < offset) else None


def outline(shape: RobotShape, view: float) -> ShapeOutline:
    """Return the outline of a robot, with a direction [rad] of the base drawn to the right."""
    across = _across(view)
    outer, inner = shape.robot.tube.outer_radius, shape.robot.tube.inner_radius
    bodies, bores = [], []
    for body in range(len(shape.position)):
        polygon = body_corners(shape, body, view)

        def place(points: Any, body: int = body) -> NDArray[np.float64]:
            local = np.asarray(points, float)
            return project(shape.on_body(body, local[:, :1] * across + local[:, 1:] * UP), view)

        bodies.append(place(polygon))
        for sign, wall in zip((1.0, -1.0), _sides(shape, body, view), strict=True):
            if wall is not None:
                bores.append(place([(sign * inner, at) for at in wall]))
    below = np.array([0.0, 0.0, -HELD * outer])
    clamp = [side * _CLAMP * outer * across for side in (-1.0, 1.0)]
    flexures = [
        np.concatenate(
            [project(one.fibre(-one.spine), view), project(one.fibre(one.near), view)[::-1]]
        )
        for one in shape.flexures
    ]
    return ShapeOutline(
        bodies=bodies,
        bores=bores,
        flexures=flexures,
        tendons=[
            project(tendon_line(shape, number), view) for number in range(len(shape.robot.tendon))
        ],
        lips=[project(lips(shape, notch), view) for notch in range(len(shape.flexures))],
        centre_line=project(_centre_line(shape), view),
        held=project(shape.on_body(0, [*clamp, clamp[1] + below, clamp[0] + below]), view),
    )


def body_corners(shape: RobotShape, body: int, view: float) -> list[tuple[float, float]]:
    """Return the outline of a body (0 is the base): corners (across, along) in its frame [mm]."""
    tube = shape.robot.tube
    right, left = _sides(shape, body, view)
    reach = _reach(shape, body, _across(view), tube.inner_radius)
    return _body(right, left, tube.outer_radius, reach)


def _sides(shape: RobotShape, body: int, view: float) -> list[Wall]:
    """Return the ends of the wall of a body on the right and the left; None if no wall."""
    return [walls(shape.robot, np.degrees(view) + turn)[body] for turn in (0.0, 180.0)]


def _centre_line(shape: RobotShape) -> NDArray[np.float64]:
    """Return the tube axis along the bodies, and along notches with a spine beside it."""
    geometry = shape.robot.geometry
    points: list[NDArray[np.float64]] = []
    for body, length in enumerate(geometry.body_length):
        if body and geometry.has_spine[body - 1]:
            flexure = shape.flexures[body - 1]
            end = (shape.position[body] - flexure.position[-1]) @ flexure.rotation[-1]
            points.append(flexure.fibre(*end[:2]))
        points.append(shape.on_body(body, [[0.0, 0.0, 0.0], [0.0, 0.0, length]]))
    return np.concatenate(points)


def _reach(
    shape: RobotShape, body: int, across: NDArray[np.float64], inner: float
) -> tuple[float, float]:
    """Return the distance of the wall of a body from the axis on the right and the left.

    The inner radius, or less where a flexure is attached.
    """
    reach = [inner, inner]
    joined = [(shape.flexures[body - 1], -1)] if body else []
    joined += [(one, 0) for one in shape.flexures[body : body + 1]]
    for one, end in joined:
        edges = np.stack([one.fibre(-one.spine)[end], one.position[end], one.fibre(one.near)[end]])
        local = (edges - shape.position[body]) @ shape.rotation[body] @ across
        side = 0 if local[1] > 0.0 else 1
        nearest = float(np.min(local if side == 0 else -local))
        reach[side] = min(reach[side], max(nearest, 0.0))
    return reach[0], reach[1]


def _body(
    right: Wall, left: Wall, outer: float, reach: tuple[float, float]
) -> list[tuple[float, float]]:
    """Return the corners of a body (across, along), counter-clockwise from the lower right."""
    if right is None or left is None:
        sign, wall, inside = (-1.0, left, reach[1]) if right is None else (1.0, right, reach[0])
        assert wall is not None  # every body has a wall
        low, high = wall
        return [
            (sign * at, z) for at, z in ((outer, low), (outer, high), (inside, high), (inside, low))
        ]
    low, high = max(right[0], left[0]), min(right[1], left[1])
    # Walls that overlap are connected at right angles, others diagonally.
    top = [(reach[0], high), (-reach[1], high)] if high > low else []
    foot = [(-reach[1], low), (reach[0], low)] if high > low else []
    upper = [(outer, right[1]), (reach[0], right[1]), *top, (-reach[1], left[1]), (-outer, left[1])]
    lower = [(-outer, left[0]), (-reach[1], left[0]), *foot, (reach[0], right[0])]
    return [(outer, right[0]), *upper, *lower]


Points = NDArray[np.float64]


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


def prism(polygon: Points, view: float, depth: float) -> Manifold:
    """Return the prism of a polygon (across, along) seen from the side.

    Args:
        polygon: Corners [mm], (k, 2): across toward the direction `view`, and along z.
        view: Direction about z that the first coordinate has [rad].
        depth: Length of the prism across that plane, half of it on each side [mm].
    """
    from manifold3d import CrossSection, FillRule, Manifold

    solid = Manifold.extrude(CrossSection([polygon], FillRule.NonZero), depth)
    across = np.array([math.cos(view), math.sin(view), 0.0])
    along = np.array([0.0, 0.0, 1.0])
    axes = np.stack([across, along, np.cross(across, along)], axis=1)
    middle = axes @ np.array([0.0, 0.0, -0.5 * depth])
    return solid.transform(np.concatenate([axes, middle[:, None]], axis=1))
