"""The rigid pieces of the tube as solids: what the cuts leave between one flexure and the next.

Cuts go straight through the tube, so a piece is its outline seen from the side, extruded across
the tube and cut with the wall. What belongs to a flexure across the tube is taken away from it.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numpy.typing import NDArray

from notchflex.plotting.shapes.robot_shape import RobotShape
from notchflex.plotting.shapes.outline import body_corners

if TYPE_CHECKING:
    from manifold3d import Manifold

ROUND = 96  # flat sides of the tube
_BEYOND = 1.0  # mm, by which the tube outreaches what is cut from it


class Mesh(NamedTuple):
    """A closed surface.

    Attributes:
        vertices: Points, mm, (v, 3).
        faces: Corners of triangles, counter-clockwise as seen from outside, (f, 3).
    """

    vertices: NDArray[np.float64]
    faces: NDArray[np.int64]


def body_solids(rest: RobotShape) -> list[Mesh]:
    """Return the rigid pieces of a robot, base first, each in its own frame (mm).

    Args:
        rest: The robot as it stands when nothing loads it.
    """
    return [_body(rest, body) for body in range(len(rest.position))]


def _body(rest: RobotShape, body: int) -> Mesh:
    notch = rest.robot.notches[max(body - 1, 0)]
    view = float(np.radians(notch.direction_deg))
    corners = np.array(body_corners(rest, body, view))
    solid = _through(corners, view, rest) ^ _tube(rest, corners[:, 1])
    spine = np.asarray(rest.chain.rods.lip_closes) > 0.0
    for flexure in (body - 1, body):
        # A flexure on a spine lies between the pieces; one across the tube reaches into them.
        if 0 <= flexure < len(rest.flexures) and not spine[flexure]:
            one = rest.flexures[flexure]
            line = np.concatenate([one.fibre(-one.spine), one.fibre(one.near)[::-1]])
            own = (line - rest.position[body]) @ rest.rotation[body]
            across = np.array([np.cos(view), np.sin(view), 0.0])
            solid = solid - _through(np.stack([own @ across, own[:, 2]], axis=-1), view, rest)
    mesh = solid.to_mesh64()
    return Mesh(np.asarray(mesh.vert_properties)[:, :3], np.asarray(mesh.tri_verts, np.int64))


def _tube(rest: RobotShape, along: NDArray[np.float64]) -> Manifold:
    """The wall of the tube, longer than what is to be cut from it."""
    from manifold3d import Manifold

    low, high = float(along.min()) - _BEYOND, float(along.max()) + _BEYOND
    tube = rest.robot.tube
    outer, inner = (
        Manifold.cylinder(high - low, radius, circular_segments=ROUND)
        for radius in (tube.outer_radius, tube.inner_radius)
    )
    return (outer - inner).translate((0.0, 0.0, low))


def _through(polygon: NDArray[np.float64], view: float, rest: RobotShape) -> Manifold:
    """All that lies behind a polygon (across, along) seen from the side."""
    from manifold3d import CrossSection, FillRule, Manifold

    deep = 2.0 * rest.robot.tube.outer_diameter
    prism = Manifold.extrude(CrossSection([polygon], FillRule.NonZero), deep)
    across = np.array([np.cos(view), np.sin(view), 0.0])
    along = np.array([0.0, 0.0, 1.0])
    axes = np.stack([across, along, np.cross(across, along)], axis=1)
    middle = axes @ np.array([0.0, 0.0, -0.5 * deep])
    return prism.transform(np.concatenate([axes, middle[:, None]], axis=1))


__all__ = ["ROUND", "Mesh", "body_solids"]
