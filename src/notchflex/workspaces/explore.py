"""Explores a workspace: rays of tension in batches, piece by piece, thinned by voxels.

Of the states whose tips lie in the same voxel, point the same way (one of the directions of the
dexterity) and are both loaded or both unloaded, that with the largest hysteresis is kept. Corners
of the convex hull of each piece are kept too, so that the hull is that of all states.
"""

from __future__ import annotations

import os
import pickle
from collections.abc import Callable, Mapping
from dataclasses import replace
from functools import cached_property
from typing import Any

import numpy as np
from jaxtyping import Bool, Float, Int
from numpy.typing import ArrayLike

from notchflex import InputError, Robot, tip_response
from notchflex.pieces.folder import Manifest, Piece, Recipe, finished_head, piece_file, plain
from notchflex.pieces.run import PieceFolder
from notchflex.support import (
    ExternalLoad,
    check_integer,
    check_is_robot,
    check_number,
    short_repr,
    to_table,
)
from notchflex.workspaces.cloud import Workspace, hull_of, nearest_directions
from notchflex.workspaces.limits import limits_of
from notchflex.workspaces.rays import (
    LEVELS,
    Explorer,
    RayPiece,
    joined,
    largest_tensions,
    ray_sequence,
    rays,
    rays_at,
    under,
)

KIND = "workspace"
_FINE = 64
"""Voxels along the longest side, twice as many as maps have."""
_SAMPLE = 256
"""Rays that find how large the workspace is."""
_PIECE = 4096
"""Rays of a piece: its states and their quantities are in memory at a time."""


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
            bounds=plain([[one.quantity, *one.ends] for one in explorer.limits]),
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


def with_stiffness(explored: Workspace, count: int) -> Workspace:
    """Return a workspace with the stiffness of the tip at some of its states.

    They lie on the way up, spread over the voxels, and are loaded from rest again. Tendons keep
    their tension, contacts that slid go on sliding.

    Args:
        explored: The workspace.
        count: Number of states, at most as many as there are voxels with a state on the way up.

    Example:
        >>> import notchflex as nf
        >>> found = nf.workspace(nf.load_robot("pacheco2021-a"), states=512)
        >>> stiffness = with_stiffness(found, 3).stiffness
        >>> int(np.isfinite(stiffness).sum())
        3
    """
    rising = np.flatnonzero(explored.loading)
    first = np.unique(explored.voxels().of_state[rising], return_index=True)[1]
    even = np.unique(np.linspace(0, len(first) - 1, min(count, len(first))).round().astype(int))
    states = rising[first[even]]
    tension = explored.tension[states]
    load = under(explored.load, tension)
    response = tip_response(explored.robot, load, each_from_rest=True)
    by_force = response.compliance[:, 3:, 3:]
    is_known = np.isfinite(by_force).all(axis=(1, 2)) & response.path.converged
    stiffness = np.full(len(explored), np.nan)
    stiffness[states[is_known]] = 1.0 / np.linalg.norm(by_force[is_known], ord=2, axis=(1, 2))
    return replace(explored, stiffness=stiffness)


Progress = Callable[[int, int], None]

MAX_STATES, MAX_IN_PIECES = 20_000_000, 20_000_000_000
"""States in memory at most, and in pieces."""

_MAX_STIFFNESS = 5000


def workspace(
    robot: Robot,
    *,
    limits: Mapping[str, object] | None = None,
    tension: ArrayLike | None = None,
    states: int = 100_000,
    pretension: float = 0.0,
    load: ExternalLoad | None = None,
    stiffness: int = 0,
    seed: int = 0,
    cores: int | None = None,
    progress: Progress | None = None,
    folder: PieceFolder | str | os.PathLike[str] | None = None,
) -> Workspace:
    """Explore where the tip of a robot can go, during loading and unloading.

    Args:
        robot: The robot.
        limits: By name of a quantity its largest value, or a pair of the smallest and the largest
            (None for none), in mm, N and rad: `{"peak_strain": 0.04, "gap": (0.05, None)}`. A
            tendon is not pulled further than they allow.
        tension: Largest tension of the tendons, N, one number or one per tendon; by default that
            which closes all notches.
        states: How many states are solved.
        pretension: Tension that every tendon has at least, N.
        load: External loads that act all the time.
        stiffness: At how many states the stiffness of the tip is computed, about 10 ms each.
        seed: Of the sequence that draws the rays.
        cores: How many cores to use; all where not given.
        progress: Called with the rays done and the rays of the whole.
        folder: Explore in pieces, which this folder keeps: for more states than fit into memory, by
            many processes (`PieceFolder`), resumed by the same call. Of states whose tips lie
            in the same small voxel and point the same way, one is kept.

    Returns:
        The states that converged and keep the limits, with volumes and maps.

    Raises:
        InputError: An unknown quantity, reversed limits, too many states, no core, or no tension is
            given and none closes the notches.

    Example:
        >>> import notchflex as nf
        >>> found = nf.workspace(nf.load_robot("pacheco2021-a"), states=512)
        >>> found.hull.unit, bool(found.hysteresis[0] >= 0.0)
        ('mm²', True)
    """
    checked = limits_of(limits)
    largest = largest_tensions(check_is_robot(robot), tension)
    folder = None if folder is None else PieceFolder.of(folder)
    most = MAX_STATES if folder is None else MAX_IN_PIECES
    _check_numbers(states, pretension, stiffness, seed, float(largest.max()), most)
    if load is not None and not isinstance(load, ExternalLoad):  # pyright: ignore
        raise InputError.WRONG_TYPE(
            f"load must be a notchflex.Load with external loads; got {short_repr(load)}"
        )
    explorer = Explorer(robot, checked, load or ExternalLoad(), cores)
    number = -(-states // (2 * LEVELS))
    if folder is not None:
        explored = explore_in_pieces(explorer, largest, number, pretension, seed, folder, progress)
        return (
            with_stiffness(explored, stiffness)
            if stiffness and explored.loading.any()
            else explored
        )
    every = rays(robot, largest, number, LEVELS, pretension, seed)
    pieces: list[RayPiece] = []
    for start in range(0, number, _PIECE):
        pieces.append(explorer.piece(every[start : start + _PIECE]))
        if progress is not None:
            progress(min(start + _PIECE, number), number)
    explored = joined(explorer, largest, pieces)
    return with_stiffness(explored, stiffness) if stiffness and explored.loading.any() else explored


def _check_numbers(
    states: int, pretension: float, stiffness: int, seed: int, largest: float, most: int
) -> None:
    if not 2 * LEVELS <= check_integer(states, "states") <= most:
        more = ", or more in pieces (give a folder)" if most == MAX_STATES else ""
        raise InputError.OUT_OF_RANGE(
            f"states must be from {2 * LEVELS} to {most:,}{more}; got {states}"
        )
    if not 0.0 <= check_number(pretension, "pretension") < largest:
        raise InputError.OUT_OF_RANGE(
            f"pretension must be 0 N or more and below the largest tension, {largest:g} N; "
            f"got {pretension:g}"
        )
    if not 0 <= check_integer(stiffness, "stiffness") <= _MAX_STIFFNESS:
        raise InputError.OUT_OF_RANGE(
            f"stiffness is a number of states from 0 to {_MAX_STIFFNESS}; got {stiffness}"
        )
    if check_integer(seed, "seed") < 0:
        raise InputError.OUT_OF_RANGE(f"seed must be 0 or more; got {seed}")
