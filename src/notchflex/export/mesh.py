"""The structured mesh that a robot gets: half of the tube where it bends in its plane, else all.

z runs along the tube. Half a tube is cut by the plane in which it bends: its notches open toward
+x, and the half with y >= 0 is meshed. In a whole tube x points to direction 0, and lines run
evenly round it but for what the notches ask for: along both edges of the spine of a notch, and at
every tendon. Between two notches the lines go over from their places at one to those at the next.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from notchflex import ArcNotch, InputError, Robot
from notchflex.export.formats import DeckOptions

Array = NDArray[np.float64]
Numbers = NDArray[np.int_]

# Corners and middle nodes of an element in steps of half an element, as CalculiX counts them: first
# along the angle, then along the radius (which makes a right-handed frame with z).
_NODES = np.array(
    [
        *[(0, 0, 0), (2, 0, 0), (2, 2, 0), (0, 2, 0), (0, 0, 2), (2, 0, 2), (2, 2, 2), (0, 2, 2)],
        *[(1, 0, 0), (2, 1, 0), (1, 2, 0), (0, 1, 0), (1, 0, 2), (2, 1, 2), (1, 2, 2), (0, 1, 2)],
        *[(0, 0, 1), (2, 0, 1), (2, 2, 1), (0, 2, 1)],
    ]
)[:, [1, 0, 2]]
# Elements round the tube for those that half a tube has in its plane.
_ROUND = 1.4
# The narrowest and widest element round the tube, in parts of an even one.
_NARROW, _WIDE = 0.25, 3.0
# Nodes that lie nearer to the plane of symmetry are in it, mm.
_IN_PLANE = 1e-9
# Directions that differ by less are the same, deg.
_SAME = 1e-6


@dataclass(frozen=True)
class TubeMesh:
    """A mesh of m elements of a tube, or of the half of it with y >= 0. Units mm.

    Attributes:
        heights: Height of every layer of nodes, mm, (c,).
        place: Places of the nodes, in the order of their numbers, from 1; (nodes, 3).
        elements: Nodes of every element, (m, 20).
        faces: Layers of the first and last face of every notch, (n, 2).
        lips: Elements below and above every notch whose faces may meet, by their numbers, from 1.
        is_half: Whether y = 0 is a plane of symmetry.
        x_deg: Direction of the x axis on the robot, deg.
    """

    heights: Array
    place: Array
    elements: Numbers
    faces: Numbers
    lips: Sequence[tuple[Numbers, Numbers]]
    is_half: bool
    x_deg: float

    @property
    def share(self) -> float:
        """The part of the tube that is meshed."""
        return 0.5 if self.is_half else 1.0

    def layer(self, index: int) -> Numbers:
        """Return the nodes of one layer across the tube."""
        return 1 + np.flatnonzero(self.place[:, 2] == self.heights[index])

    def in_plane(self) -> Numbers:
        """Return the nodes in the plane of symmetry of half a tube."""
        return 1 + np.flatnonzero(np.abs(self.place[:, 1]) < _IN_PLANE)


def _numbered(
    position: Array, faces: Numbers, openings: Sequence[tuple[int, int]], *, x_deg: float | None
) -> TubeMesh:
    """Drop the cells of the notches and number the nodes that are left.

    Args:
        position: The grid of half elements: radii, angles, heights; (a, b, c, 3). A whole tube
            closes from the last angle to the first.
        faces: Layers of the first and last face of every notch, (n, 2).
        openings: Of every notch the first cell round its opening, and how many there are; in half
            a tube to the middle of the opening.
        x_deg: Direction of the x axis on the robot, of half a tube; None for a whole one.
    """
    is_half, shape = x_deg is not None, position.shape[:3]
    cells = np.argwhere(np.ones([size // 2 for size in shape]))

    def way(first: int) -> Numbers:
        return (cells[:, 1] - first) % (shape[1] // 2)

    for (first, count), (low, high) in zip(openings, faces // 2, strict=True):
        inside = (low <= cells[:, 2]) & (cells[:, 2] < high)
        cells = cells[~(inside & (way(first) < count))]
    lips: list[tuple[Numbers, Numbers]] = []
    for (first, count), (low, high) in zip(openings, faces // 2, strict=True):
        along = way(first)
        # They lie behind the outer half of the faces.
        both_sides = np.abs(2 * along + 1 - count) <= 0.5 * count
        outer = np.where(is_half, 2 * along >= count, both_sides) & (along < count)
        below, above = (np.flatnonzero(outer & (cells[:, 2] == z)) for z in (low - 1, high))
        lips.append((1 + below, 1 + above))
    # Half a tube counts its angles from the spine, the other way round.
    grid = 2 * cells[:, None] + (_NODES if is_half else [0, 2, 0] + _NODES * [1, -1, 1])
    grid[..., 1] %= shape[1]
    flat = np.ravel_multi_index(tuple(np.moveaxis(grid, -1, 0)), shape)
    used, elements = np.unique(flat, return_inverse=True)
    places = position.reshape(-1, 3)[used]
    elements = 1 + elements.reshape(flat.shape)
    heights, x_deg = position[0, 0, :, 2], x_deg or 0.0
    return TubeMesh(heights, places, elements, faces, lips, is_half, x_deg)


def check_shape(robot: Robot) -> list[ArcNotch]:
    """Return the notches of a robot that the mesh can be made of.

    Raises:
        InputError: A notch is not an arc, or has a precurvature, or its cut leaves a solid strip.
    """
    notches: list[ArcNotch] = []
    for number, notch in enumerate(robot.notches, start=1):
        if problem := _problem(robot, notch):
            raise InputError.UNSUPPORTED(f"notch {number} of {robot.name} {problem}")
        assert isinstance(notch, ArcNotch)
        notches.append(notch)
    return notches


def _problem(robot: Robot, notch: object) -> str:
    """Return what is wrong with a notch for a mesh."""
    outer, inner = robot.tube.outer_radius, robot.tube.inner_radius
    if not isinstance(notch, ArcNotch):
        return (
            f"is of kind {getattr(notch, 'kind', '')!r}: a deck of finite elements is made of "
            'notches of kind "arc" only; export the solid with --step and mesh it by gmsh, with '
            "second-order tetrahedra"
        )
    if notch.precurvature_deg != 0.0:
        return "has a precurvature, and the mesh is straight: set notch.precurvature_deg=0"
    if notch.stiffness_factor != 1.0:
        return (
            "has a stiffness_factor, and a solid has the stiffness of its shape: set "
            "notch.stiffness_factor=1"
        )
    if notch.cut == "off-axis" and notch.depth - outer >= inner:
        return (
            "leaves a solid strip, without bore: the mesh needs a depth of less than "
            f"{outer + inner:g} mm"
        )
    return ""


def _layers(
    robot: Robot, notches: Sequence[ArcNotch], options: DeckOptions
) -> tuple[Array, Numbers]:
    """Return the heights of all layers, and the layers of both faces of every notch, (n, 2)."""
    even = np.linspace(0.0, 1.0, options.uncut + 1)
    uncut = _with_middles(even - 0.09 * np.sin(2.0 * np.pi * even))  # closer at both ends
    heights, faces = np.zeros(1), list[tuple[int, int]]()

    def add(length: float, places: Array) -> Array:
        return np.append(heights, heights[-1] + length * places[1:] if length > 0.0 else ())

    heights = add(robot.tube.base_length, uncut)
    for notch in notches:
        low = len(heights) - 1
        heights = add(notch.height, np.linspace(0.0, 1.0, 2 * options.notch + 1))
        faces.append((low, len(heights) - 1))
        heights = add(notch.uncut_length, uncut)
    return heights, np.array(faces)


def _with_middles(corners: Array) -> Array:
    """Return places of corners with those of middle nodes half way between."""
    return np.interp(np.arange(2 * len(corners) - 1) / 2.0, np.arange(len(corners)), corners)


def _over(heights: Array, faces: Numbers, values: Array) -> Array:
    """Return values (n, ...) of the notches at all heights, (..., c): straight between notches."""
    ends = np.repeat(values.reshape(len(values), -1), 2, axis=0)
    rows = [np.interp(heights, heights[faces.ravel()], row) for row in ends.T]
    return np.reshape(rows, (*values.shape[1:], len(heights)))


def mesh_of(robot: Robot, options: DeckOptions, tendons: Sequence[int] = (0,)) -> TubeMesh:
    """Mesh a robot.

    Args:
        robot: The robot.
        options: The mesh.
        tendons: The tendons that are pulled, from 0.

    Raises:
        InputError: The robot has another shape than a mesh can have.
    """
    notches = check_shape(robot)
    sides = [robot.tendon[number].direction_deg for number in tendons]
    first = notches[0].direction_deg
    turns = [side - first for side in (*sides, *(notch.direction_deg for notch in notches))]
    is_half = all(abs(math.remainder(turn, 360.0)) < _SAME for turn in turns)
    radius = np.linspace(robot.tube.inner_radius, robot.tube.outer_radius, 2 * options.wall + 1)
    heights, faces = _layers(robot, notches, options)
    outer = robot.tube.outer_radius
    edges = np.stack(  # half the angle of the wall that every notch leaves, (n, radii)
        [
            np.arccos(
                (notch.section_depth(robot.tube) - outer)
                / (radius if notch.cut == "off-axis" else np.full(len(radius), outer))
            )
            for notch in notches
        ]
    )
    if is_half:
        # Between two notches the lines go over from the edge of one to that of the next.
        edge = _over(heights, faces, edges)[:, None]
        spine, beyond = (
            _with_middles(np.linspace(0.0, 1.0, count + 1) ** 1.4)[:, None]  # closer at the edge
            for count in (options.spine, options.opening)
        )
        angle = [(1.0 - spine[::-1]) * edge, edge + beyond[1:] * (np.pi - edge)]
        angle = np.pi - np.concatenate(angle, axis=1)
        openings = [(options.spine, options.opening)] * len(notches)
        return _numbered(_grid(radius, angle, heights), faces, openings, x_deg=first)
    around = 4 * int(np.ceil(_ROUND * (options.spine + options.opening) / 2.0))
    openings, shifts = list[tuple[int, int]](), list[Array]()
    for number, (notch, edge) in enumerate(zip(notches, edges, strict=True), start=1):
        name = f"notch {number} of {robot.name}"
        if notch.uncut_length <= 0.0 and number < len(notches):
            raise InputError.UNSUPPORTED(
                f"{name} has no uncut_length behind it, in which the lines "
                "of the mesh could go over to the next notch: give it one above 0 mm"
            )
        lines, shift = _lines(notch, edge, np.radians(sides).tolist(), around, options)
        width = 1.0 + np.diff(shift, axis=1, append=shift[:, :1]) * around / np.pi
        if width.min() < _NARROW or width.max() > _WIDE:
            raise InputError.UNSUPPORTED(
                f"{name}: a tendon lies so near to an edge of the notch that the mesh has no line "
                "for each of them; take a finer mesh, or place the tendon elsewhere"
            )
        openings.append(lines)
        shifts.append(shift)
    angle = _over(heights, faces, np.stack(shifts))
    angle += (np.arange(2 * around) * np.pi / around)[:, None]
    return _numbered(_grid(radius, angle, heights), faces, openings, x_deg=None)


def _grid(radius: Array, angle: Array, heights: Array) -> Array:
    """Return places of radii (a,), angles (a, b, c) and heights (c,), (a, b, c, 3)."""
    radius = radius[:, None, None]
    return np.stack(
        [radius * np.cos(angle), radius * np.sin(angle), heights + 0.0 * angle], axis=-1
    )


def _lines(
    notch: ArcNotch, edge: Array, sides: Sequence[float], around: int, options: DeckOptions
) -> tuple[tuple[int, int], Array]:
    """Return the lines of a whole tube at a notch.

    Args:
        notch: The notch.
        edge: Half the angle of the wall that it leaves at every radius, rad, (a,).
        sides: Sides of the tendons, rad.
        around: Number of lines.
        options: The mesh.

    Returns:
        The line where its opening begins and the number of elements to where it ends; by how much
        lines and middle nodes lie beside their even places, rad, (a, 2 around).
    """
    per, spine = 2.0 * np.pi / around, np.radians(notch.direction_deg) + np.pi
    middle = round(around * (notch.direction_deg + 180.0) / 360.0)
    even = around * float(edge[-1]) / (2.0 * np.pi)
    # Somewhat finer than even where the spine is narrow.
    half = round(0.5 * (even + max(even, options.spine)))
    half = min(max(half, 2), around // 2 - 2)
    first, last = middle - half, middle + half
    places = {first: spine - edge, last: spine + edge}
    for side in sides:
        away = (side - spine + np.pi) % (2.0 * np.pi) - np.pi  # from the middle of the spine
        number = round((spine + away) / per)
        if abs(away) < edge[0]:
            number = min(max(number, first + 1), last - 1)
        else:
            number = min(last + 1 + (number - last - 1) % around, first + around - 1)
            away %= 2.0 * np.pi
        places[number] = np.full(len(edge), spine + away)
    shifts = {
        number % around: (place - number * per + np.pi) % (2.0 * np.pi) - np.pi
        for number, place in places.items()
    }
    lines, half_lines = sorted(shifts), np.arange(2 * around) / 2.0
    rows = np.stack([shifts[line] for line in lines], axis=1)
    shift = np.stack([np.interp(half_lines, lines, row, period=around) for row in rows])
    return (last, around - (last - first)), shift
