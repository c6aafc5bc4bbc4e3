"""One cut on the unrolled tube: x along the tube, y = outer radius times angle, both in mm.

Kerf and corner radii belong to the plane that the beam is at right angles to: for a radial cut that
is the unrolled surface, for a beam beside the axis the plane of the cut's profile.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from itertools import pairwise
from typing import NamedTuple

from notchflex.errors import InputError
from notchflex.robot.notches.cut import NotchCut, Point
from notchflex.robot.notches.profile import Arc, Line, pieces

_DEEPEST = 14
"""Halvings of a piece at most: 16384 chords."""
_STRAIGHT = 1e-12
"""A point nearer than this to the line of its neighbours is left out [mm]."""


class Path(NamedTuple):
    """Offset of the path of the beam from the edge of the cut.

    Attributes:
        inside: Distance of the path from the edge, into the waste [mm].
        corner_radius: Radius of the cut's sharp corners [mm].
        chord: Largest distance of a curve from its chords [mm].
    """

    inside: float
    corner_radius: float
    chord: float


def unrolled(cut: NotchCut, outer_radius: float, path: Path, name: str) -> list[Point]:
    """Return the closed outline of a cut on the unrolled tube, about its own side at y = 0.

    Args:
        cut: The cut.
        outer_radius: Outer radius of the tube [mm].
        path: The path of the beam.
        name: What the cut is called in messages.

    Returns:
        Corners, counter-clockwise as x goes right and y goes up; the first is not repeated.

    Raises:
        InputError: The kerf or the radius does not fit the cut.
    """
    # In the plane of a radial cut, height is minus the arc length from the middle of the cut.
    corners = cut.corners
    top = outer_radius
    if cut.radial:
        corners = [(x, -outer_radius * _angle(height, outer_radius)) for x, height in corners]
        top = 0.0
    corners = shrunk(corners, path.inside, top, name)
    radii = [radius or path.corner_radius for radius in cut.radii]
    if (least := min(radius for radius in radii[1:-1])) and least < path.inside - _STRAIGHT:
        raise InputError.OUT_OF_RANGE(
            f"{name}: its corners have a radius of {least:.6g} mm, and the path of the beam runs "
            f"{path.inside:.6g} mm inside; give a smaller kerf or a larger radius."
        )
    radii = [max(radius - path.inside, 0.0) for radius in radii]
    half: list[Point] = []
    for piece in pieces(corners, radii):
        half += _flattened(_on_surface(piece, cut.radial, outer_radius), path.chord)
    half.append(_surface_point(corners[-1], cut.radial, outer_radius))
    # `half` has positive y and goes toward the tip, which is clockwise.
    return _without_straight([*reversed(half), *((x, -y) for x, y in half)])


def _angle(height: float, outer_radius: float) -> float:
    return math.acos(min(1.0, max(-1.0, height / outer_radius)))


def _surface_point(point: Point, radial: bool, outer_radius: float) -> Point:
    """Return a point of the plane on the unrolled surface."""
    along, height = point
    return along, -height if radial else outer_radius * _angle(height, outer_radius)


def _on_surface(piece: Line | Arc, radial: bool, outer_radius: float) -> Callable[[float], Point]:
    """Return a piece as a curve on the unrolled surface, from 0 to 1."""
    if radial or isinstance(piece, Arc):
        return lambda part: _surface_point(piece.at(part), radial, outer_radius)
    (x, low), (u, high) = piece
    first, last = (_angle(height, outer_radius) for height in (low, high))
    if abs(high - low) < _STRAIGHT:
        return lambda part: ((1.0 - part) * x + part * u, outer_radius * first)

    def at(part: float) -> Point:
        # Even steps of the angle: a curve that meets the surface is smooth in it.
        angle = (1.0 - part) * first + part * last
        along = (outer_radius * math.cos(angle) - low) / (high - low)
        if part in (0.0, 1.0):
            along = part
        return (1.0 - along) * x + along * u, outer_radius * angle

    return at


def _flattened(curve: Callable[[float], Point], chord: float) -> list[Point]:
    """Return points of a curve from its start up to before its end."""
    points: list[Point] = []

    def add(low: float, high: float, depth: int) -> None:
        start, end = curve(low), curve(high)
        away = max(
            _distance(curve(low + part * (high - low)), start, end) for part in (0.25, 0.5, 0.75)
        )
        if away <= chord:
            points.append(start)
            return
        if depth == _DEEPEST:
            raise InputError.OUT_OF_RANGE(
                f"chord: with {chord:g} mm a curve of this pattern needs more than "
                f"{2**_DEEPEST} points; give a larger chord."
            )
        middle = 0.5 * (low + high)
        add(low, middle, depth + 1)
        add(middle, high, depth + 1)

    add(0.0, 1.0, 0)
    return points


def _distance(point: Point, start: Point, end: Point) -> float:
    """Return the distance of a point from a line through two others."""
    length = math.dist(start, end)
    if length == 0.0:
        return math.dist(point, start)
    (x, y), (u, v) = start, end
    return abs((u - x) * (point[1] - y) - (v - y) * (point[0] - x)) / length


def _without_straight(points: Sequence[Point]) -> list[Point]:
    """Leave out corners of a closed line that are none, and points that stand twice."""
    kept: list[Point] = []
    for point in points:
        if not kept or math.dist(point, kept[-1]) > _STRAIGHT:
            kept.append(point)
    while math.dist(kept[0], kept[-1]) <= _STRAIGHT:
        kept.pop()
    count = len(kept)
    return [
        kept[number]
        for number in range(count)
        if _distance(kept[number], kept[number - 1], kept[(number + 1) % count]) > _STRAIGHT
    ]


def shrunk(corners: Sequence[Point], inside: float, top: float, name: str) -> list[Point]:
    """Return the corners of a profile whose lines have moved into the waste, to their left.

    Args:
        corners: Corners; the first and the last at the height `top`.
        inside: How far the lines move [mm].
        top: Height at which the profile is open.
        name: What the cut is called in messages.

    Raises:
        InputError: The cut is too narrow.
    """
    if inside == 0.0:
        return list(corners)
    moved: list[Line] = []
    for (x, y), (u, v) in pairwise(corners):
        length = math.dist((x, y), (u, v))
        aside = -inside * (v - y) / length, inside * (u - x) / length
        moved.append(Line((x + aside[0], y + aside[1]), (u + aside[0], v + aside[1])))
    points = [_at_height(moved[0], top)]
    points += [_crossing(one, two) for one, two in pairwise(moved)]
    points.append(_at_height(moved[-1], top))
    for ((x, y), (u, v)), ((a, b), (c, d)) in zip(pairwise(points), moved, strict=True):
        if (u - x) * (c - a) + (v - y) * (d - b) <= 0.0:
            raise InputError.OUT_OF_RANGE(
                f"{name}: a path {inside:.6g} mm inside its edges does not fit into it; give a "
                "smaller kerf or a larger cut."
            )
    return points


def _at_height(line: Line, height: float) -> Point:
    (x, y), (u, v) = line
    return x + (u - x) * (height - y) / (v - y), height


def _crossing(one: Line, two: Line) -> Point:
    """Return the point where two lines cross; their common end where they are one line."""
    (x, y), (u, v) = one
    (a, b), (c, d) = two
    turn = (u - x) * (d - b) - (v - y) * (c - a)
    if abs(turn) < _STRAIGHT * math.dist(*one) * math.dist(*two):
        return u, v
    part = ((a - x) * (d - b) - (b - y) * (c - a)) / turn
    return x + part * (u - x), y + part * (v - y)
