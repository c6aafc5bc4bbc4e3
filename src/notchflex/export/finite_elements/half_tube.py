"""Second-order hexahedra of half a notched tube, as structured blocks.

The tube is cut by the plane in which it bends; z runs along it, the notches open toward +x and
the half with y >= 0 is meshed. Angles are counted from the spine (-x).
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from jaxtyping import Float, Int

from notchflex.errors import InputError
from notchflex.export.finite_elements.options import DeckOptions
from notchflex.robot import ArcNotch, Robot

# Corners and middle nodes of an element in steps of half an element, as CalculiX counts them: first
# along the angle, then along the radius (which makes a right-handed frame with z).
_NODES = np.array(
    [
        *[(0, 0, 0), (2, 0, 0), (2, 2, 0), (0, 2, 0), (0, 0, 2), (2, 0, 2), (2, 2, 2), (0, 2, 2)],
        *[(1, 0, 0), (2, 1, 0), (1, 2, 0), (0, 1, 0), (1, 0, 2), (2, 1, 2), (1, 2, 2), (0, 1, 2)],
        *[(0, 0, 1), (2, 0, 1), (2, 2, 1), (0, 2, 1)],
    ]
)[:, [1, 0, 2]]

_REMEDY = "export the solid with --step and mesh it by gmsh, with second-order tetrahedra"


@dataclass(frozen=True)
class HalfTube:
    """A mesh of m elements. Units mm.

    Attributes:
        nodes: Number of every node on the grid of half elements, -1 where there is none; (radii,
            angles, heights).
        place: Places of the nodes, in the order of their numbers, from 1; (nodes, 3).
        elements: Nodes of every element, (m, 20).
        cell: Which cell of the grid every element is, (radius, angle, z); (m, 3).
        faces: Indices along z of the grid at the first and last edge of every notch; (n, 2).
        opening: Index of the angle on the grid from which on the notches are open.
    """

    nodes: Int[np.ndarray, "a b c"]
    place: Float[np.ndarray, "nodes 3"]
    elements: Int[np.ndarray, "m 20"]
    cell: Int[np.ndarray, "m 3"]
    faces: Int[np.ndarray, "n 2"]
    opening: int

    @property
    def heights(self) -> Float[np.ndarray, " c"]:
        """Height of every layer of the grid, mm."""
        spine = self.nodes[0, 0, :]  # even layers have corners here, odd ones middle nodes
        return self.place[spine - 1, 2]

    def layer(self, index: int) -> Int[np.ndarray, " k"]:
        """Return the nodes of one layer across the tube, by its index along z."""
        numbers = self.nodes[:, :, index].ravel()
        return numbers[numbers > 0]

    def in_plane(self) -> Int[np.ndarray, " k"]:
        """Return the nodes in the plane of symmetry."""
        numbers = self.nodes[:, [0, -1], :].ravel()
        return numbers[numbers > 0]


def check_shape(robot: Robot) -> list[ArcNotch]:
    """Return the notches of a robot that the mesh can be made of.

    Raises:
        InputError: A notch is no arc, has a precurvature, or opens to another side than the first,
            or its cut leaves a solid strip.
    """
    notches: list[ArcNotch] = []
    for number, notch in enumerate(robot.notches, start=1):
        if not isinstance(notch, ArcNotch):
            raise InputError.UNSUPPORTED(
                f"notch {number} of {robot.name} is of kind {notch.kind!r}: a deck of finite "
                f'elements is made of notches of kind "arc" only; {_REMEDY}'
            )
        if abs(notch.precurvature_deg) > 0.0:
            raise InputError.UNSUPPORTED(
                f"notch {number} of {robot.name} has a precurvature, and the mesh is straight: "
                "set notch.precurvature_deg=0"
            )
        if (notch.direction_deg - robot.notches[0].direction_deg) % 360.0:
            raise InputError.UNSUPPORTED(
                f"notch {number} of {robot.name} opens to another side than notch 1: half of the "
                f"tube is meshed, so that all must open to one side; {_REMEDY}"
            )
        tube = robot.tube
        if notch.cut == "off-axis" and notch.depth - tube.outer_radius >= tube.inner_radius:
            raise InputError.UNSUPPORTED(
                f"notch {number} of {robot.name} leaves a solid strip, without bore: the mesh "
                f"needs a depth of less than {tube.outer_radius + tube.inner_radius:g} mm"
            )
        notches.append(notch)
    return notches


def edge_angle(notch: ArcNotch, robot: Robot, radius: Float[np.ndarray, " a"]) -> Any:
    """Return half the angle of the wall that a notch leaves, at some radii, rad."""
    tube = robot.tube
    if notch.cut == "off-axis":
        return np.arccos((notch.depth - tube.outer_radius) / radius)
    read_at = {
        "outer": tube.outer_radius,
        "mid-wall": 0.5 * (tube.outer_radius + tube.inner_radius),
        "inner": tube.inner_radius,
    }[notch.depth_at]
    return np.full(len(radius), np.arccos((notch.depth - tube.outer_radius) / read_at))


def half_tube(robot: Robot, options: DeckOptions) -> HalfTube:
    """Mesh half of a robot.

    Raises:
        InputError: The robot has another shape than the mesh can have.
    """
    notches = check_shape(robot)
    height, edges_at, faces = _layers(robot, notches, options)
    radius = np.linspace(robot.tube.inner_radius, robot.tube.outer_radius, 2 * options.wall + 1)
    edge = np.stack([edge_angle(notch, robot, radius) for notch in notches])  # (n, radii)
    # Between two notches the lines go over from the edge of one to that of the next.
    edge = np.repeat(edge, 2, axis=0)
    at = np.stack([np.interp(height, edges_at, each) for each in edge.T])
    to_edge = 1.0 - _graded(2 * options.spine)[::-1]
    beyond = _graded(2 * options.opening)[1:]
    angle = np.concatenate(
        [to_edge[:, None, None] * at, at + beyond[:, None, None] * (np.pi - at)]
    ).transpose(1, 0, 2)
    place = np.stack(
        [
            -radius[:, None, None] * np.cos(angle),
            radius[:, None, None] * np.sin(angle),
            np.broadcast_to(height, angle.shape),
        ],
        axis=-1,
    )
    return _numbered(place, faces, 2 * options.spine)


def _layers(
    robot: Robot, notches: list[ArcNotch], options: DeckOptions
) -> tuple[Float[np.ndarray, " c"], list[float], Int[np.ndarray, "n 2"]]:
    """Heights of the layers, of both edges of every notch, and the indices of these layers."""
    height: list[np.ndarray] = [np.zeros(1)]
    edges: list[float] = []
    faces: list[tuple[int, int]] = []
    base, top = robot.tube.base_length, 0.0
    if base > 0.0:
        height.append(base * _both_ends(2 * options.uncut)[1:])
        top = base
    for notch in notches:
        start = sum(map(len, height)) - 1
        height.append(top + notch.height * np.linspace(0.0, 1.0, 2 * options.notch + 1)[1:])
        faces.append((start, start + 2 * options.notch))
        edges += [top, top + notch.height]
        top += notch.height
        if notch.uncut_length > 0.0:
            height.append(top + notch.uncut_length * _both_ends(2 * options.uncut)[1:])
            top += notch.uncut_length
    return np.concatenate(height), edges, np.array(faces)


def _graded(count: int) -> Float[np.ndarray, " k"]:
    """Places from 0 to 1, closer at 0; middle nodes half way between corners."""
    corner = np.linspace(0.0, 1.0, count // 2 + 1) ** 1.4
    return np.interp(np.arange(count + 1), np.arange(0, count + 1, 2), corner)


def _both_ends(count: int) -> Float[np.ndarray, " k"]:
    """Places from 0 to 1, closer at both ends; middle nodes half way between corners."""
    even = np.linspace(0.0, 1.0, count // 2 + 1)
    corner = even - 0.09 * np.sin(2.0 * np.pi * even)
    return np.interp(np.arange(count + 1), np.arange(0, count + 1, 2), corner)


def _numbered(
    place: Float[np.ndarray, "a b c 3"], faces: Int[np.ndarray, "n 2"], opening: int
) -> HalfTube:
    """Drop the cells of the notches and number the nodes that are left."""
    cells = np.stack(
        np.meshgrid(*(np.arange(size // 2) for size in place.shape[:3]), indexing="ij"), axis=-1
    ).reshape(-1, 3)
    inside = [(2 * cells[:, 2] >= low) & (2 * cells[:, 2] < high) for low, high in faces]
    cut = np.any(inside, axis=0) & (2 * cells[:, 1] >= opening)
    cells = cells[~cut]
    grid = 2 * cells[:, None] + _NODES
    flat = np.ravel_multi_index(tuple(np.moveaxis(grid, -1, 0)), place.shape[:3])
    used = np.unique(flat)
    numbers = np.full(int(np.prod(place.shape[:3])), -1)
    numbers[used] = np.arange(1, len(used) + 1)
    return HalfTube(
        numbers.reshape(place.shape[:3]),
        place.reshape(-1, 3)[used],
        numbers[flat],
        cells,
        faces,
        opening,
    )
