"""The robot in the scene of a browser: solids are sent once and moved from then on.

Cuts go straight through the tube, so a body is its outline from the side, extruded across the tube
and intersected with the wall, without the flexures across the tube. The surface of a spine is one
piece of the wall; that of a strip across the tube is two, one on each side of the bore.

All nodes are children of one node with the direction of the tube, in the frame of the base [mm].
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from notchflex import EquilibriumPath, Robot, RobotShape
from notchflex.plotting import (
    HELD,
    AppliedLoad,
    applied_loads,
    body_corners,
    prism,
    shape_at,
    shape_from_angles,
    strip,
    tube_wall,
)
from notchflex.support import FlexureShape
from notchflex.viewer.controls import GRAVITY, POINTING, ControlRanges, Controls, round_up
from notchflex.viewer.scene.marks import LOAD, METAL, Marks, Shown, linear, strain_colour

if TYPE_CHECKING:
    import viser
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
    along = corners[:, 1]
    ends = float(along.min()) - _END_MARGIN, float(along.max()) + _END_MARGIN
    solid = _through(corners, view, rest) ^ tube_wall(rest.robot.tube, ends, ROUND)
    spine = rest.robot.geometry.has_spine
    for flexure in (body - 1, body):
        # A flexure on a spine lies between the bodies; one across the tube overlaps with them.
        if 0 <= flexure < len(rest.flexures) and not spine[flexure]:
            one = rest.flexures[flexure]
            local = (strip(one) - rest.position[body]) @ rest.rotation[body]
            corners = np.stack([local @ _across(view), local[:, 2]], axis=-1)
            solid = solid - _through(corners, view, rest)
    mesh = solid.to_mesh64()
    return np.asarray(mesh.vert_properties)[:, :3], np.asarray(mesh.tri_verts, np.int64)


def _across(view: float) -> Points:
    return np.array([np.cos(view), np.sin(view), 0.0])


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
    return shape_from_angles(robot, robot.geometry.free_angle, PIECES, level)


def skins(rest: RobotShape) -> list[FlexureSurface]:
    """Return the surfaces of all flexures, base to tip, of the shape from `at_rest`."""
    spine = rest.robot.geometry.has_spine
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


# In outer radii of the tube.
_FRAME = 2.2
# In lengths of the robot.
_ARROW, _SHORTEST = 0.35, 0.06
_SMOOTH = np.radians(30.0)  # flatter edges than this are shaded as round
_TRANSPARENT = 0.35
# Directions of lights, and their intensities.
_LIGHTS = (((0.6, -1.0, 0.8), 1.6), ((-1.0, -0.3, 0.5), 0.7), ((0.3, 1.0, 0.4), 0.7))
ROOT = "/robot"


class Scene:
    """A robot under `/robot` in the scene of a viser server; `reach` gives the length of arrows."""

    def __init__(
        self, server: viser.ViserServer, robot: Robot, reach: ControlRanges, shown: Shown
    ) -> None:
        self.server, self.robot, self.reach, self.shown = server, robot, reach, shown
        self.rest = at_rest(robot)
        self.length = float(np.linalg.norm(np.diff(self.rest.position, axis=0), axis=1).sum())
        self.length += float(robot.geometry.body_length[-1])
        with server.atomic():
            self._build()

    def _build(self) -> None:
        """Add all nodes."""
        import trimesh

        scene, rest, outer = self.server.scene, self.rest, self.robot.tube.outer_radius
        self._add_lights()
        self._root = scene.add_frame(ROOT, show_axes=False)
        self._bodies: list[Any] = []
        for number, mesh in enumerate(body_solids(rest)):
            solid = trimesh.Trimesh(*mesh, process=False)
            shaded = trimesh.graph.smooth_shade(solid, angle=_SMOOTH)
            name = f"{ROOT}/body_{number}"
            node = scene.add_mesh_simple(name, shaded.vertices, shaded.faces, color=METAL)
            self._bodies.append(node)
        self._skins: list[FlexureSurface] = skins(rest)
        self._skins_of: dict[str, list[FlexureSurface]] = {}
        style: dict[str, Any] = {"color": METAL, "flat_shading": True}
        self._flexures = [
            scene.add_mesh_simple(f"{ROOT}/flexure_{number + 1}", skin.at(one), skin.faces, **style)
            for number, (skin, one) in enumerate(zip(self._skins, rest.flexures, strict=True))
        ]
        self._see_through = False
        self._colours: list[Any] = [METAL] * len(self._flexures)
        self._marks = Marks(scene, ROOT, rest)
        axes: dict[str, Any] = {"axes_length": _FRAME * outer, "axes_radius": 0.05 * outer}
        self._base_frame = scene.add_frame(f"{ROOT}/base", **axes)
        self._tip_frame = scene.add_frame(f"{ROOT}/tip", **axes)
        self._arrows = scene.add_arrows(
            f"{ROOT}/loads",
            np.zeros((1, 2, 3)),
            linear([LOAD["force"]]),
            shaft_radius=0.12 * outer,
            head_radius=0.32 * outer,
            head_length=0.8 * outer,
            visible=False,
        )
        self._labels = [
            scene.add_label(f"{ROOT}/load_{number}", "", visible=False, anchor="bottom-center")
            for number in range(2)
        ]
        self.grid_cell = round_up(0.05 * self.length)  # mm
        size = 3.0 * self.length
        cells: dict[str, Any] = {"cell_size": self.grid_cell}
        cells["section_size"] = 5.0 * self.grid_cell
        self._grid = scene.add_grid("/grid", size, size, shadow_opacity=0.0, **cells)

    def _add_lights(self) -> None:
        # No environment map: it takes a browser without a graphics card half a minute. No shadows:
        # they cost it more than all the rest.
        scene = self.server.scene
        scene.configure_environment_map(None)
        scene.configure_default_lights(enabled=False)
        scene.add_light_hemisphere(
            "/lights/sky", sky_color=(255, 255, 255), ground_color=(150, 150, 160), intensity=2.2
        )
        for number, (position, bright) in enumerate(_LIGHTS):
            scene.add_light_directional(
                f"/lights/lamp_{number}", intensity=bright, position=position
            )

    def update(self, path: EquilibriumPath, controls: Controls) -> None:
        """Move everything to the state of a path of one step."""
        shape = shape_at(path, 0, PIECES)
        held = shape.position[:1] - [0.0, 0.0, HELD * self.robot.tube.outer_radius]
        self._seen = np.concatenate([held, shape.position, shape.tip[None]])
        with self.server.atomic():
            self._turn(controls.pointing)
            self._dress(path, shape)
            self._move(shape)
            allowed = self.robot.material.allowed_strain
            for number, strain in enumerate(path.peak_strain[0]):
                colour = strain_colour(None if allowed is None else float(strain) / allowed)
                if colour != self._colours[number]:
                    self._flexures[number].color = self._colours[number] = colour
            self._marks.move(path, shape, self.shown)
            self._move_loads(path, shape)
            self._base_frame.visible = self._tip_frame.visible = self.shown.frames

    def _turn(self, pointing: str) -> None:
        self._pose = Rotation.from_rotvec(POINTING[pointing]).as_matrix()
        self._root.wxyz = quaternions(self._pose[None])[0]
        outer = self.robot.tube.outer_radius
        lowest = {"up": HELD * outer, "sideways": 0.35 * self.length, "down": 1.1 * self.length}
        self._grid.position = (0.0, 0.0, -lowest[pointing])

    def _dress(self, path: EquilibriumPath, shape: RobotShape) -> None:
        """Replace the triangles of the flexures if the loads need another number of sections."""
        if len(self._skins[0].across.T) == len(shape.flexures[0].area):
            return
        level = path.chain.level
        if level not in self._skins_of:
            self._skins_of[level] = skins(at_rest(self.robot, level))
        self._skins = self._skins_of[level]
        for node, skin, sections in zip(self._flexures, self._skins, shape.flexures, strict=True):
            corners = skin.at(sections).astype(np.float32)
            more = len(corners) > len(node.vertices)
            # A triangle must never refer to missing corners, not even between two messages.
            if more:
                node.vertices = corners
            node.faces = skin.faces.astype(np.uint32)
            if not more:
                node.vertices = corners

    def _move(self, shape: RobotShape) -> None:
        turned = quaternions(shape.rotation)
        for node, position, turn in zip(self._bodies, shape.position, turned, strict=True):
            node.position, node.wxyz = position, turn
        if self._see_through != self.shown.see_through:
            self._see_through = self.shown.see_through
            for node in self._bodies:
                node.opacity = _TRANSPARENT if self._see_through else None
        self._tip_frame.position, self._tip_frame.wxyz = shape.tip, turned[-1]
        for node, skin, sections in zip(self._flexures, self._skins, shape.flexures, strict=True):
            node.vertices = skin.at(sections).astype(np.float32)

    def _move_loads(self, path: EquilibriumPath, shape: RobotShape) -> None:
        loads = applied_loads(path, 0, shape) if self.shown.loads else []
        self._arrows.visible = bool(loads)
        for label in self._labels[len(loads) :]:
            label.visible = False
        if not loads:
            return
        ends = np.stack([np.stack([one.point, one.point + self._arrow(one)]) for one in loads])
        self._arrows.colors = linear([LOAD[one.name] for one in loads])
        self._arrows.points = ends.astype(np.float32)
        for label, one, (_, end) in zip(self._labels, loads, ends, strict=False):
            label.text, label.position, label.visible = one.label, end, True

    def _arrow(self, one: AppliedLoad) -> NDArray[np.float64]:
        most = max(self.reach.force, GRAVITY * self.reach.mass)
        size = max(one.size / most, _SHORTEST / _ARROW) * _ARROW * self.length
        return size * one.vector / one.size

    def eye(self, pointing: str, side: bool = False, aspect: float = 1.0) -> CameraPose:
        """Return the first camera, with room for the robot to bend; see `first_eye`."""
        turn = Rotation.from_rotvec(POINTING[pointing]).as_matrix()
        return first_eye(self.robot.notches[0].direction_deg, self.length, turn, side, aspect)

    def picture_eye(self, toward: NDArray[np.float64], fov: float, aspect: float) -> CameraPose:
        """Return a camera that shows the whole robot in its current state; see `framed`."""
        outer = 1.3 * self.robot.tube.outer_radius
        box = outer * np.array(list(np.ndindex(2, 2, 2))) * 2.0 - outer
        points = (self._seen[:, None] + box).reshape(-1, 3)
        return framed(points @ self._pose.T, toward, aspect, fov, room=1.1)

    def remove(self) -> None:
        """Remove all nodes."""
        self._root.remove()
        self._grid.remove()
