"""How well measurements repeat: the standard deviation between pulls at the same loads."""

from __future__ import annotations

from collections.abc import Hashable, Iterator
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from notchflex.fit.measurements.loading_order import TURN, turning_points
from notchflex.fit.measurements.measurements import Measurements

# The sensor's step where none is told, as a part of what a command ranges over.
_STEP = 1e-3

Numbers = NDArray[np.float64]


def repeats(measurements: Measurements, *, step: float | None = None) -> dict[str, float]:
    """Estimate the standard deviation of what was measured from its repeats.

    Rows are repeats of each other where the same was done to the robot; where rows of a pull
    are one path, in different pulls that came there the same way. If at least half of
    the rows have such a row, their variances are pooled, each with one degree of freedom less than
    it has rows: an unbiased estimate of the variance.

    Pulls that were measured at different loads are compared at equal loads by straight lines
    between neighbouring ones: the variance between the pulls, averaged over all loads that at least
    two of them cover (not over rows, which may be crowded). An error that stays the same through a
    pull is told in full so; one that is drawn anew for every row comes out up to a fifth too small.

    Args:
        measurements: The rows.
        step: What a sensor can tell apart, N or mm: loads are the same when they round to the same
            multiple of it. Left out, a thousandth of the range of each.

    Returns:
        By name of what is observed, rad, mm or N: root mean square over its components; NaN where
        nothing was repeated.

    Example:
        >>> from notchflex import LoadPath
        >>> force = np.array([[0.5], [1.0], [0.5], [1.0]])
        >>> two = Measurements(
        ...     "by hand",
        ...     LoadPath(force, np.nan * force),
        ...     ("1", "1", "2", "2"),
        ...     True,
        ...     {"total_angle": np.array([0.40, 0.81, 0.42, 0.83])},
        ... )
        >>> round(repeats(two)["total_angle"], 5)
        0.01414
    """
    each = repeats_of_each(measurements, step=step)
    return {name: _root_mean_square(values) for name, values in each.items()}


def repeats_of_each(measurements: Measurements, *, step: float | None = None) -> dict[str, Numbers]:
    """The same as `repeats` for every notch, coordinate or tendon by itself.

    Args:
        measurements: The rows.
        step: As for `repeats`.

    Returns:
        By name, in the shape of a row of what is observed.
    """
    commands = _commands(measurements)
    histories = _histories(measurements, commands)
    rounded = _rounded(commands, step)
    groups: dict[Hashable, list[int]] = {}
    for row, history in enumerate(histories):
        groups.setdefault((history, rounded[row].tobytes()), []).append(row)
    same = [rows for rows in groups.values() if _independent(rows, measurements)]
    enough = 2 * sum(len(rows) for rows in same) >= len(measurements)
    curves = [] if enough else list(_curves(measurements, commands, rounded, histories))
    found: dict[str, Numbers] = {}
    for name, values in measurements.observed.items():
        table = values.reshape(len(values), -1)
        pooled = [
            _pooled(column, same) if enough else _between_curves(column, curves)
            for column in table.T
        ]
        found[name] = np.sqrt(np.array(pooled)).reshape(values.shape[1:])
    return found


def _root_mean_square(values: Numbers) -> float:
    known = values[np.isfinite(values)]
    return float(np.sqrt(np.mean(known**2))) if known.size else float("nan")


def _commands(measurements: Measurements) -> Numbers:
    """Everything that was done, rows by numbers; 0 where nothing is commanded."""
    load = measurements.load
    parts = [np.nan_to_num(load.tension), np.nan_to_num(load.stroke), ~np.isnan(load.stroke) * 1.0]
    outside = []
    for one in load.external:
        weight = one.weight(one.tip_mass)
        gravity = one.gravity or (0.0, 0.0, 0.0)
        row = [*one.tip_force, *one.tip_moment, *one.tip_point, *weight, *gravity]
        for force in one.body_forces:
            row += [float(force.body), *force.force, *force.moment, *force.point]
        outside.append(row)
    width = max(len(row) for row in outside)
    parts.append(np.array([row + [0.0] * (width - len(row)) for row in outside]))
    return np.concatenate(parts, axis=1)


def _rounded(commands: Numbers, step: float | None) -> NDArray[np.int64]:
    reach = np.ptp(commands, axis=0)
    steps = np.where(reach > 0.0, _STEP * reach if step is None else step, 1.0)
    return np.round((commands - commands[0]) / steps).astype(np.int64)


def _histories(measurements: Measurements, commands: Numbers) -> list[Hashable]:
    """Which way every row was come to: the turning points of all commands before it."""
    if measurements.from_rest:
        return [()] * len(measurements)
    reach = np.ptp(commands, axis=0)
    turned: list[list[tuple[int, float]]] = [[] for _ in range(len(measurements))]
    for column in np.flatnonzero(reach > 0.0):
        for label in measurements.pulls:
            rows = [row for row, pull in enumerate(measurements.pull) if pull == label]
            values = commands[rows, column]
            points = turning_points(values, TURN * reach[column])
            for place, row in enumerate(rows):
                turned[row] += [(int(column), values[p]) for p in points if p < place]
                rising = _rises(values, points, place)
                turned[row].append((int(column), np.inf if rising else -np.inf))
    histories: list[Hashable] = []
    known: list[list[tuple[int, float]]] = []
    for way in turned:
        alike = (n for n, other in enumerate(known) if _alike(way, other, TURN * reach))
        number = next(alike, len(known))
        if number == len(known):
            known.append(way)
        histories.append(number)
    return histories


def _alike(first: list[tuple[int, float]], second: list[tuple[int, float]], near: Numbers) -> bool:
    if [column for column, _ in first] != [column for column, _ in second]:
        return False
    return all(
        mine == its or abs(mine - its) <= near[column]
        for (column, mine), (_, its) in zip(first, second, strict=True)
    )


def _rises(values: Numbers, points: list[int], place: int) -> bool:
    """Whether a command rises on the branch that a place lies on."""
    branch = [0, *points, len(values) - 1]
    for first, last in pairwise(branch):
        if place <= last:
            return bool(values[last] >= values[first])
    return True


def _independent(rows: list[int], measurements: Measurements) -> bool:
    """Whether rows repeat each other: of one path only those of different pulls do."""
    if measurements.from_rest:
        return len(rows) > 1
    return len({measurements.pull[row] for row in rows}) == len(rows) > 1


def _pooled(values: Numbers, groups: list[list[int]]) -> float:
    """Variance within groups of rows."""
    total, freedom = 0.0, 0
    for rows in groups:
        own = values[rows]
        own = own[~np.isnan(own)]
        if len(own) > 1:
            total += float(np.sum((own - own.mean()) ** 2))
            freedom += len(own) - 1
    return total / freedom if freedom else float("nan")


def _curves(
    measurements: Measurements,
    commands: Numbers,
    rounded: NDArray[np.int64],
    histories: list[Hashable],
) -> Iterator[list[tuple[Numbers, list[int]]]]:
    """Pulls that may be compared: of each the loads, rising, and its rows.

    They are those in which one command alone varies, the same one, after the same history.
    """
    together: dict[Hashable, list[tuple[Numbers, list[int]]]] = {}
    alike: dict[Hashable, list[int]] = {}
    for row, history in enumerate(histories):
        alike.setdefault((measurements.pull[row], history), []).append(row)
    for (_, history), rows in alike.items():  # pyright: ignore[reportGeneralTypeIssues]
        varying = np.flatnonzero(np.ptp(rounded[rows], axis=0))
        if len(varying) != 1:
            continue
        drive = int(varying[0])
        rest = np.delete(rounded[rows[0]], drive).tobytes()
        order = np.argsort(commands[rows, drive], kind="stable")
        ordered = [rows[place] for place in order]
        together.setdefault((history, drive, rest), []).append((commands[ordered, drive], ordered))
    yield from (pulls for pulls in together.values() if len(pulls) > 1)


def _between_curves(values: Numbers, comparable: list[list[tuple[Numbers, list[int]]]]) -> float:
    """Variance between pulls, averaged over the loads that at least two of them cover."""
    total, freedom = 0.0, 0.0
    for pulls in comparable:
        lines = [line for line in (_line(values, *pull) for pull in pulls) if len(line[0]) > 1]
        if len(lines) < 2:
            continue
        knots = np.unique(np.concatenate([load for load, _ in lines]))
        for low, high in pairwise(knots):
            own = [line for line in lines if line[0][0] <= low and high <= line[0][-1]]
            if len(own) < 2:
                continue
            # Between knots every pull is a straight line: Simpson's rule is exact for the squares.
            at = np.array([low, 0.5 * (low + high), high])
            table = np.stack([np.interp(at, *line) for line in own])
            squares = np.sum((table - table.mean(axis=0)) ** 2, axis=0)
            total += float(high - low) * float(squares @ [1.0, 4.0, 1.0]) / 6.0
            freedom += float(high - low) * (len(own) - 1)
    return total / freedom if freedom else float("nan")


def _line(values: Numbers, load: Numbers, rows: list[int]) -> tuple[Numbers, Numbers]:
    """Loads, each once, and means of what was measured there."""
    own = values[rows]
    there = ~np.isnan(own)
    loads, number = np.unique(load[there], return_inverse=True)
    counts = np.bincount(number, minlength=len(loads))
    means = np.bincount(number, weights=own[there], minlength=len(loads)) / np.maximum(counts, 1)
    return loads, means
