"""The rigid bodies of the tube as solids.

Cuts go straight through the tube, so a body is its outline from the side, extruded across the tube
and intersected with the wall, without the flexures across the tube.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numpy.typing import NDArray

from notchflex.plotting.shapes.outline import body_corners
from notchflex.plotting.shapes.robot_shape import RobotShape

if TYPE_CHECKING:
    from manifold3d import Manifold

ROUND = 96  # flat sides of the tube
_BEYOND = 1.0  # extra length of the tube at both ends of a body [mm]


class SolidMesh(NamedTuple):
    """A closed surface.

    Attributes:
        vertices: Points [mm], (v, 3).
        faces: Corners of triangles, counter-clockwise as seen from outside, (f, 3).
    """

    vertices: NDArray[np.float64]
    faces: NDArray[np.int64]


def body_solids(rest: RobotShape) -> list[SolidMesh]:
    """Return the rigid bodies of a robot, base first, each in its own frame [mm].

    Args:
        rest: The shape of the robot without loads.
    """
    return [_body(rest, body) for body in range(len(rest.position))]


def _body(rest: RobotShape, body: int) -> SolidMesh:
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
            own = (line - rest.position[body]) @ rest.rotation[body]
            across = np.array([np.cos(view), np.sin(view), 0.0])
            solid = solid - _through(np.stack([own @ across, own[:, 2]], axis=-1), view, rest)
    mesh = solid.to_mesh64()
    return SolidMesh(np.asarray(mesh.vert_properties)[:, :3], np.asarray(mesh.tri_verts, np.int64))


def _tube(rest: RobotShape, along: NDArray[np.float64]) -> Manifold:
    """Return the wall of the tube, longer than the body."""
    from manifold3d import Manifold

    low, high = float(along.min()) - _BEYOND, float(along.max()) + _BEYOND
    tube = rest.robot.tube
    outer, inner = (
        Manifold.cylinder(high - low, radius, circular_segments=ROUND)
        for radius in (tube.outer_radius, tube.inner_radius)
    )
    return (outer - inner).translate((0.0, 0.0, low))


def _through(polygon: NDArray[np.float64], view: float, rest: RobotShape) -> Manifold:
    """Return the prism of a polygon (across, along) seen from the side."""
    from manifold3d import CrossSection, FillRule, Manifold

    deep = 2.0 * rest.robot.tube.outer_diameter
    prism = Manifold.extrude(CrossSection([polygon], FillRule.NonZero), deep)
    across = np.array([np.cos(view), np.sin(view), 0.0])
    along = np.array([0.0, 0.0, 1.0])
    axes = np.stack([across, along, np.cross(across, along)], axis=1)
    middle = axes @ np.array([0.0, 0.0, -0.5 * deep])
    return prism.transform(np.concatenate([axes, middle[:, None]], axis=1))
