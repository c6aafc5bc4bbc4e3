"""Webs: the material between neighbouring cuts on the outer surface, and at the ends."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from notchflex.robot.notches.cut import Point

Points = NDArray[np.float64]


class Web(NamedTuple):
    """The thinnest material.

    Attributes:
        width: Its width on the outer surface [mm], before kerf and polishing.
        between: What lies on its two sides.
    """

    width: float
    between: tuple[str, str]


def smallest_web(
    outlines: Mapping[str, Sequence[Point]], around: float, start: float, end: float
) -> Web:
    """Find the thinnest web of a pattern.

    Args:
        outlines: Closed edges of the cuts by their names.
        around: Circumference [mm].
        start: Where the tube is cut off [mm].
        end: Where it ends at the tip [mm].
    """
    edges = [np.array(one) for one in outlines.values()]
    names = list(outlines)
    best = Web(math.inf, ("", ""))
    for name, edge in zip(names, edges, strict=True):
        ends = ((edge[:, 0].min() - start, "cut-off"), (end - edge[:, 0].max(), "tip"))
        for width, other in ends:
            best = min(best, Web(float(width), (name, other)), key=lambda web: web.width)
    # From the tip on: a cut that starts farther away than the best web so far ends the search.
    order = sorted(range(len(edges)), key=lambda number: -edges[number][:, 0].max())
    shift = np.array([0.0, around])
    for position, first in enumerate(order):
        for second in order[position:]:
            edge, other = edges[first], edges[second]
            if edge[:, 0].min() - other[:, 0].max() >= best.width:
                break
            for turn in (1.0,) if first == second else (-1.0, 0.0, 1.0):
                moved = other + turn * shift
                if _apart(edge, moved) >= best.width:
                    continue
                width = 0.0 if _overlap(edge, moved) else _distance(edge, moved)
                if width < best.width:
                    best = Web(width, (names[first], names[second]))
    return best


def _apart(one: Points, two: Points) -> float:
    """Return the distance of the boxes of two outlines."""
    gaps = np.maximum(one.min(axis=0) - two.max(axis=0), two.min(axis=0) - one.max(axis=0))
    return float(np.linalg.norm(np.maximum(gaps, 0.0)))


def _distance(one: Points, two: Points) -> float:
    """Return the least distance of two closed lines that do not cross: at a corner of one."""
    return min(_to_line(one, two), _to_line(two, one))


def _to_line(points: Points, line: Points) -> float:
    start, step = line, np.roll(line, -1, axis=0) - line
    away = points[:, None] - start
    part = np.clip((away * step).sum(-1) / (step**2).sum(-1), 0.0, 1.0)
    return float(np.linalg.norm(away - part[..., None] * step, axis=-1).min())


def _overlap(one: Points, two: Points) -> bool:
    """Whether two outlines cross, or one holds the other."""
    a, b = one, np.roll(one, -1, axis=0)
    c, d = two, np.roll(two, -1, axis=0)

    def side(p: Points, q: Points, r: Points) -> Points:
        return (q[..., 0] - p[..., 0]) * (r[..., 1] - p[..., 1]) - (q[..., 1] - p[..., 1]) * (
            r[..., 0] - p[..., 0]
        )

    a, b = a[:, None], b[:, None]
    crosses = (side(a, b, c) * side(a, b, d) < 0.0) & (side(c, d, a) * side(c, d, b) < 0.0)
    return bool(crosses.any()) or _holds(one, two[0]) or _holds(two, one[0])


def _holds(line: Points, point: Points) -> bool:
    """Whether a point lies strictly inside a closed line: a ray from it crosses it oddly."""
    (x, y), (u, v) = line.T, np.roll(line, -1, axis=0).T
    with np.errstate(divide="ignore", invalid="ignore"):
        at = x + (point[1] - y) / (v - y) * (u - x)
    return bool((((y > point[1]) != (v > point[1])) & (at > point[0])).sum() % 2)
