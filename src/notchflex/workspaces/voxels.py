"""Maps of a workspace: what the states of each voxel have in common."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float, Int

DIRECTIONS = 96
"""Number of directions that the dexterity distinguishes, evenly on the sphere."""


@dataclass(frozen=True, eq=False)
class VoxelMap:
    """Values of a workspace by voxel, v voxels that hold a state.

    Attributes:
        size: Edge of a voxel, mm.
        centre: Centres, mm, (v, 3).
        states: States in each, (v,).
        dexterity: How many of `DIRECTIONS` directions the tip has in each, as a part, (v,).
        values: Means of the quantities of the states by name, and of "hysteresis" the largest,
            (v,) each; NaN where no state has it.
        of_state: Voxel of every state, (n,).
    """

    size: float
    centre: Float[np.ndarray, "v 3"]
    states: Int[np.ndarray, " v"]
    dexterity: Float[np.ndarray, " v"]
    values: Mapping[str, Float[np.ndarray, " v"]]
    of_state: Int[np.ndarray, " n"]

    def __len__(self) -> int:
        """Number of voxels."""
        return len(self.states)


def voxel_map(
    points: Float[np.ndarray, "n 3"],
    directions: Float[np.ndarray, "n 3"],
    values: Mapping[str, Float[np.ndarray, " n"]],
    size: float,
) -> VoxelMap:
    """Sort states into voxels.

    Args:
        points: Tip positions, mm.
        directions: Unit vectors along the tube at the tip.
        values: Further values of every state, NaN where one has none.
        size: Edge of a voxel, mm.
    """
    cells = np.floor(points / size).astype(np.int64)
    occupied, of_state, states = np.unique(cells, axis=0, return_inverse=True, return_counts=True)
    of_state = of_state.reshape(-1)
    reached = np.unique(of_state * DIRECTIONS + nearest_directions(directions))
    dexterity = np.bincount(reached // DIRECTIONS, minlength=len(occupied)) / DIRECTIONS
    maps: dict[str, np.ndarray] = {}
    for name, one in values.items():
        is_finite = np.isfinite(one)
        if name == "hysteresis":
            most = np.full(len(occupied), -np.inf)
            np.maximum.at(most, of_state[is_finite], one[is_finite])
            maps[name] = np.where(np.isfinite(most), most, np.nan)
        else:
            count = np.bincount(of_state[is_finite], minlength=len(occupied))
            total = np.bincount(of_state[is_finite], one[is_finite], minlength=len(occupied))
            maps[name] = np.where(count > 0, total / np.maximum(count, 1), np.nan)
    return VoxelMap(size, (occupied + 0.5) * size, states, dexterity, maps, of_state)


def sphere_directions() -> Float[np.ndarray, "directions 3"]:
    """Return the directions that the dexterity distinguishes, as unit vectors."""
    # notation: a Fibonacci sphere, points at equal steps of height turned by the golden angle
    number = np.arange(DIRECTIONS)
    z = 1.0 - (2.0 * number + 1.0) / DIRECTIONS
    turn = number * np.pi * (3.0 - np.sqrt(5.0))
    flat = np.sqrt(1.0 - z**2)
    return np.stack([flat * np.cos(turn), flat * np.sin(turn), z], axis=1)


def nearest_directions(directions: Float[np.ndarray, "n 3"]) -> Int[np.ndarray, " n"]:
    """Return the nearest of the directions of the dexterity, piece by piece.

    Args:
        directions: Unit vectors.
    """
    sphere = sphere_directions().T
    pieces = [directions[start : start + 65536] for start in range(0, len(directions), 65536)]
    return np.concatenate([(one @ sphere).argmax(axis=1) for one in pieces])
