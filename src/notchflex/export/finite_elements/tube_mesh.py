"""Second-order hexahedra of a notched tube, as structured blocks: radius, angle, z."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from jaxtyping import Float, Int

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

    def nearest(self, layer: int, point: Float[np.ndarray, " 2"]) -> tuple[int, float]:
        """Return the node of a layer that is nearest to a point x, y, and its distance, mm."""
        numbers = self.layer(layer)
        away = np.linalg.norm(self.place[numbers - 1, :2] - point, axis=1)
        best = int(np.argmin(away))
        return int(numbers[best]), float(away[best])


def numbered(
    position: Float[np.ndarray, "a b c 3"],
    heights: Float[np.ndarray, " c"],
    openings: Sequence[GridOpening],
    *,
    is_half: bool,
    x_deg: float,
) -> TubeMesh:
    """Drop the cells of the notches and number the nodes that are left.

    Args:
        position: Places on the grid; a whole tube closes from the last angle to the first.
        heights: Heights of the layers.
        openings: Where the notches are open.
        is_half: Whether half a tube is meshed.
        x_deg: Direction of the x axis on the robot.
    """
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
