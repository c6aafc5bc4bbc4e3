"""The robot in the scene of a browser: solids are sent once, and moved and bent from then on.

All nodes are children of one node with the direction of the tube, in the frame of the base [mm].
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from notchflex import EquilibriumPath, Robot, RobotShape
from notchflex.export import MovingSolids
from notchflex.plotting import HELD, applied_loads, lips, tendon_line
from notchflex.viewer.colours import (
    CLOSED,
    LOAD,
    METAL,
    TENDON,
    UNKNOWN,
    add_arrows,
    contact_colours,
    linear,
    rgb,
    strain_colour,
)
from notchflex.viewer.controls import GRAVITY, POINTING, ControlRanges, round_up
from notchflex.viewer.overlays import Ask, ReachableCloud, SensedArrow, TipHandle
from notchflex.viewer.session import Session

if TYPE_CHECKING:
    import viser

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
    return CameraPose(middle @ axes - float(away.max()) * forward, middle @ axes)


def first_eye(
    direction_deg: float, length: float, turn: Vector, side: bool, aspect: float
) -> CameraPose:
    """Return a camera for a robot at rest of a length [mm], with room to bend in a direction.

    `turn` is the rotation of its base. With `side` it looks normal to the plane in which the robot
    bends, else a little from above.
    """
    angle, along = np.radians(direction_deg), np.array([0.0, 0.0, 1.0])
    across = np.array([np.cos(angle), np.sin(angle), 0.0])
    # To either side it is about half as wide as it is long.
    corners = [across * x + along * z for x in (-0.2, 0.75) for z in (-0.15, 1.05)]
    toward = turn @ np.cross(across, along)
    if abs(toward[2]) > 0.9:  # its plane is level: from the front
        toward = np.array([0.0, -1.0, 0.0])
    if not side:
        toward = toward + 0.3 * np.cross(along, toward) + 0.35 * along
    return framed(length * np.stack(corners) @ turn.T, toward, aspect, room=1.15)


def quaternion(rotation: Vector) -> Vector:
    """Return rotations (..., 3, 3) as (w, x, y, z)."""
    return Rotation.from_matrix(rotation).as_quat(scalar_first=True)


def _axes(toward: Vector) -> tuple[Vector, Vector, Vector]:
    """Return forward, right and up of a camera that looks against `toward`."""
    forward = -toward / np.linalg.norm(toward)
    right = np.cross(forward, [0.0, 0.0, 1.0])
    right = right / np.linalg.norm(right)
    return forward, right, np.cross(right, forward)


# In outer radii of the tube: length of frames, thickness of tendons, radius of marks, and distance
# of their centres from the tube axis, outside the tube that hides them.
_FRAME, _TENDON, _CONTACT, _LIPS = 2.2, 0.09, 0.13, 0.2
_CONTACT_AT, _LIPS_AT = 1.2, 1.55
# In lengths of the robot.
_ARROW, _SHORTEST = 0.35, 0.06  # of a load
_HANDLE, _SENSED = 0.25, 0.3
_SMOOTH = np.radians(30.0)  # flatter edges than this are shaded as round
_TRANSPARENT = 0.35
# Directions of lights, and their intensities.
_LIGHTS = (((0.6, -1.0, 0.8), 1.6), ((-1.0, -0.3, 0.5), 0.7), ((0.3, 1.0, 0.4), 0.7))
ROOT = "/robot"


@dataclass
class Shown:
    """What is visible in the scene."""

    tendons: bool = True
    contacts: bool = True
    frames: bool = True
    loads: bool = True
    see_through: bool = False
    handle: bool = False
    cloud: bool = False
    sensed: bool = False


class Scene:
    """A robot under `/robot` in the scene of a viser server, with handle, cloud and sensed force.

    Args:
        server: The server.
        robot: The robot.
        reach: Ends of the sliders; the length of arrows follows from them.
        shown: What is visible.
        ask: Adds a task of the solver thread.
        aim: Called with each place of the dragged handle; see `TipHandle`.
    """

    def __init__(
        self,
        server: viser.ViserServer,
        robot: Robot,
        reach: ControlRanges,
        shown: Shown,
        ask: Ask,
        aim: Callable[[Vector, bool], None],
    ) -> None:
        self.server, self.robot, self.reach, self.shown = server, robot, reach, shown
        self.length = length = robot.geometry.length
        self._outer = robot.tube.outer_radius
        self._solids = MovingSolids(robot, HELD * self._outer)
        self.grid_cell = round_up(0.05 * self.length)  # mm
        with server.atomic():
            self._add_lights()
            self._root = server.scene.add_frame(ROOT, show_axes=False)
            self._add_solids()
            self._add_marks()
            self.handle = TipHandle(server.scene, _HANDLE * length, aim)
            self.cloud = ReachableCloud(server.scene, length, ask)
            self.sensed = SensedArrow(server.scene, self._outer, _SENSED * length, ask)
            size = 3.0 * length
            self._grid = server.scene.add_grid(
                "/grid", size, size, shadow_opacity=0.0, cell_size=self.grid_cell,
                section_size=5.0 * self.grid_cell,
            )  # fmt: skip

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

    def _add_solids(self) -> None:
        import trimesh

        scene, metal = self.server.scene, rgb(METAL)
        self._bodies: list[Any] = []
        for number, surface in enumerate(self._solids.bodies):
            solid = trimesh.Trimesh(*surface, process=False)
            shaded = trimesh.graph.smooth_shade(solid, angle=_SMOOTH)
            name = f"{ROOT}/body_{number}"
            node = scene.add_mesh_simple(name, shaded.vertices, shaded.faces, color=metal)
            self._bodies.append(node)
        self._flexures: list[Any] = [
            scene.add_mesh_simple(
                f"{ROOT}/flexure_{number}", *surface, color=metal, flat_shading=True
            )
            for number, surface in enumerate(self._solids.flexures, start=1)
        ]

    def _add_marks(self) -> None:
        import trimesh

        scene, outer = self.server.scene, self._outer
        ball = trimesh.creation.icosphere(subdivisions=2, radius=_CONTACT * outer)
        nothing, geometry = np.zeros((1, 2, 3)), self.robot.geometry
        rest, tendons = geometry.shape(geometry.free_angle), range(self.robot.number_of_tendons)
        thick: dict[str, Any] = {"thickness": _TENDON * outer}
        self._tendons: list[Any] = [
            scene.add_line_segments(f"{ROOT}/tendon_{tendon + 1}", nothing, rgb(TENDON), **thick)
            for tendon in tendons
        ]
        places = [rest.contacts(tendon) for tendon in tendons]
        self._contacts: list[Any] = [
            scene.add_batched_meshes_simple(
                f"{ROOT}/contacts_{number}", ball.vertices, ball.faces, lod="off",
                batched_wxyzs=np.tile([1.0, 0.0, 0.0, 0.0], (len(points), 1)),
                batched_positions=points, batched_colors=linear([UNKNOWN] * len(points)),
            )
            for number, points in enumerate(places, start=1)
        ]  # fmt: skip
        self._closed = [
            scene.add_icosphere(f"{ROOT}/closed_{number}", _LIPS * outer, color=rgb(CLOSED))
            for number in range(1, self.robot.number_of_notches + 1)
        ]
        self._frames = [
            scene.add_frame(f"{ROOT}/{name}", axes_length=_FRAME * outer, axes_radius=0.05 * outer)
            for name in ("base", "tip")
        ]
        self._arrows = add_arrows(scene, f"{ROOT}/loads", METAL, outer)
        self._labels = [
            scene.add_label(f"{ROOT}/load_{number}", "", visible=False, anchor="bottom-center")
            for number in range(2)
        ]

    def update(self, session: Session, still: bool) -> None:
        """Move everything to the state of a session; `still`: it does not move on at once."""
        path, shown = session.solved, self.shown
        shape, flexures = self._solids.at(path)
        held = shape.position[:1] - [0.0, 0.0, HELD * self._outer]
        self._seen = np.concatenate([held, shape.position, shape.tip[None]])
        with self.server.atomic():
            self._turn(session.pointing)
            self._move_bodies(shape)
            materials, strains = self.robot.materials[1:], path.peak_strain[0].tolist()
            of = zip(self._flexures, flexures, strains, materials, strict=True)
            for node, points, strain, material in of:
                node.vertices = points
                node.color = rgb(strain_colour(strain, material.allowed_strain))
            self._move_marks(path, shape)
            self._move_loads(path, shape)
            self.handle.update(path.tip_position[0], shown.handle)
            self.cloud.update(session.robot, session.controls, self.reach, shown.cloud)
            self.sensed.update(session, shown.sensed, still)

    def _turn(self, pointing: str) -> None:
        self._pose = Rotation.from_rotvec(POINTING[pointing]).as_matrix()
        self._root.wxyz = quaternion(self._pose)
        lowest = {"up": HELD * self._outer, "sideways": 0.35 * self.length}
        self._grid.position = (0.0, 0.0, -lowest.get(pointing, 1.1 * self.length))

    def _move_bodies(self, shape: RobotShape) -> None:
        turned, opacity = (
            quaternion(shape.rotation),
            _TRANSPARENT if self.shown.see_through else None,
        )
        for node, position, turn in zip(self._bodies, shape.position, turned, strict=True):
            node.position, node.wxyz, node.opacity = position, turn, opacity
        _, tip = self._frames
        tip.position, tip.wxyz = shape.tip, turned[-1]
        for frame in self._frames:
            frame.visible = self.shown.frames

    def _move_marks(self, path: EquilibriumPath, shape: RobotShape) -> None:
        for tendon, (line, balls) in enumerate(zip(self._tendons, self._contacts, strict=True)):
            line.visible, balls.visible = self.shown.tendons, self.shown.contacts
            points = tendon_line(shape, tendon)
            line.points = np.stack([points[:-1], points[1:]], axis=1)
            balls.batched_positions = shape.contacts(tendon, _CONTACT_AT * self._outer)
            balls.batched_colors = linear(contact_colours(path[0], tendon))
        for notch, (ball, closed) in enumerate(zip(self._closed, path.closed[0], strict=True)):
            ball.visible = bool(closed)
            if closed:
                ball.position = lips(shape, notch, _LIPS_AT * self._outer)

    def _move_loads(self, path: EquilibriumPath, shape: RobotShape) -> None:
        loads = applied_loads(path, 0, shape) if self.shown.loads else []
        self._arrows.visible = bool(loads)
        for label in self._labels[len(loads) :]:
            label.visible = False
        if not loads:
            return
        most = max(self.reach.force, GRAVITY * self.reach.mass)
        sizes = [max(_ARROW * load.size / most, _SHORTEST) * self.length for load in loads]
        ends = [
            [load.point, load.point + size * load.vector / load.size]
            for load, size in zip(loads, sizes, strict=True)
        ]
        self._arrows.colors = linear(LOAD[load.name] for load in loads)
        self._arrows.points = np.array(ends)
        for label, load, (_, end) in zip(self._labels, loads, ends, strict=False):
            label.text, label.position, label.visible = load.label, end, True

    def eye(self, pointing: str, side: bool = False, aspect: float = 1.0) -> CameraPose:
        """Return the first camera, with room for the robot to bend; see `first_eye`."""
        turn = Rotation.from_rotvec(POINTING[pointing]).as_matrix()
        return first_eye(self.robot.notches[0].direction_deg, self.length, turn, side, aspect)

    def picture_eye(self, toward: NDArray[np.float64], fov: float, aspect: float) -> CameraPose:
        """Return a camera that shows the whole robot in its current state; see `framed`."""
        box = 1.3 * self._outer * (2.0 * np.array(list(np.ndindex(2, 2, 2))) - 1.0)
        points = (self._seen[:, None] + box).reshape(-1, 3)
        return framed(points @ self._pose.T, toward, aspect, fov, room=1.1)

    def remove(self) -> None:
        """Remove all nodes."""
        for part in (self._root, self._grid, self.handle.node, self.cloud, self.sensed):
            part.remove()
