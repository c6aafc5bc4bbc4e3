"""Exploring a workspace: rays of tension in batches, piece by piece."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float
from numpy.typing import ArrayLike

from notchflex.analysis.batch import simulate_batch
from notchflex.errors import InputError
from notchflex.loads import ExternalLoad, LoadPath
from notchflex.loads.validation import check_integer, check_is_robot, check_number, short_repr
from notchflex.robot import Robot
from notchflex.solver.newton import Settings
from notchflex.workspaces.actuation import largest_tensions, rays
from notchflex.workspaces.cloud import Workspace
from notchflex.workspaces.limits import Limit, all_hold, limits_of
from notchflex.workspaces.stiffness import with_stiffness

Progress = Callable[[int, int], None]

LEVELS = 16
"""Levels of tension on each way of a ray."""

MOST_STATES = 20_000_000

# Far below what a picture or a volume shows, and a third quicker than the usual tolerance.
_SETTINGS = Settings(tolerance=1e-9)

_MOST_STIFFNESS = 5000

# Rays of a piece: its states and their quantities are in memory at a time.
_PIECE = 4096
# Levels of the first pull, that finds how far limits allow each ray to be pulled.
_FIRST_LEVELS = 12
_KEPT = ("tip_position", "tip_rotation", "peak_strain", "total_angle", "converged")


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
) -> Workspace:
    """Explore where the tip of a robot can go, while its tendons are pulled and let go.

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
    _check_numbers(states, pretension, stiffness, seed, float(largest.max()))
    if load is not None and not isinstance(load, ExternalLoad):  # pyright: ignore
        raise InputError.WRONG_TYPE(
            f"load must be a notchflex.Load with external loads; got {short_repr(load)}"
        )
    explorer = _Explorer(robot, checked, (load or ExternalLoad()).external, cores)
    number = -(-states // (2 * LEVELS))
    every = rays(robot, largest, number, LEVELS, pretension, seed)
    pieces: list[_Piece] = []
    for start in range(0, number, _PIECE):
        pieces.append(explorer.piece(every[start : start + _PIECE]))
        if progress is not None:
            progress(min(start + _PIECE, number), number)
    found = _joined(explorer, largest, pieces)
    return with_stiffness(found, stiffness) if stiffness and found.loading.any() else found


def _check_numbers(
    states: int, pretension: float, stiffness: int, seed: int, largest: float
) -> None:
    if not 2 * LEVELS <= check_integer(states, "states") <= MOST_STATES:
        raise InputError.OUT_OF_RANGE(
            f"states must be from {2 * LEVELS} to {MOST_STATES:,}; got {states}"
        )
    if not 0.0 <= check_number(pretension, "pretension") < largest:
        raise InputError.OUT_OF_RANGE(
            f"pretension must be 0 N or more and below the largest tension, {largest:g} N; "
            f"got {pretension:g}"
        )
    if not 0 <= check_integer(stiffness, "stiffness") <= _MOST_STIFFNESS:
        raise InputError.OUT_OF_RANGE(
            f"stiffness is a number of states from 0 to {_MOST_STIFFNESS}; got {stiffness}"
        )
    if check_integer(seed, "seed") < 0:
        raise InputError.OUT_OF_RANGE(f"seed must be 0 or more; got {seed}")


@dataclass(frozen=True, eq=False)
class _Piece:
    """States of some rays, rays and steps as leading axes."""

    tension: Float[np.ndarray, "r s t"]
    outputs: Mapping[str, np.ndarray]
    keeps: np.ndarray


@dataclass(frozen=True, eq=False)
class _Explorer:
    """A robot whose rays are solved."""

    robot: Robot
    limits: tuple[Limit, ...]
    load: ExternalLoad
    cores: int | None

    def piece(self, tension: Float[np.ndarray, "r s t"]) -> _Piece:
        """Solve rays as far as the limits allow."""
        if self.limits:
            tension = tension * self._allowed(tension)[:, None, None]
        outputs = self._solve(tension, (*_KEPT, *(one.name for one in self.limits)))
        keeps = all_hold(self.limits, outputs)
        # What follows a state beyond a limit has a history that the limit forbids.
        keeps = np.logical_and.accumulate(keeps, axis=1)
        return _Piece(tension, outputs, keeps)

    def _allowed(self, tension: Float[np.ndarray, "r s t"]) -> Float[np.ndarray, " r"]:
        """Return the part of each ray that the limits allow, by a pull in few levels."""
        part = np.linspace(0.0, 1.0, _FIRST_LEVELS + 1)[1:]
        peak = tension[:, tension.shape[1] // 2]
        path = part[None, :, None] * peak[:, None]
        good = all_hold(self.limits, self._solve(path, [one.name for one in self.limits]))
        within = np.logical_and.accumulate(good, axis=1).sum(axis=1)
        # Between the last level within and the first beyond: halved a few times, rays as a batch.
        low = np.concatenate([[0.0], part])[within]
        high = np.where(within == len(part), 1.0, np.concatenate([part, [1.0]])[within])
        for _ in range(5):
            middle = 0.5 * (low + high)
            steps = np.stack([low, middle], axis=1)[:, :, None] * peak[:, None]
            names = [one.name for one in self.limits]
            fits = all_hold(self.limits, self._solve(steps, names))[:, 1]
            low, high = np.where(fits, middle, low), np.where(fits, high, middle)
        return low

    def _solve(
        self, tension: Float[np.ndarray, "r s t"], names: Sequence[str]
    ) -> Mapping[str, np.ndarray]:
        strokes = np.full(tension.shape[1:], np.nan)
        turn = np.array(getattr(self.load, "base_rotation", (0.0, 0.0, 0.0)))
        external = (self.load,) * tension.shape[1]
        paths = [LoadPath.of_valid(one, strokes, turn, external) for one in tension]
        outputs = tuple(dict.fromkeys([*names, "converged"]))
        return simulate_batch(
            self.robot, paths, outputs=outputs, settings=_SETTINGS, cores=self.cores
        )


def _joined(
    explorer: _Explorer, largest: Float[np.ndarray, " t"], pieces: Sequence[_Piece]
) -> Workspace:
    """Return the states of all pieces that are kept, one after the other."""
    columns: dict[str, list[np.ndarray]] = {}
    tried = failed = beyond = 0
    for piece in pieces:
        keeps, converged = piece.keeps, np.asarray(piece.outputs["converged"], bool)
        tried += keeps.size
        failed += int((~converged).sum())
        beyond += int((converged & ~keeps).sum())
        tip = piece.outputs["tip_position"]
        half = keeps.shape[1] // 2
        # The same tensions stand at mirrored places of the way up and down.
        apart = np.linalg.norm(tip - tip[:, ::-1], axis=2)
        apart = np.where(keeps & keeps[:, ::-1], apart, np.nan)
        loading = np.broadcast_to(np.arange(keeps.shape[1]) < half, keeps.shape)
        rows = {
            "tension": piece.tension,
            "tip": tip,
            "direction": piece.outputs["tip_rotation"][..., :, 2],
            "loading": loading,
            "strain": np.nanmax(np.abs(piece.outputs["peak_strain"]), axis=2),
            "angle": piece.outputs["total_angle"],
            "hysteresis": apart,
            "stiffness": np.full(keeps.shape, np.nan),
        }
        for name, values in rows.items():
            columns.setdefault(name, []).append(np.asarray(values)[keeps])
    joined = {name: np.concatenate(parts) for name, parts in columns.items()}
    robot, limits, load = explorer.robot, explorer.limits, explorer.load
    return Workspace(robot, limits, load, largest, tried, failed, beyond, **joined)
