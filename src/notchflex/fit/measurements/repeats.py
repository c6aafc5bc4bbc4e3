"""Repeatability of measurements: the standard deviation between pulls at the same loads."""

from __future__ import annotations

from bisect import bisect_left
from collections.abc import Hashable
from itertools import pairwise

import numpy as np

from notchflex.fit.measurements.loading_order import TURN, turning_points
from notchflex.fit.measurements.measurements import Integers, Measurements, Numbers

# Resolution of a sensor if unknown, as a part of the range of a command.
_STEP = 1e-3

Curve = tuple[Numbers, Integers]
"""Loads of a pull, rising, and its rows."""


def repeats(measurements: Measurements, *, step: float | None = None) -> dict[str, float]:
    """Estimate the standard deviation of what was measured from its repeats.

    Rows repeat each other if the loads are the same and, where the rows of a pull are one path, if
    they are of different pulls with the same history. If at least half of the rows have such a row,
    their variances are pooled, each with one degree of freedom less than it has rows: an unbiased
    estimate of the variance.

    Otherwise pulls are interpolated linearly and compared at equal loads: the variance between the
    pulls, averaged over all loads that at least two of them cover (not over rows, which may be
    crowded). This includes errors that stay the same through a pull in full; errors that are
    independent from row to row come out up to 20 % too small.

    Args:
        measurements: The rows.
        step: Resolution of the sensors, N or mm: loads are the same if they round to the same
            multiple of it. By default a thousandth of the range of each.

    Returns:
        By name of the quantity, rad, mm or N: root mean square over its components; NaN where
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
    """Estimate as `repeats` does, for every notch, coordinate or tendon by itself.

    Arguments are those of `repeats`; the arrays have the shape of a row of the quantity.
    """
    commands = _commands(measurements)
    span, pulls = np.ptp(commands, axis=0), measurements.pull_number
    steps = np.where(span > 0.0, _STEP * span if step is None else step, 1.0)
    rounded = np.round((commands - commands[0]) / steps).astype(int)
    histories = np.zeros(len(pulls), int)
    if not measurements.from_rest:
        histories = _histories(pulls, commands, TURN * span)
    # On paths only rows of different pulls repeat each other.
    same = [
        rows
        for rows in _groups(np.column_stack([histories, rounded]))
        if len(rows if measurements.from_rest else np.unique(pulls[rows])) == len(rows) > 1
    ]
    is_repeated = 2 * sum(map(len, same)) >= len(measurements)
    curves = [] if is_repeated else _comparable_curves(pulls, histories, commands, rounded)
    return {
        name: np.sqrt(
            [
                _pooled(component, same) if is_repeated else _between(component, curves)
                for component in values.reshape(len(values), -1).T
            ]
        ).reshape(values.shape[1:])
        for name, values in measurements.observed.items()
    }


def _groups(labels: Integers) -> list[Integers]:
    """Rows with equal labels."""
    number = np.unique(labels, axis=0, return_inverse=True)[1].ravel()
    return np.split(np.argsort(number, kind="stable"), np.cumsum(np.bincount(number))[:-1])


def _root_mean_square(values: Numbers) -> float:
    finite = values[np.isfinite(values)]
    return float(np.sqrt(np.mean(finite**2))) if finite.size else float("nan")


def _commands(measurements: Measurements) -> Numbers:
    """All loads, rows by numbers; 0 where nothing is commanded."""
    load = measurements.load
    external: list[list[float]] = []
    for external_load in load.external:
        row = [
            *external_load.tip_force,
            *external_load.tip_moment,
            *external_load.tip_point,
            *external_load.weight(external_load.tip_mass),
            *(external_load.gravity or (0.0, 0.0, 0.0)),
            external_load.temperature or 0.0,
            -1.0 if external_load.sheath_bend_deg is None else external_load.sheath_bend_deg,
        ]
        for force in external_load.body_forces:
            row += [float(force.body), *force.force, *force.moment, *force.point]
        external.append(row)
    width = max(map(len, external))
    padded = np.array([row + [0.0] * (width - len(row)) for row in external])
    by_stroke = ~np.isnan(load.stroke) * 1.0
    return np.hstack([np.nan_to_num(load.tension), np.nan_to_num(load.stroke), by_stroke, padded])


def _histories(pulls: Integers, commands: Numbers, near: Numbers) -> Integers:
    """Number the histories of the rows, by the turning points of all commands before them."""
    histories: list[list[tuple[int, float]]] = [[] for _ in pulls]
    for column in np.flatnonzero(near > 0.0).tolist():
        for pull in np.unique(pulls):
            rows = np.flatnonzero(pulls == pull)
            values = commands[rows, column]
            points = turning_points(values, near[column])
            ends = values[[0, *points, len(values) - 1]]
            for position, row in enumerate(rows):
                branch = bisect_left(points, position)
                way = np.inf if ends[branch + 1] >= ends[branch] else -np.inf
                histories[row] += [(column, end) for end in (*ends[1 : branch + 1], way)]

    def are_equal(first: list[tuple[int, float]], second: list[tuple[int, float]]) -> bool:
        return len(first) == len(second) and all(
            column == other and (value == end or abs(value - end) <= near[column])
            for (column, value), (other, end) in zip(first, second, strict=True)
        )

    distinct: list[list[tuple[int, float]]] = []
    numbers: list[int] = []
    for history in histories:
        equal = (number for number, other in enumerate(distinct) if are_equal(history, other))
        numbers.append(next(equal, len(distinct)))
        distinct += [history] * (numbers[-1] == len(distinct))
    return np.array(numbers)


def _pooled(values: Numbers, groups: list[Integers]) -> float:
    """Variance within groups of rows."""
    total, freedom = 0.0, 0
    for rows in groups:
        group = values[rows]
        group = group[~np.isnan(group)]
        if len(group) > 1:
            total += float(np.sum((group - group.mean()) ** 2))
            freedom += len(group) - 1
    return total / freedom if freedom else float("nan")


def _comparable_curves(
    pulls: Integers, histories: Integers, commands: Numbers, rounded: Integers
) -> list[list[Curve]]:
    """Groups of pulls in which the same single command varies, after the same history."""
    together: dict[Hashable, list[Curve]] = {}
    for rows in _groups(np.column_stack([pulls, histories])):
        varying = np.flatnonzero(np.ptp(rounded[rows], axis=0)).tolist()
        if len(varying) == 1:
            rest = np.delete(rounded[rows[0]], varying).tobytes()
            rows = rows[np.argsort(commands[rows, varying[0]], kind="stable")]
            curve = commands[rows, varying[0]], rows
            together.setdefault((histories[rows[0]], *varying, rest), []).append(curve)
    return [curves for curves in together.values() if len(curves) > 1]


def _between(values: Numbers, comparable: list[list[Curve]]) -> float:
    """Variance between pulls, averaged over the loads that at least two of them cover."""
    total, freedom = 0.0, 0.0
    for curves in comparable:
        means = list[tuple[Numbers, Numbers]]()  # of what was measured at loads, each once
        for load, rows in curves:
            is_known = ~np.isnan(values[rows])
            loads, number = np.unique(load[is_known], return_inverse=True)
            if len(loads) > 1:
                total_there = np.bincount(number, values[rows][is_known])
                means.append((loads, total_there / np.bincount(number)))
        if len(means) < 2:
            continue
        knots = np.unique(np.concatenate([loads for loads, _ in means]))
        for low, high in pairwise(knots.tolist()):
            covering = [pull for pull in means if pull[0][0] <= low and high <= pull[0][-1]]
            if len(covering) < 2:
                continue
            # Between knots every pull is a straight line: Simpson's rule is exact for the squares.
            at = np.array([low, 0.5 * (low + high), high])
            squares = np.var([np.interp(at, *pull) for pull in covering], axis=0) * len(covering)
            total += (high - low) * float(squares @ [1.0, 4.0, 1.0]) / 6.0
            freedom += (high - low) * (len(covering) - 1)
    return total / freedom if freedom else float("nan")
