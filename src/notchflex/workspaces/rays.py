"""Rays of tension, solved as far as limits allow.

A ray is a ratio of tensions that rises from 0 to a peak and falls again, so that every tension
is there while loading and while unloading. Of the tendons that end at one body two neighbours are
pulled at a time: what more would add is pressed together, not moved.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float
from numpy.typing import ArrayLike

from notchflex import InputError, LoadPath, Robot, Settings, closing, simulate_batch
from notchflex.loads.load import NO_VECTOR
from notchflex.pieces.sobol import SobolPart
from notchflex.specification import LimitedQuantity
from notchflex.support import ExternalLoad, short_repr
from notchflex.workspaces.cloud import Workspace
from notchflex.workspaces.limits import all_hold

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
    limits: tuple[LimitedQuantity, ...]
    load: ExternalLoad
    cores: int | None

    def piece(self, tension: Float[np.ndarray, "r s t"]) -> RayPiece:
        """Solve rays as far as the limits allow."""
        if self.limits:
            tension = tension * self._allowed(tension)[:, None, None]
        outputs = self._solve(tension, (*_KEPT, *(one.quantity for one in self.limits)))
        keeps = all_hold(self.limits, outputs)
        # What follows a state beyond a limit has a history that the limit forbids.
        keeps = np.logical_and.accumulate(keeps, axis=1)
        return RayPiece(tension, outputs, keeps)

    def _allowed(self, tension: Float[np.ndarray, "r s t"]) -> Float[np.ndarray, " r"]:
        """Return the part of each ray that the limits allow, by a pull in few levels."""
        part = np.linspace(0.0, 1.0, _FIRST_LEVELS + 1)[1:]
        peak = tension[:, tension.shape[1] // 2]
        path = part[None, :, None] * peak[:, None]
        hold = all_hold(self.limits, self._solve(path, [one.quantity for one in self.limits]))
        within = np.logical_and.accumulate(hold, axis=1).sum(axis=1)
        # Between the last level within and the first beyond: halved a few times, rays as a batch.
        low = np.concatenate([[0.0], part])[within]
        high = np.where(within == len(part), 1.0, np.concatenate([part, [1.0]])[within])
        for _ in range(5):
            middle = 0.5 * (low + high)
            steps = np.stack([low, middle], axis=1)[:, :, None] * peak[:, None]
            names = [one.quantity for one in self.limits]
            fits = all_hold(self.limits, self._solve(steps, names))[:, 1]
            low, high = np.where(fits, middle, low), np.where(fits, high, middle)
        return low

    def _solve(
        self, tension: Float[np.ndarray, "r s t"], names: Sequence[str]
    ) -> Mapping[str, np.ndarray]:
        paths = [under(self.load, part) for part in tension]
        return simulate_batch(
            self.robot, paths, outputs=names, settings=_SETTINGS, cores=self.cores
        )


def under(load: ExternalLoad, tension: Float[np.ndarray, "s t"]) -> LoadPath:
    """Return a path of valid tensions under a load that acts all the time."""
    turn = np.array(getattr(load, "base_rotation", NO_VECTOR))
    external = (load.external,) * len(tension)
    return LoadPath.of_valid(tension, np.full(tension.shape, np.nan), turn, external)


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
            "strain": np.abs(piece.outputs["peak_strain"]).max(axis=2),
            "angle": piece.outputs["total_angle"],
            "hysteresis": apart,
            "stiffness": np.full(keeps.shape, np.nan),
        }
        for name, values in rows.items():
            columns.setdefault(name, []).append(np.asarray(values)[keeps])
    joined = {name: np.concatenate(parts) for name, parts in columns.items()}
    robot, limits, load = explorer.robot, explorer.limits, explorer.load
    return Workspace(robot, limits, load, largest, tried, failed, beyond, **joined)


def largest_tensions(robot: Robot, tension: ArrayLike | None) -> Float[np.ndarray, " t"]:
    """Return the largest tension of every tendon, N; by default that which closes all notches.

    Raises:
        InputError: Not one number or one per tendon, not above 0, or none is given and no tension
            closes the notches.
    """
    tendons = robot.number_of_tendons
    if tension is None:
        return np.full(tendons, _closing_tension(robot))
    try:
        values = np.array(tension, float)
    except (TypeError, ValueError):
        raise InputError.WRONG_TYPE(
            f"tension must be a number of N, or one per tendon; got {short_repr(tension)}"
        ) from None
    if values.shape not in ((), (tendons,)):
        raise InputError.WRONG_SHAPE(
            f"tension must be one number or {tendons}, one per tendon; got {short_repr(tension)}"
        )
    if not np.isfinite(values).all():
        raise InputError.NOT_FINITE(f"tension must be finite, N; got {short_repr(tension)}")
    if (values < 0.0).any() or not (values > 0.0).any():
        raise InputError.OUT_OF_RANGE(
            f"a tendon only pulls: give a largest tension above 0 N; got {short_repr(tension)}"
        )
    return np.broadcast_to(values, tendons).copy()


def _closing_tension(robot: Robot) -> float:
    tensions = np.asarray(closing(robot).tension)
    finite = tensions[np.isfinite(tensions)]
    if not len(finite):
        raise InputError.MISSING_VALUE(
            f"no tension closes a notch of {robot.name}, so that nothing says how far to pull; "
            "give the largest tension"
        )
    return float(finite.max())


def rays(
    robot: Robot,
    largest: Float[np.ndarray, " t"],
    count: int,
    levels: int,
    pretension: float,
    seed: int,
) -> Float[np.ndarray, "r s t"]:
    """Return tensions along rays: a number of levels up to a peak, and the same levels down.

    Half of the rays reach the largest tensions, the others a part of them: unloading begins at many
    peaks. Directions, peaks and levels are drawn from a sequence of low discrepancy.

    Args:
        robot: The robot.
        largest: Largest tension of every tendon, N.
        count: Number of rays.
        levels: Levels of tension on each way.
        pretension: Tension that every tendon has at least, N.
        seed: Of the sequence.
    """
    drawn = ray_sequence(robot, largest, count, seed).between(0, count)
    return rays_at(robot, largest, drawn, levels, pretension)


def ray_sequence(
    robot: Robot, largest: Float[np.ndarray, " t"], count: int, seed: int
) -> SobolPart:
    """Return the sequence that rays are drawn from; arguments as for `rays`."""
    dimension = 2 * len(_groups(robot, largest)) + 2
    return SobolPart(dimension, lambda: np.random.default_rng(seed), count)


def rays_at(
    robot: Robot,
    largest: Float[np.ndarray, " t"],
    drawn: Float[np.ndarray, "r d"],
    levels: int,
    pretension: float,
) -> Float[np.ndarray, "r s t"]:
    """Return the rays of points of the sequence.

    Args:
        robot: The robot.
        largest: Largest tension of every tendon, N.
        drawn: Points of `ray_sequence`.
        levels: Levels of tension on each way.
        pretension: Tension that every tendon has at least, N.
    """
    groups, count = _groups(robot, largest), len(drawn)
    # Rays side by side take as many iterations as the hardest of them: similar ones together.
    drawn = drawn[np.argsort(drawn[:, 0], kind="stable")]
    directions = np.zeros((count, robot.number_of_tendons))
    for number, group in enumerate(groups):
        around, share = drawn[:, 2 * number], drawn[:, 2 * number + 1]
        part = _around(group, around, robot.number_of_tendons)
        directions += part * (share if len(groups) > 1 else 1.0 + 0.0 * share)[:, None]
    directions /= directions.max(axis=1, keepdims=True)
    peak = np.where(np.arange(count) % 2 == 0, 1.0, np.sqrt(drawn[:, -2]))
    steps = (np.arange(levels)[None] + drawn[:, -1:]) / levels
    steps[:, -1] = 1.0
    up = peak[:, None] * steps
    both = np.concatenate([up, up[:, ::-1]], axis=1)
    tension = both[:, :, None] * directions[:, None] * largest
    return np.maximum(tension, pretension)


def _groups(robot: Robot, largest: Float[np.ndarray, " t"]) -> list[list[int]]:
    """Return the tendons that are pulled, by the body where they end, in order around the tube."""
    groups: dict[int, list[int]] = {}
    for number, tendon in enumerate(robot.tendon):
        end = robot.number_of_notches if tendon.end_body is None else tendon.end_body
        if largest[number] > 0.0:
            groups.setdefault(end, []).append(number)
    turn = [tendon.direction_deg % 360.0 for tendon in robot.tendon]
    return [sorted(group, key=lambda one: turn[one]) for group in groups.values()]


def _around(
    group: Sequence[int], place: Float[np.ndarray, " r"], tendons: int
) -> Float[np.ndarray, "r t"]:
    """Return tensions, the larger of two 1, of neighbours at places from 0 to 1 around the tube."""
    pulled = np.zeros((len(place), tendons))
    count = len(group)
    if count == 1:
        pulled[:, group[0]] = 1.0
        return pulled
    pairs = 1 if count == 2 else count
    pair = np.minimum((place * pairs).astype(int), pairs - 1)
    angle = 0.5 * np.pi * (place * pairs - pair)
    row = np.arange(len(place))
    order = np.array(group)
    pulled[row, order[pair]] = np.cos(angle)
    pulled[row, order[(pair + 1) % count]] = np.sin(angle)
    return pulled / pulled.max(axis=1, keepdims=True)
