"""Exploring a workspace: rays of tension in batches, piece by piece."""

from __future__ import annotations

import os
from collections.abc import Callable, Mapping

from numpy.typing import ArrayLike

from notchflex.errors import InputError
from notchflex.loads import ExternalLoad
from notchflex.loads.validation import check_integer, check_is_robot, check_number, short_repr
from notchflex.pieces.options import PieceFolder
from notchflex.robot import Robot
from notchflex.workspaces.actuation import largest_tensions, rays
from notchflex.workspaces.cloud import Workspace
from notchflex.workspaces.in_pieces import explore_in_pieces
from notchflex.workspaces.limits import limits_of
from notchflex.workspaces.rays import LEVELS, Explorer, RayPiece, joined
from notchflex.workspaces.stiffness import with_stiffness

Progress = Callable[[int, int], None]

MAX_STATES, MAX_IN_PIECES = 20_000_000, 20_000_000_000
"""States in memory at most, and in pieces."""

_MAX_STIFFNESS = 5000

# Rays of a piece: its states and their quantities are in memory at a time.
_PIECE = 4096


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
    explorer = Explorer(robot, checked, (load or ExternalLoad()).external, cores)
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
