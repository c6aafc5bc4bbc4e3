"""Points on the tube axis of the projected chain, and chains that lie on given points."""

from __future__ import annotations

import math

import numpy as np
from scipy.optimize import least_squares

from notchflex.errors import InputError
from notchflex.photographs.chain.camera import NUMBERS, Frame, View
from notchflex.photographs.chain.chain_table import ChainTable, Numbers

BASE = 1.2
"""Length of the straight tube before the first notch that is looked at, outer radii."""

_ROLL = math.radians(5.0)  # of starts: views that are rolled a little are found from there
_MIN_ANGLE, _MAX_ANGLE = -0.6, 1.9  # rad: angles of notches


def axis_points(table: ChainTable, numbers: Numbers) -> Numbers:
    """Return points on the tube axis, px from the middle of the photograph, (n + 2, 2).

    One on the tube before the first notch, one where that notch starts, and the end of every body
    behind a notch; the last one is the tip.

    Args:
        table: The robot of n notches.
        numbers: Numbers of `VIEW` and angles (rad).
    """
    view = View(numbers[None], table.notches)
    start, turned = table.poses(view.angles)
    bodies = np.concatenate([[0], np.arange(table.notches + 1)])
    along = np.concatenate([[-BASE * table.outer, 0.0], table.uncut])
    frame = Frame(view, start, turned, bodies)
    return view.seen(frame.at(along))[0]


def on_axis_points(table: ChainTable, points: Numbers) -> list[Numbers]:
    """Return view and angles of chains whose axis lies on points, the better one first.

    In one the first notch is cut on the right of the way from base to tip, in the other on the
    left.

    Args:
        table: The robot of n notches.
        points: Points on the tube axis as of `axis_points`, px from the middle, (n + 2, 2).

    Raises:
        InputError: There are not n + 2 points, one is not finite, or they lie in one place.
    """
    points = np.asarray(points, float)
    if points.shape != (table.notches + 2, 2) or not np.isfinite(points).all():
        raise InputError.OUT_OF_RANGE(
            f"a chain of {table.notches} notches has {table.notches + 2} finite points (x, y); got "
            f"{points.tolist()}"
        )
    steps = np.diff(points, axis=0)
    length = float(np.linalg.norm(steps, axis=1).sum())
    if length < 1.0:
        raise InputError.OUT_OF_RANGE(
            "the points of the chain lie in one place; drag them along the robot"
        )
    scale = length / (table.length + BASE * table.outer)
    heading = np.unwrap(np.arctan2(steps[:, 1], steps[:, 0]))
    candidates: list[tuple[float, Numbers]] = []
    for side, roll in ((1.0, _ROLL), (-1.0, math.pi + _ROLL)):
        view = [0.0, 0.0, 0.0, 0.0, roll, 0.0, 0.003 / table.outer, 0.0, 0.0]
        first = np.clip(side * np.diff(heading) * table.side, _MIN_ANGLE, _MAX_ANGLE)
        start = np.array([*points[1], heading[0], math.log(scale), *first])
        free = [0, 1, 2, 3, *range(NUMBERS, NUMBERS + table.notches)]
        numbers = np.array([*view, *first])

        def off(values: Numbers, numbers: Numbers = numbers, free: list[int] = free) -> Numbers:
            numbers[free] = values
            return (axis_points(table, numbers) - points).ravel()

        bound = np.full(len(start), np.inf)
        bound[4:] = _MAX_ANGLE
        lower = np.full(len(start), -np.inf)
        lower[4:] = _MIN_ANGLE
        solved = least_squares(off, start, bounds=(lower, bound), x_scale="jac", max_nfev=60)
        numbers[free] = solved.x
        candidates.append((float(solved.cost), numbers))
    return [numbers for _, numbers in sorted(candidates, key=lambda one: one[0])]


def straight_chain(table: ChainTable, width: int, height: int) -> Numbers:
    """Return the points of a straight chain in the middle of a photograph, px, (n + 2, 2).

    Args:
        table: The robot of n notches.
        width: Width of the photograph, px.
        height: Its height, px.
    """
    numbers = np.zeros(NUMBERS + table.notches)
    numbers[2], numbers[3] = math.pi / 2.0, math.log(0.6 * height / table.length)
    points = axis_points(table, numbers)
    return points - points.mean(axis=0) + np.array([width - 1.0, height - 1.0]) / 2.0
