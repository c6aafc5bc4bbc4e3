"""Two workspaces beside each other: what both reach, and what only one does."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from itertools import combinations

import numpy as np

from notchflex.errors import InputError
from notchflex.workspaces.cloud import Workspace
from notchflex.workspaces.shape import inside
from notchflex.workspaces.voxels import voxel_map


@dataclass(frozen=True)
class Overlap:
    """Overlap of two workspaces.

    Attributes:
        first: Label of the first.
        second: Label of the second.
        voxel: Edge of the common voxels, mm.
        both: Voxels in which both have a state.
        first_alone: Voxels in which only the first has one.
        second_alone: Voxels in which only the second has one.
        first_in_second: Part of the first's states inside the convex hull of the second.
        second_in_first: Part of the second's states inside the convex hull of the first.
    """

    first: str
    second: str
    voxel: float
    both: int
    first_alone: int
    second_alone: int
    first_in_second: float
    second_in_first: float


def overlaps(found: Mapping[str, Workspace]) -> list[Overlap]:
    """Compare every two of some workspaces on common voxels.

    Raises:
        InputError: One of them has no states.
    """
    if empty := [label for label, one in found.items() if not len(one)]:
        raise InputError.NO_DATA(f"{empty[0]}: no state is left within the limits")
    pairs = combinations(found.items(), 2)
    return [_overlap(first, second, a, b) for (first, a), (second, b) in pairs]


def _overlap(first: str, second: str, a: Workspace, b: Workspace) -> Overlap:
    size = max(float(np.ptp(one.extent, axis=0).max()) for one in (a, b)) / 32.0
    cells = []
    for one in (a, b):
        map_ = voxel_map(one.tip, one.direction, {}, size)
        cells.append({tuple(row) for row in np.floor(map_.centre / size).astype(int).tolist()})
    return Overlap(
        first,
        second,
        size,
        both=len(cells[0] & cells[1]),
        first_alone=len(cells[0] - cells[1]),
        second_alone=len(cells[1] - cells[0]),
        first_in_second=float(inside(b.hull, a.tip).mean()),
        second_in_first=float(inside(a.hull, b.tip).mean()),
    )
