"""The structured mesh that a robot gets: half of the tube where it bends in its plane, else all.

z runs along the tube. Half a tube is cut by the plane in which it bends: its notches open toward
+x, and the half with y >= 0 is meshed. In a whole tube x points to direction 0, and lines run
evenly round it but for what the notches ask for: along both edges of the spine of a notch, and at
every tendon. Between two notches the lines go over from their places at one to those at the next.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
from jaxtyping import Float, Int

from notchflex import ArcNotch, InputError, Robot
from notchflex.export.formats import DeckOptions

# Corners and middle nodes of an element in steps of half an element, as CalculiX counts them: first
# along the angle, then along the radius (which makes a right-handed frame with z).
_NODES = np.array(
    [
        *[(0, 0, 0), (2, 0, 0), (2, 2, 0), (0, 2, 0), (0, 0, 2), (2, 0, 2), (2, 2, 2), (0, 2, 2)],
        *[(1, 0, 0), (2, 1, 0), (1, 2, 0), (0, 1, 0), (1, 0, 2), (2, 1, 2), (1, 2, 2), (0, 1, 2)],
        *[(0, 0, 1), (2, 0, 1), (2, 2, 1), (0, 2, 1)],
    ]
)[:, [1, 0, 2]]


class GridOpening(NamedTuple):
    """Opening of a notch on the grid.

    Attributes:
        first: Index of the angle at its first edge.
        cells: Number of elements round its opening, to its last edge; in half a tube to the middle.
        low: Index along z of its first face.
        high: Index along z of its last face.
    """

    first: int
    cells: int
    low: int
    high: int


@dataclass(frozen=True)
class TubeMesh:
    """A mesh of m elements of a tube, or of the half of it with y >= 0. Units mm.

    Attributes:
        nodes: Number of every node on the grid of half elements, -1 where there is none; (radii,
            angles, heights).
        heights: Height of every layer of the grid, mm.
        place: Places of the nodes, in the order of their numbers, from 1; (nodes, 3).
        elements: Nodes of every element, (m, 20).
        cell: Which cell of the grid every element is, (radius, angle, z); (m, 3).
        openings: Where the notches are open.
        is_half: Whether y = 0 is a plane of symmetry.
        x_deg: Direction of the x axis on the robot, deg.
    """

    nodes: Int[np.ndarray, "a b c"]
    heights: Float[np.ndarray, " c"]
    place: Float[np.ndarray, "nodes 3"]
    elements: Int[np.ndarray, "m 20"]
    cell: Int[np.ndarray, "m 3"]
    openings: tuple[GridOpening, ...]
    is_half: bool
    x_deg: float

    @property
    def share(self) -> float:
        """The part of the tube that is meshed."""
        return 0.5 if self.is_half else 1.0

    @property
    def faces(self) -> Int[np.ndarray, "n 2"]:
        """Indices along z of the grid at the first and last face of every notch."""
        return np.array([(one.low, one.high) for one in self.openings])

    def layer(self, index: int) -> Int[np.ndarray, " k"]:
        """Return the nodes of one layer across the tube, by its index along z."""
        numbers = self.nodes[:, :, index].ravel()
        return np.unique(numbers[numbers > 0])

    def in_plane(self) -> Int[np.ndarray, " k"]:
        """Return the nodes in the plane of symmetry of half a tube."""
        numbers = self.nodes[:, [0, -1], :].ravel()
        return numbers[numbers > 0]

    def faces_of(self, opening: GridOpening) -> tuple[Int[np.ndarray, " a"], Int[np.ndarray, " b"]]:
        """Return the elements below and above a notch whose faces may meet, by their numbers.

        They lie behind the outer half of its faces.
        """
        along = (self.cell[:, 1] - opening.first // 2) % (self.nodes.shape[1] // 2)
        if self.is_half:
            outer = 2 * along >= opening.cells
        else:
            outer = np.abs(2 * along + 1 - opening.cells) <= 0.5 * opening.cells
        outer &= along < opening.cells
        number = np.arange(1, len(self.cell) + 1)
        below = number[outer & (self.cell[:, 2] == opening.low // 2 - 1)]
        return below, number[outer & (self.cell[:, 2] == opening.high // 2)]


def numbered(
    radius: Float[np.ndarray, " a"],
    angle: Float[np.ndarray, "a b c"],
    heights: Float[np.ndarray, " c"],
    openings: Sequence[GridOpening],
    *,
    is_half: bool,
    x_deg: float,
) -> TubeMesh:
    """Drop the cells of the notches and number the nodes that are left.

    Args:
        radius: Radii of the grid, mm.
        angle: Angles of the grid from x on, rad; a whole tube closes from the last to the first.
        heights: Heights of the layers, mm.
        openings: Where the notches are open.
        is_half: Whether half a tube is meshed.
        x_deg: Direction of the x axis on the robot.
    """
    across = radius[:, None, None] * np.stack([np.cos(angle), np.sin(angle), 0.0 * angle])
    position = np.moveaxis(across, 0, -1) + heights[:, None] * [0.0, 0.0, 1.0]
    cells = np.stack(
        np.meshgrid(*(np.arange(size // 2) for size in position.shape[:3]), indexing="ij"), axis=-1
    ).reshape(-1, 3)
    around = position.shape[1] // 2
    cut = np.zeros(len(cells), bool)
    for one in openings:
        inside = (2 * cells[:, 2] >= one.low) & (2 * cells[:, 2] < one.high)
        cut |= inside & ((cells[:, 1] - one.first // 2) % around < one.cells)
    cells = cells[~cut]
    # Half a tube counts its angles from the spine, the other way round.
    grid = 2 * cells[:, None] + (_NODES if is_half else [0, 2, 0] + _NODES * [1, -1, 1])
    if not is_half:
        grid[..., 1] %= position.shape[1]
    flat = np.ravel_multi_index(tuple(np.moveaxis(grid, -1, 0)), position.shape[:3])
    used = np.unique(flat)
    numbers = np.full(int(np.prod(position.shape[:3])), -1)
    numbers[used] = np.arange(1, len(used) + 1)
    return TubeMesh(
        nodes=numbers.reshape(position.shape[:3]),
        heights=heights,
        place=position.reshape(-1, 3)[used],
        elements=numbers[flat],
        cell=cells,
        openings=tuple(openings),
        is_half=is_half,
        x_deg=x_deg,
    )


_REMEDY = "export the solid with --step and mesh it by gmsh, with second-order tetrahedra"


def check_shape(robot: Robot) -> list[ArcNotch]:
    """Return the notches of a robot that the mesh can be made of.

    Raises:
        InputError: A notch is not an arc, or has a precurvature, or its cut leaves a solid strip.
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
        if notch.stiffness_factor != 1.0:
            raise InputError.UNSUPPORTED(
                f"notch {number} of {robot.name} has a stiffness_factor, and a solid has the "
                "stiffness of its shape: set notch.stiffness_factor=1"
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
    outer = robot.tube.outer_radius
    above = notch.section_depth(robot.tube) - outer
    return np.arccos(above / (radius if notch.cut == "off-axis" else np.full(len(radius), outer)))


def layers_of(
    robot: Robot, notches: list[ArcNotch], options: DeckOptions
) -> tuple[Float[np.ndarray, " c"], list[float], list[tuple[int, int]]]:
    """Return heights of all layers and of the notch edges, with the indices of these layers."""
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
    return np.concatenate(height), edges, faces


def _both_ends(count: int) -> Float[np.ndarray, " k"]:
    """Places from 0 to 1, closer at both ends; middle nodes half way between corners."""
    even = np.linspace(0.0, 1.0, count // 2 + 1)
    corner = even - 0.09 * np.sin(2.0 * np.pi * even)
    return np.interp(np.arange(count + 1), np.arange(0, count + 1, 2), corner)


def half_tube(robot: Robot, options: DeckOptions) -> TubeMesh:
    """Mesh half of a robot.

    Raises:
        InputError: The robot has another shape than the mesh can have.
    """
    notches = check_shape(robot)
    height, edges_at, faces = layers_of(robot, notches, options)
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
    openings = [GridOpening(2 * options.spine, options.opening, low, high) for low, high in faces]
    x_deg = notches[0].direction_deg
    return numbered(radius, np.pi - angle, height, openings, is_half=True, x_deg=x_deg)


def _graded(count: int) -> Float[np.ndarray, " k"]:
    """Places from 0 to 1, closer at 0; middle nodes half way between corners."""
    corner = np.linspace(0.0, 1.0, count // 2 + 1) ** 1.4
    return np.interp(np.arange(count + 1), np.arange(0, count + 1, 2), corner)


# Elements round the tube for those that half a tube has in its plane.
_ROUND = 1.4
# The narrowest and widest element round the tube, in parts of an even one.
_NARROW, _WIDE = 0.25, 3.0


def whole_tube(robot: Robot, options: DeckOptions, tendons: Sequence[int]) -> TubeMesh:
    """Mesh the whole of a robot; x points to direction 0.

    Args:
        robot: The robot.
        options: The mesh.
        tendons: The tendons that are pulled, from 0.

    Raises:
        InputError: The robot has another shape than the mesh can have.
    """
    notches = check_shape(robot)
    for number, notch in enumerate(notches[:-1], start=1):
        if notch.uncut_length <= 0.0:
            raise InputError.UNSUPPORTED(
                f"notch {number} of {robot.name} has no uncut_length behind it, in which the lines "
                "of the mesh could go over to the next notch: give it one above 0 mm"
            )
    height, edges_at, faces = layers_of(robot, notches, options)
    radius = np.linspace(robot.tube.inner_radius, robot.tube.outer_radius, 2 * options.wall + 1)
    around = 4 * int(np.ceil(_ROUND * (options.spine + options.opening) / 2.0))
    sides = [np.radians(robot.tendon[number].direction_deg) for number in tendons]
    openings: list[GridOpening] = []
    shifts: list[np.ndarray] = []
    for number, (notch, (low, high)) in enumerate(zip(notches, faces, strict=True), start=1):
        edge = np.asarray(edge_angle(notch, robot, radius))
        first, last = _edges(notch, float(edge[-1]), around, options)
        knots = _knots(notch, edge, (first, last), sides, around)
        shifts.append(_lines(knots, around, f"notch {number} of {robot.name}"))
        openings.append(GridOpening(2 * last, around - (last - first), low, high))
    every = np.repeat(np.stack(shifts), 2, axis=0)  # (2 n, radii, half elements)
    flat = every.reshape(len(every), -1)
    shift = np.stack([np.interp(height, edges_at, one) for one in flat.T])
    angle = shift.reshape(*every.shape[1:], len(height))
    angle = angle + (np.arange(2 * around) * np.pi / around)[:, None]
    return numbered(radius, angle, height, openings, is_half=False, x_deg=0.0)


def _edges(notch: ArcNotch, edge: float, around: int, options: DeckOptions) -> tuple[int, int]:
    """Return the lines at the edges of the spine of a notch, by their number."""
    middle = round(around * (notch.direction_deg + 180.0) / 360.0)
    even = around * edge / (2.0 * np.pi)
    # Somewhat finer than even where the spine is narrow.
    half = round(0.5 * (even + max(even, options.spine)))
    half = min(max(half, 2), around // 2 - 2)
    return middle - half, middle + half


def _knots(
    notch: ArcNotch,
    edge: Float[np.ndarray, " radii"],
    lines: tuple[int, int],
    sides: Sequence[float],
    around: int,
) -> dict[int, Float[np.ndarray, " radii"]]:
    """Return by how much lines lie beside their even places at a notch, rad."""
    spine = np.radians(notch.direction_deg) + np.pi
    per = 2.0 * np.pi / around
    first, last = lines
    knots = {first % around: spine - edge - first * per, last % around: spine + edge - last * per}
    for side in sides:
        away = (side - spine + np.pi) % (2.0 * np.pi) - np.pi  # from the middle of the spine
        inside = abs(away) < edge[0]
        number = round((spine + away) / per)
        if inside:
            number = min(max(number, first + 1), last - 1)
        else:
            number = last + 1 + (number - last - 1) % around
            number = min(number, first + around - 1)
            away %= 2.0 * np.pi
        knots[number % around] = np.full(len(edge), spine + away - number * per)
    return {one: (by + np.pi) % (2.0 * np.pi) - np.pi for one, by in knots.items()}


def _lines(
    knots: dict[int, Float[np.ndarray, " radii"]], around: int, name: str
) -> Float[np.ndarray, "radii half"]:
    """Return by how much all lines lie beside their even places, between those that must.

    Raises:
        InputError: Two lines come too near to each other.
    """
    at = sorted(knots)
    half = np.arange(2 * around) / 2.0
    by = np.stack([knots[one] for one in at], axis=1)
    shift = np.stack([np.interp(half, at, one, period=around) for one in by])
    width = 1.0 + np.diff(shift, axis=1, append=shift[:, :1]) * around / np.pi
    if width.min() < _NARROW or width.max() > _WIDE:
        raise InputError.UNSUPPORTED(
            f"{name}: a tendon lies so near to an edge of the notch that the mesh has no line for "
            "each of them; take a finer mesh, or place the tendon elsewhere"
        )
    return shift


# Directions that differ by less are the same, deg.
_SAME = 1e-6


def mesh_of(robot: Robot, options: DeckOptions, tendons: Sequence[int] = (0,)) -> TubeMesh:
    """Mesh a robot.

    Args:
        robot: The robot.
        options: The mesh.
        tendons: The tendons that are pulled, from 0.

    Raises:
        InputError: The robot has another shape than a mesh can have.
    """
    arcs = [one for one in robot.notches if isinstance(one, ArcNotch)]
    sides = [one.direction_deg for one in arcs]
    sides += [robot.tendon[number].direction_deg for number in tendons]
    if all(abs((side - sides[0] + 180.0) % 360.0 - 180.0) < _SAME for side in sides):
        return half_tube(robot, options)
    return whole_tube(robot, options, tendons)
