"""A workspace of more states than fit into memory: pieces of rays, thinned by voxels.

Of the states whose tips lie in the same voxel, point the same way (one of the directions of the
dexterity) and are both loaded or both unloaded, that with the largest hysteresis is kept. Corners
of the convex hull of each piece are kept too, so that the hull is that of all states.
"""

from __future__ import annotations

import pickle
from collections.abc import Callable
from functools import cached_property
from typing import Any

import numpy as np
from jaxtyping import Bool, Float, Int

from notchflex.pieces.folder import finished_head
from notchflex.pieces.manifest import Manifest
from notchflex.pieces.options import PieceFolder
from notchflex.pieces.piece import Piece, Recipe, piece_file
from notchflex.pieces.plain import plain
from notchflex.robot.robot import to_table
from notchflex.workspaces.actuation import ray_sequence, rays, rays_at
from notchflex.workspaces.cloud import Workspace
from notchflex.workspaces.rays import LEVELS, Explorer, joined
from notchflex.workspaces.shape import hull_of
from notchflex.workspaces.voxels import nearest_directions

KIND = "workspace"
_FINE = 64
"""Voxels along the longest side, twice as many as maps have."""
_SAMPLE = 256
"""Rays that find how large the workspace is."""
_PIECE = 4096
"""Rays of a piece."""


class WorkspaceTask:
    """Rays of a workspace, in pieces.

    Args:
        explorer: The robot, its limits and its load.
        largest: Largest tension of every tendon, N.
        number: Number of rays.
        pretension: Tension that every tendon has at least, N.
        seed: Of the sequence that draws the rays.
    """

    def __init__(
        self,
        explorer: Explorer,
        largest: Float[np.ndarray, " t"],
        number: int,
        pretension: float,
        seed: int,
    ) -> None:
        self.explorer, self.largest = explorer, largest
        self._rest = number, pretension, seed
        self.manifest = Manifest.made(
            KIND,
            2 * LEVELS * number,
            2 * LEVELS * min(_PIECE, number),
            robot=to_table(explorer.robot.replace(tolerance=None)),
            limits=[one.text for one in explorer.limits],
            bounds=plain([[one.name, one.low, one.high] for one in explorer.limits]),
            load=plain(explorer.load),
            largest=plain(largest),
            pretension=pretension,
            seed=seed,
        )

    @property
    def recipe(self) -> Recipe:
        """Recipe by which another process makes the same task."""
        one = self.explorer
        content = (one.robot, one.limits, one.load, self.largest, *self._rest)
        return Recipe(workspace_task, pickle.dumps(content))

    def prepare(self) -> None:
        """Find the size of a voxel, which all pieces need."""
        assert self.size

    @cached_property
    def size(self) -> float:
        """Edge of a voxel, mm, from a few rays."""
        robot, largest = self.explorer.robot, self.largest
        explored = self._solved(rays(robot, largest, _SAMPLE, LEVELS, *self._rest[1:]))
        side = float(np.ptp(explored.tip, axis=0).max()) if len(explored) else 1.0
        return max(side, 1e-6) / _FINE

    def _solved(self, tension: Float[np.ndarray, "r s t"]) -> Workspace:
        return joined(self.explorer, self.largest, [self.explorer.piece(tension)])

    def piece(self, number: int) -> Piece:
        """Solve the rays of one piece, and thin their states."""
        import polars

        count, pretension, seed = self._rest
        start, stop = (one // (2 * LEVELS) for one in self.manifest.between(number))
        robot, largest = self.explorer.robot, self.largest
        drawn = ray_sequence(robot, largest, count, seed).between(start, stop)
        explored = self._solved(rays_at(robot, largest, drawn, LEVELS, pretension))
        columns = _columns(explored)
        corner = _corners(explored.tip)
        kept = np.union1d(thinned(columns, self.size), np.flatnonzero(corner))
        columns["corner"] = corner
        frame = polars.DataFrame(
            {name: np.ascontiguousarray(one[kept]) for name, one in columns.items()}
        )
        head = {"codes": [len(explored), explored.beyond, explored.failed, 0]}
        return Piece(frame, head)


def workspace_task(content: bytes) -> WorkspaceTask:
    """Make the task of another process again, from objects that it pickled."""
    robot, limits, load, *rest = pickle.loads(content)
    return WorkspaceTask(Explorer(robot, limits, load, 1), *rest)


def _columns(explored: Workspace) -> dict[str, np.ndarray]:
    """Return the states as columns, in mm, N and rad."""
    vectors = {"tension": explored.tension, "tip": explored.tip, "direction": explored.direction}
    columns = {
        f"{name}_{number + 1}": values[:, number]
        for name, values in vectors.items()
        for number in range(values.shape[1])
    }
    names = ("loading", "strain", "angle", "hysteresis")
    return columns | {name: getattr(explored, name) for name in names}


def _vectors(columns: dict[str, np.ndarray], name: str, size: int) -> Float[np.ndarray, "n k"]:
    return np.stack([columns[f"{name}_{number + 1}"] for number in range(size)], axis=1)


def thinned(columns: dict[str, np.ndarray], size: float) -> Int[np.ndarray, " k"]:
    """Return the states that are kept: of each voxel, direction and way the largest hysteresis.

    Args:
        columns: The states.
        size: Edge of a voxel, mm.
    """
    cells = np.floor(_vectors(columns, "tip", 3) / size).astype(np.int64)
    direction = nearest_directions(_vectors(columns, "direction", 3))
    key = np.column_stack([cells, direction, columns["loading"].astype(np.int64)])
    order = np.argsort(-np.nan_to_num(columns["hysteresis"], nan=-1.0), kind="stable")
    return np.sort(order[np.unique(key[order], axis=0, return_index=True)[1]])


def _corners(points: Float[np.ndarray, "n 3"]) -> Bool[np.ndarray, " n"]:
    """Return which points are corners of their convex hull."""
    if not len(points):
        return np.zeros(0, bool)
    weights = np.array([1.0, np.pi, np.e])
    corners = hull_of(points).corners
    return np.isin((points * weights).sum(axis=1), (corners * weights).sum(axis=1))


def explore_in_pieces(
    explorer: Explorer,
    largest: Float[np.ndarray, " t"],
    number: int,
    pretension: float,
    seed: int,
    folder: PieceFolder,
    progress: Callable[[int, int], None] | None = None,
) -> Workspace:
    """Solve rays in pieces, and join the states that are kept.

    Args:
        explorer: The robot, its limits and its load.
        largest: Largest tension of every tendon, N.
        number: Number of rays.
        pretension: Tension that every tendon has at least, N.
        seed: Of the sequence that draws the rays.
        folder: Where pieces are kept.
        progress: Called with the rays done and the rays of the whole.

    Raises:
        InputError: The folder holds something else, or cannot be written.
    """
    import polars

    alone = Explorer(explorer.robot, explorer.limits, explorer.load, 1)
    task = WorkspaceTask(alone, largest, number, pretension, seed)
    each = 2 * LEVELS

    def report(done: int, total: int, *_: int) -> None:
        if progress is not None:
            progress(done // each, total // each)

    folder.run(task, cores=explorer.cores, progress=report)
    codes = np.zeros(4, int)
    every: dict[str, np.ndarray] = {}
    for piece in range(task.manifest.pieces):
        codes += np.array(finished_head(folder.directory, task.manifest, piece)["codes"])
        frame = polars.read_parquet(piece_file(folder.directory, piece))
        mine: dict[str, Any] = {name: frame[name].to_numpy() for name in frame.columns}
        every = {n: np.concatenate([every[n], one]) for n, one in mine.items()} if every else mine
        kept = np.union1d(thinned(every, task.size), np.flatnonzero(every["corner"]))
        every = {name: one[kept] for name, one in every.items()}
    return Workspace(
        explorer.robot, explorer.limits, explorer.load, largest,
        int(codes.sum()), int(codes[2]), int(codes[1]),
        _vectors(every, "tension", len(largest)),
        _vectors(every, "tip", 3),
        _vectors(every, "direction", 3),
        every["loading"], every["strain"], every["angle"], every["hysteresis"],
        np.full(len(every["strain"]), np.nan),
    )  # fmt: skip
