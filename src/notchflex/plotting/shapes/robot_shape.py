"""The shape of a robot in one state: points of its rigid bodies and flexures in space.

All of it follows from the chain: the walls of the bodies from the openings of the notches, the
flexures from their rods. A new kind of notch needs no code here.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property, lru_cache
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from notchflex.robot import Robot

if TYPE_CHECKING:
    from notchflex.mechanics.chain import Chain
    from notchflex.results import EquilibriumPath


Array = NDArray[np.float64]

# Integrates rotations of less than a radian along the way to 1e-12.
_NODES, _WEIGHTS = np.polynomial.legendre.leggauss(6)


def interpolate_poses(rotation: Array, position: Array, parts: int) -> tuple[Array, Array]:
    """Insert poses between k ones: rotations (..., k, 3, 3) and positions (..., k, 3).

    `parts` is the number of steps from each pose to the next one: (k - 1) parts + 1 poses.

    Example:
        >>> turned = np.array([[0.0, 0.0, 1.0], [0.0, 1.0, 0.0], [-1.0, 0.0, 0.0]])
        >>> line = np.eye(3)[[1, 0]] - np.eye(3)[1]
        >>> _, line = interpolate_poses(np.stack([np.eye(3), turned]), line, 2)
        >>> line.shape
        (3, 3)
    """
    if parts == 1:
        return rotation, position
    first, second = rotation[..., :-1, :, :], rotation[..., 1:, :, :]
    change = (np.swapaxes(first, -1, -2) @ second).reshape(-1, 3, 3)
    vector = Rotation.from_matrix(change).as_rotvec().reshape(*first.shape[:-1])
    step = np.einsum("...ba,...b->...a", first, np.diff(position, axis=-2))
    # The displacement is the mean rotation times the velocity of the twist.
    velocity = np.linalg.solve(_mean_rotation(vector), step[..., None])
    part = (np.arange(parts) / parts)[:, None, None]
    twist = part[..., 0] * vector[..., None, :]  # (..., k - 1, parts, 3)
    from_first = first[..., None, :, :]
    rotations = from_first @ rotation_of(twist)
    moved = from_first @ (_mean_rotation(twist) @ velocity[..., None, :, :]) * part
    positions = position[..., :-1, None, :] + moved[..., 0]
    rows, count = rotation.shape[:-3], rotations.shape[-4] * parts
    return (
        np.concatenate([rotations.reshape(*rows, count, 3, 3), rotation[..., -1:, :, :]], axis=-3),
        np.concatenate([positions.reshape(*rows, count, 3), position[..., -1:, :]], axis=-2),
    )


def rotation_of(vector: Array) -> Array:
    """Return the rotations (..., 3, 3) of rotation vectors (..., 3)."""
    return Rotation.from_rotvec(vector.reshape(-1, 3)).as_matrix().reshape(*vector.shape, 3)


def _mean_rotation(vector: Array) -> Array:
    """Return the mean rotation along a constant twist: the integral of exp(s w) over 0..1."""
    along = 0.5 * (1.0 + _NODES[:, None]) * vector[..., None, :]
    return np.einsum("i,...iab->...ab", 0.5 * _WEIGHTS, rotation_of(along))


Points = NDArray[np.float64]
Walls = list[tuple[float, float] | None]

FLEXURE_POINTS = 20  # a notch bends by less than a right angle; 2 degrees look smooth
UP = np.array([0.0, 0.0, 1.0])
HELD = 0.8  # length of clamped tube drawn below the base, in outer radii


@dataclass(frozen=True)
class FlexureShape:
    """One flexure from its start to its end: k sections [mm] in the frame of the base.

    The axes of a section are columns: across in the plane of bending, across out of it, along.
    """

    rotation: Points  # (k, 3, 3)
    position: Points  # of the neutral axis, (k, 3)
    spine: Points  # distance of its edge against the first axis, (k,)
    near: Points  # distance of its edge along the first axis, (k,)
    area: Points  # mm², (k,)

    def fibre(self, across: Any, out: Any = 0.0) -> Points:
        """Return the line at (across, out) from the neutral axis, (k, 3)."""
        offset = np.stack(np.broadcast_arrays(across, out, self.area)[:2], axis=-1)
        return self.position + np.einsum("kij,kj->ki", self.rotation[..., :2], offset)


@dataclass(frozen=True)
class RobotShape:
    """A robot of n notches in one state [mm], in the frame of its base."""

    robot: Robot
    chain: Chain
    rotation: Points  # of each body, (n + 1, 3, 3)
    position: Points  # proximal face centre of each body, (n + 1, 3)
    flexures: list[FlexureShape]  # base to tip

    @cached_property
    def body_length(self) -> Points:
        """Length of each body on the tube axis, (n + 1,)."""
        return np.asarray(self.chain.body_length)

    @property
    def tip(self) -> Points:
        """The tip on the tube axis."""
        return self.on_body(-1, [0.0, 0.0, self.body_length[-1]])

    def on_body(self, body: int, points: Any) -> Points:
        """Transform points (..., 3) from the frame of a body to that of the base."""
        return self.position[body] + np.asarray(points, float) @ self.rotation[body].T

    def walls(self, side_deg: float) -> Walls:
        """Return the ends of the wall of each body on a side [mm in its frame]; None if no wall."""
        return _walls(self.robot, tuple(self.body_length.tolist()), side_deg)

    def tendon(self, number: int) -> Points:
        """Return the line of a tendon (from 0) from below the base."""
        return np.concatenate([points for points, _ in self._along(number)])

    def contacts(self, number: int, radius: float | None = None) -> Points:
        """Return the friction contacts of a tendon (from 0), base to tip, (contacts, 3).

        They are the edges of the bodies that it passes, except those of the body that it ends in,
        at a radius [mm] from the tube axis, by default that of the tendon.
        """
        edges = [points for points, on_body in self._along(number, radius) if on_body]
        return np.concatenate(edges)[1:-2]  # neither the foot, nor both edges of the last body

    def _along(self, number: int, radius: float | None = None) -> Iterator[tuple[Points, bool]]:
        """Yield the pieces of a tendon, and whether each lies on a body or crosses a notch."""
        group = next(group for group in self.chain.groups if number in group.numbers)
        column = group.numbers.index(number)
        present, visits = (
            np.asarray(values)[:, column] for values in (group.present, group.visits)
        )
        walls = self.walls(self.robot.tendon[number].direction_deg)
        position = np.asarray(self.chain.tendon_entry)[number]
        if radius is not None:
            position = _radial(radius, self.robot.tendon[number].direction_deg)
        for body in range(len(self.position)):
            if body and not present[body - 1]:
                break
            if body and group.fibre is not None:
                across = np.asarray(group.fibre)[body - 1, column]
                yield self.flexures[body - 1].fibre(*across), False
            ends = walls[body]
            if ends is not None and (body == 0 or visits[body - 1]):
                yield self.on_body(body, [position + at * UP for at in ends]), True

    def lips(self, notch: int, radius: float | None = None) -> Points:
        """Return the point midway between the edges of a notch (from 0) that meet when it closes.

        It lies at a radius [mm] from the tube axis, by default the outer one.
        """
        outer = self.robot.tube.outer_radius if radius is None else radius
        candidates: list[tuple[float, Points]] = []
        for turn in (0.0, 180.0):
            side = self.robot.notches[notch].direction_deg + turn
            walls = self.walls(side)
            behind = walls[notch + 1]
            if behind is None:
                continue
            before = max(body for body in range(notch + 1) if walls[body] is not None)
            last = walls[before]
            assert last is not None
            across = _radial(outer, side)
            first = self.on_body(before, across + last[1] * UP)
            second = self.on_body(notch + 1, across + behind[0] * UP)
            candidates.append((float(np.linalg.norm(second - first)), 0.5 * (first + second)))
        return min(candidates, key=lambda item: item[0])[1]


def _radial(radius: float, direction_deg: float) -> Points:
    angle = np.radians(direction_deg)
    return radius * np.array([np.cos(angle), np.sin(angle), 0.0])


@lru_cache(maxsize=256)
def _walls(robot: Robot, body_length: tuple[float, ...], side_deg: float) -> Walls:
    # Imported late: the pictures alone need no solver.
    from notchflex._jax import constant
    from notchflex.mechanics.tendon import passage

    line = passage(robot.notches, constant(body_length), side_deg)
    walls: Walls = [(-HELD * robot.tube.outer_radius, float(line.base_leaves))]
    for visits, *ends in zip(line.visits, line.enters, line.leaves, strict=True):
        # What is fixed in the last body may enter it beyond its far face.
        walls.append((float(min(ends)), float(max(ends))) if visits else None)
    return walls


@lru_cache(maxsize=1)
def _node_poses() -> Any:
    """Return the compiled function; it is compiled once for each shape of the arrays."""
    from notchflex._jax import jax
    from notchflex.mechanics.flexure.rod_kinematics import node_poses

    return jax.jit(jax.vmap(node_poses))


def shape_from_modes(
    robot: Robot,
    chain: Chain,
    modes: Any,
    body_position: Points,
    body_rotation: Points,
    pieces: int = FLEXURE_POINTS,
) -> RobotShape:
    """Return the shape of a robot in one state; it does not depend on the pose of the base.

    The state is given by the amplitudes of the strain modes of each flexure, and the proximal face
    centre [mm], (n + 1, 3), and the rotation of each body. `pieces` is the minimum number of
    straight pieces of each flexure; the nodes of its rod may need more.
    """
    from notchflex._jax import jax

    turn, origin = body_rotation[0], body_position[0]
    rotation, position = turn.T @ body_rotation, (body_position - origin) @ turn
    rods = jax.tree.map(np.asarray, chain.rods)
    nodes = jax.tree.map(np.asarray, _node_poses()(chain.rods, np.asarray(modes)))
    # From the proximal body's frame: start, nodes; from the distal one's: end.
    first = np.concatenate([rods.start_rotation[:, None], nodes.rotation], axis=1)
    poses = np.concatenate([rods.start_offset[:, None], nodes.translation], axis=1)
    last = np.swapaxes(rods.end_rotation, -1, -2)
    axes = np.concatenate([rotation[:-1, None] @ first, (rotation[1:] @ last)[:, None]], axis=1)
    end = position[1:] - np.einsum("nij,njk,nk->ni", rotation[1:], last, rods.end_offset)
    along = position[:-1, None] + poses @ np.swapaxes(rotation[:-1], -1, -2)
    line = np.concatenate([along, end[:, None]], axis=1)
    flexures: dict[int, FlexureShape] = {}
    counts = (rods.length > 0.0).sum(axis=1)
    for count in np.unique(counts):  # flexures with the same number of nodes together
        same_count = np.flatnonzero(counts == count)
        with_length = np.stack([np.flatnonzero(rods.length[j] > 0.0) for j in same_count])
        kept = np.concatenate([np.zeros((len(same_count), 1), int), with_length + 1], axis=1)
        kept = np.concatenate([kept, np.full((len(same_count), 1), axes.shape[1] - 1)], axis=1)
        parts = -(-pieces // (int(count) + 1))
        row = same_count[:, None]
        turned, points = interpolate_poses(axes[row, kept], line[row, kept], parts)
        at_node = np.arange(points.shape[1]) / parts - 1.0
        section = rods.section
        for j, nodes_there, frames, places_there in zip(
            same_count, with_length, turned, points, strict=True
        ):
            spine, near, area = (
                np.interp(at_node, np.arange(count), values[j, nodes_there])
                for values in (section.edge_spine, section.edge_near, section.area)
            )
            flexures[int(j)] = FlexureShape(frames, places_there, spine, near, area)
    return RobotShape(robot, chain, rotation, position, [flexures[j] for j in range(len(counts))])


def shape_at(path: EquilibriumPath, step: int, pieces: int = FLEXURE_POINTS) -> RobotShape:
    """Return the shape of a robot at one step of a path; for `pieces` see `shape_from_modes`."""
    modes = path.run.solved.point.unknowns.modes[step]
    chain = _of_space(path.robot, path.chain.level, path.chain.refinement)
    poses = path.body_position[step], path.body_rotation[step]
    return shape_from_modes(path.robot, chain, modes, *poses, pieces)


@lru_cache(maxsize=16)
def _of_space(robot: Robot, level: str, refinement: int) -> Chain:
    """Return the chain of a robot with its flexures in space, with the modes of the flat one."""
    from notchflex.mechanics.chain import assemble

    plain = robot.with_value("notch.stiffness_factor", 1.0)  # the areas are those of the cut
    return assemble(plain, level, refinement=refinement, flat=False)


def shape_from_angles(
    robot: Robot, notch_angle: Points, pieces: int = FLEXURE_POINTS, level: str = "tendons"
) -> RobotShape:
    """Return the shape of a robot whose notches have given angles [rad], (n,).

    For `pieces` see `shape_from_modes`; `level` is that of the chain, with the nodes of its rods.
    """
    from notchflex.analysis import bodies_from_angles
    from notchflex.mechanics.contact import free_angle

    chain = _of_space(robot, level, 0)
    modes = np.zeros(np.shape(chain.stiffness))
    modes[:, 0] = notch_angle - free_angle(chain.rods)
    position, rotation = bodies_from_angles(robot, notch_angle[None])
    return shape_from_modes(robot, chain, modes, position[0], rotation[0], pieces)
