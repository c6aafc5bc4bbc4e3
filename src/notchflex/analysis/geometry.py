"""The geometry of a robot, as `robot.geometry`, and its shape in a state, as `state.shape`."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from functools import cached_property, lru_cache
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from notchflex._jax import constant, jax, jit
from notchflex._values import read_only
from notchflex.analysis.kinematics import axis_places, bodies_from_angles, points_on_axis
from notchflex.errors import InputError
from notchflex.mechanics.chain import Chain, assemble
from notchflex.mechanics.contact import closing_angles, free_angle
from notchflex.mechanics.flexure.rod_kinematics import node_poses
from notchflex.mechanics.masses import body_lengths
from notchflex.mechanics.tendon import TUBE_AXIS, Holes, holes_of, passage
from notchflex.results.state import Equilibrium
from notchflex.robot import Robot
from notchflex.robot.cuts import CutLayout

Array = NDArray[np.float64]
Wall = tuple[float, float] | None


@dataclass(frozen=True)
class Geometry:
    """Bodies, cuts and walls of a robot of n notches without loads. Units mm, g, rad.

    A body is a rigid piece of the tube; body 0 is the base. Its frame has its origin on the tube
    axis at its proximal face, and z along the tube.

    Attributes:
        robot: The robot.

    Example:
        >>> from notchflex import load_robot
        >>> geometry = load_robot("pacheco2021-a").geometry
        >>> geometry.body_start.round(9).tolist(), geometry.body_length[1:].round(9).tolist()
        ([0.0, 0.8, 2.8, 4.8, 6.8, 8.8], [1.2, 1.2, 1.2, 1.2, 1.2])
        >>> (
        ...     round(float(np.degrees(geometry.closing_angle[0])), 2),
        ...     geometry.cuts[0].cuts[0].side_deg,
        ... )
        (30.63, 0.0)
    """

    robot: Robot

    @cached_property
    def body_length(self) -> Array:
        """Length of every body on the tube axis."""
        return read_only(body_lengths(self.robot.tube, self.robot.notches))

    @cached_property
    def body_start(self) -> Array:
        """Distance of every body's origin from that of the base in the straight robot."""
        straight, _ = bodies_from_angles(self.robot, np.zeros((1, self.robot.number_of_notches)))
        return read_only(straight[0, :, 2])

    @property
    def length(self) -> float:
        """Length of the straight robot, base included."""
        return float(self.body_start[-1] + self.body_length[-1])

    @property
    def body_mass(self) -> Array:
        """Mass of every body with its share of the notches; 0 where the material has no density."""
        return read_only(self._chain.body_mass)

    @property
    def body_centre(self) -> Array:
        """Centre of mass of every body, in its frame."""
        return read_only(self._chain.body_centre)

    @cached_property
    def holes(self) -> Holes | None:
        """Holes of the tendons in all bodies; None where all are parallel to the tube."""
        chain = self._chain
        return holes_of(self.robot.tendon, chain.tendon_entry, chain.rods, chain.body_length)

    @property
    def free_angle(self) -> Array:
        """Angle of every notch without loads: its precurvature."""
        return read_only(free_angle(self._chain.rods))

    @property
    def closing_angle(self) -> Array:
        """Angle at which every notch closes; infinite for one that does not close by bending."""
        return read_only(self.free_angle + closing_angles(self._chain.rods))

    @property
    def has_spine(self) -> NDArray[np.bool_]:
        """Whether every notch leaves a spine along the tube, not strips across it."""
        return read_only(np.asarray(self._chain.rods.section.outer_radius)[:, 0] > 0.0)

    @property
    def notch_stiffness(self) -> Array:
        """Bending stiffness of every free notch, N mm/rad."""
        return read_only(self._chain.stiffness[:, 0])

    @cached_property
    def cuts(self) -> tuple[CutLayout, ...]:
        """What every notch removes from the straight tube, measured from the base along it.

        Of what is not cut, but known by numbers or a backbone, it is the whole gap.

        Raises:
            InputError: A kind of notch does not know its cuts.
        """
        tube, start = self.robot.tube, self.robot.tube.base_length
        neighbours, layouts = (None, *self.robot.notches, None), list[CutLayout]()
        for number, notch in enumerate(self.robot.notches):
            beside = neighbours[number], neighbours[number + 2]
            layout = notch.cut_layout(notch.tube or tube, *beside)
            if layout is None:
                raise InputError.UNSUPPORTED(
                    f'the cuts of a notch of kind = "{notch.kind}" are not known, so there is no '
                    "drawing, pattern or solid of it; describe it by a kind that is cut, such as "
                    '"arc" (a new kind knows its cuts by a method `cut_layout`).'
                )
            layouts.append(layout._replace(cuts=tuple(cut.moved(start) for cut in layout.cuts)))
            start += layout.length
        return tuple(layouts)

    @lru_cache(maxsize=256)  # noqa: B019
    def walls(self, side_deg: float, radius: float | None = None) -> tuple[Wall, ...]:
        """Return where a line along the wall enters and leaves every body.

        Args:
            side_deg: The side of the tube, deg.
            radius: Distance of the line from the tube axis, mm; by default it lies on the outer
                surface.

        Returns:
            Both distances from the origin of the body, mm; None for a body without wall there.
        """
        robot, lengths = self.robot, constant(self.body_length)
        line = passage(robot.notches, lengths, side_deg, robot.tube.outer_radius, radius)
        ends = np.stack([line.enters, line.leaves], axis=1).tolist()
        body_walls = (
            tuple(interval) if visits else None
            for visits, interval in zip(line.visits, ends, strict=True)
        )
        return ((0.0, float(line.base_leaves)), *body_walls)

    def shape(self, notch_angle: ArrayLike, level: str = "tendons") -> RobotShape:
        """Return the shape that notch angles give, in the frame of the base.

        Args:
            notch_angle: Angle of every notch, precurvature included, rad, (n,).
            level: Loads whose sections the flexures have: "tendons", "plane" or "space".

        Raises:
            InputError: Not one finite angle per notch.
        """
        angles = np.asarray(notch_angle, float)
        (position,), (rotation,) = bodies_from_angles(self.robot, angles)
        chain = _chain_of(self.robot, level, 0)
        modes = np.zeros(np.shape(chain.stiffness))
        modes[:, 0] = angles - self.free_angle
        return _shape(self.robot, chain, modes, position, rotation)

    @cached_property
    def _chain(self) -> Chain:
        return assemble(self.robot, flat=False)


@dataclass(frozen=True, eq=False)
class FlexureShape:
    """A flexure as k sections from its start to its end, mm.

    Attributes:
        rotation: Axes of every section as columns: across in the plane of bending, across out of
            it, along; (k, 3, 3).
        position: The neutral axis in every section, (k, 3).
        spine: Distance of the edge of every section against its first axis, (k,).
        near: Distance of its edge along that axis, (k,).
        area: Area of every section, mm^2, (k,).
    """

    rotation: Array
    position: Array
    spine: Array
    near: Array
    area: Array

    def fibre(self, across: ArrayLike, out: ArrayLike = 0.0) -> Array:
        """Return the line at (across, out) from the neutral axis, mm, (k, 3)."""
        offset = np.stack(np.broadcast_arrays(across, out, self.area)[:2], axis=-1)
        return self.position + np.einsum("kij,kj->ki", self.rotation[..., :2], offset)


@dataclass(frozen=True, eq=False)
class RobotShape:
    """A robot of n notches in one state, mm: bodies, flexures, tendons, points on the axis.

    Attributes:
        robot: The robot.
        rotation: Rotation of every body, (n + 1, 3, 3).
        position: Origin of every body, (n + 1, 3).
        flexures: The flexures, base to tip.

    Example:
        >>> from notchflex import Load, load_robot, solve
        >>> state = solve(load_robot("pacheco2021-a"), Load(tension=1.0))
        >>> bool(np.allclose(state.shape.tip, state.tip_position))
        True
        >>> state.shape.tendon(0).shape
        (27, 3)
    """

    robot: Robot
    rotation: Array
    position: Array
    flexures: tuple[FlexureShape, ...]

    @property
    def tip(self) -> Array:
        """The tip, on the tube axis."""
        return self.on_body(-1, [0.0, 0.0, self.robot.geometry.body_length[-1]])

    def on_body(self, body: int, points: ArrayLike) -> Array:
        """Return points that are given in the frame of a body, (..., 3)."""
        return self.position[body] + np.asarray(points, float) @ self.rotation[body].T

    def axis(self, axis_at: ArrayLike) -> Array:
        """Return points on the tube axis, mm.

        Args:
            axis_at: Their distances from the base when the robot is straight, mm, (m,).

        Raises:
            InputError: A distance is beyond the tip.
        """
        poses = constant(self.position), constant(self.rotation)
        return np.asarray(points_on_axis(axis_places(self.robot, axis_at), *poses))

    def tendon(self, number: int) -> Array:
        """Return the line of a tendon (counted from 0) from the base to its end."""
        return np.concatenate([points for points, _ in self._along(number)])

    def contacts(self, number: int, radius: float | None = None) -> Array:
        """Return the friction contacts of a tendon (counted from 0), base to tip.

        They are the edges of the bodies that it passes, except those of the body that it ends in.

        Args:
            number: The tendon.
            radius: Distance from the tube axis, mm, by default that of the tendon.
        """
        edges = [points for points, on_body in self._along(number, radius) if on_body]
        return np.concatenate(edges)[1:-2]  # neither the foot, nor both edges of the last body

    def _along(self, number: int, radius: float | None = None) -> Iterator[tuple[Any, bool]]:
        """Yield the pieces of a tendon, and whether each lies on a body or crosses a notch."""
        tendon, walls = self.robot.tendon[number], self.robot.geometry.walls
        last, holes = tendon.end_body or len(self.flexures), self.robot.geometry.holes
        angle = np.radians(tendon.direction_deg)
        across = np.array([np.cos(angle), np.sin(angle)])
        across *= tendon.radius if radius is None else radius
        for body, wall in enumerate(walls(tendon.direction_deg)[: last + 1]):
            if holes is not None and wall is not None:
                points = np.stack([holes.enters[body, number], holes.leaves[body, number]])
                yield self.on_body(body, points + np.array(wall)[:, None] * TUBE_AXIS), True
                continue
            if body and tendon.path == "wall-arc":  # the fibre that meets the body here
                flexure, point = self.flexures[body - 1], self.on_body(body, [*across, 0.0])
                place = (point - flexure.position[-1]) @ flexure.rotation[-1]
                yield flexure.fibre(*place[:2]), False
            if wall is not None:
                yield self.on_body(body, [[*across, end] for end in sorted(wall)]), True

    def from_base(self) -> RobotShape:
        """Return the same shape in the frame of its base."""
        turn, origin = self.rotation[0], self.position[0]

        def seen(part: Any) -> Any:
            position = (part.position - origin) @ turn
            return replace(part, rotation=turn.T @ part.rotation, position=position)

        return replace(seen(self), flexures=tuple(map(seen, self.flexures)))


def shape_of(state: Equilibrium) -> RobotShape:
    """Return the shape of a state, in the world."""
    path, robot = state.path, state.robot
    chain = _chain_of(robot, path.chain.level, path.chain.refinement)
    modes = path.run.solved.point.unknowns.modes[state.step]
    return _shape(robot, chain, modes, state.body_position, state.body_rotation)


@lru_cache(maxsize=16)
def _chain_of(robot: Robot, level: str, refinement: int) -> Chain:
    """Return the chain of a robot with its flexures in space, with the modes of the flat one."""
    plain = robot.with_value("notch.stiffness_factor", 1.0)  # the areas are those of the cut
    return assemble(plain, level, refinement=refinement, flat=False)


_nodes = jit(jax.vmap(node_poses))


def _shape(robot: Robot, chain: Chain, modes: Any, position: Array, rotation: Array) -> RobotShape:
    """Return the shape of bodies and of flexures with amplitudes of their strain modes."""
    rods, nodes = jax.tree.map(np.asarray, (chain.rods, _nodes(chain.rods, np.asarray(modes))))
    # From the proximal body's frame: start, nodes; from the distal one's: end.
    first = np.concatenate([rods.start_rotation[:, None], nodes.rotation], axis=1)
    places = np.concatenate([rods.start_offset[:, None], nodes.translation], axis=1)
    last = rotation[1:] @ np.swapaxes(rods.end_rotation, -1, -2)
    axes = np.concatenate([rotation[:-1, None] @ first, last[:, None]], axis=1)
    end = position[1:] - np.einsum("nij,nj->ni", last, rods.end_offset)
    along = position[:-1, None] + places @ np.swapaxes(rotation[:-1], -1, -2)
    line = np.concatenate([along, end[:, None]], axis=1)
    flexures: list[FlexureShape] = []
    for notch, length in enumerate(rods.length):
        segments = np.flatnonzero(length)  # others fill up the arrays
        shown, ends = np.pad(segments + 1, 1, constant_values=(0, -1)), np.pad(segments, 1, "edge")
        edges = rods.section.edge_spine, rods.section.edge_near, rods.section.area
        values = (edge[notch, ends] for edge in edges)
        flexures.append(FlexureShape(axes[notch, shown], line[notch, shown], *values))
    return RobotShape(robot, rotation, position, tuple(flexures))
