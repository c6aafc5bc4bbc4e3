"""The robot in the scene of a browser: solids are sent once and moved from then on.

All nodes are children of one node with the direction of the tube, in the frame of the base [mm].
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from notchflex.plotting.shapes.applied_loads import AppliedLoad, applied_loads
from notchflex.plotting.shapes.interpolation import rotation_of
from notchflex.plotting.shapes.robot_shape import HELD, RobotShape, shape_at
from notchflex.results import EquilibriumPath
from notchflex.robot import Robot
from notchflex.viewer.controls import GRAVITY, POINTING, ControlRanges, Controls, round_up
from notchflex.viewer.scene.camera import CameraPose, first_eye, framed, quaternions
from notchflex.viewer.scene.marks import LOAD, METAL, Marks, Shown, linear, strain_colour
from notchflex.viewer.scene.solids import PIECES, FlexureSurface, at_rest, body_solids, skins

if TYPE_CHECKING:
    import viser

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
        self.length += float(self.rest.body_length[-1])
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
            self._paint(path)
            self._marks.move(path, shape, self.shown)
            self._move_loads(path, shape)
            self._base_frame.visible = self._tip_frame.visible = self.shown.frames

    def _turn(self, pointing: str) -> None:
        self._pose = rotation_of(np.array(POINTING[pointing]))
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

    def _paint(self, path: EquilibriumPath) -> None:
        allowed = self.robot.material.allowed_strain
        for number, strain in enumerate(path.peak_strain[0]):
            colour = strain_colour(None if allowed is None else float(strain) / allowed)
            if colour != self._colours[number]:
                self._flexures[number].color = self._colours[number] = colour

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
        turn = rotation_of(np.array(POINTING[pointing]))
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
