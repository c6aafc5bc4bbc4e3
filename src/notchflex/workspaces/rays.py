"""Solves rays of tension as far as limits allow, and joins their states."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from notchflex.analysis.batch import simulate_batch
from notchflex.loads import ExternalLoad, LoadPath
from notchflex.robot import Robot
from notchflex.solver.newton import Settings
from notchflex.workspaces.cloud import Workspace
from notchflex.workspaces.limits import Limit, all_hold

LEVELS = 16
"""Levels of tension on each way of a ray."""

# Far below what a picture or a volume shows, and a third quicker than the usual tolerance.
_SETTINGS = Settings(tolerance=1e-9)

# Levels of the first pull, that finds how far limits allow each ray to be pulled.
_FIRST_LEVELS = 12
_KEPT = ("tip_position", "tip_rotation", "peak_strain", "total_angle", "converged")


@dataclass(frozen=True, eq=False)
class RayPiece:
    """States of some rays, rays and steps as leading axes."""

    tension: Float[np.ndarray, "r s t"]
    outputs: Mapping[str, np.ndarray]
    keeps: np.ndarray


@dataclass(frozen=True, eq=False)
class Explorer:
    """A robot whose rays are solved."""

    robot: Robot
    limits: tuple[Limit, ...]
    load: ExternalLoad
    cores: int | None

    def piece(self, tension: Float[np.ndarray, "r s t"]) -> RayPiece:
        """Solve rays as far as the limits allow."""
        if self.limits:
            tension = tension * self._allowed(tension)[:, None, None]
        outputs = self._solve(tension, (*_KEPT, *(one.name for one in self.limits)))
        keeps = all_hold(self.limits, outputs)
        # What follows a state beyond a limit has a history that the limit forbids.
        keeps = np.logical_and.accumulate(keeps, axis=1)
        return RayPiece(tension, outputs, keeps)

    def _allowed(self, tension: Float[np.ndarray, "r s t"]) -> Float[np.ndarray, " r"]:
        """Return the part of each ray that the limits allow, by a pull in few levels."""
        part = np.linspace(0.0, 1.0, _FIRST_LEVELS + 1)[1:]
        peak = tension[:, tension.shape[1] // 2]
        path = part[None, :, None] * peak[:, None]
        hold = all_hold(self.limits, self._solve(path, [one.name for one in self.limits]))
        within = np.logical_and.accumulate(hold, axis=1).sum(axis=1)
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


def joined(
    explorer: Explorer, largest: Float[np.ndarray, " t"], pieces: Sequence[RayPiece]
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
