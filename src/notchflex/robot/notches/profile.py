"""Lines and arcs of a cut's profile: corners joined by lines, each rounded by its radius."""

import math
from collections.abc import Sequence
from typing import NamedTuple

from notchflex.errors import InputError
from notchflex.robot.notches.cut import NotchCut, Point

_ROUNDING = 1e-9
"""Lengths that differ by less than this are equal [mm]: far below any laser, above rounding."""


class Line(NamedTuple):
    """A straight piece."""

    start: Point
    end: Point

    def at(self, part: float) -> Point:
        """Return the point at a part of its length, 0 to 1."""
        (x, y), (u, v) = self
        return (1.0 - part) * x + part * u, (1.0 - part) * y + part * v


class Arc(NamedTuple):
    """A circular piece from an angle [rad] on, counter-clockwise for a positive `sweep`."""

    centre: Point
    radius: float
    start_angle: float
    sweep: float

    def at(self, part: float) -> Point:
        """Return the point at a part of its length, 0 to 1."""
        angle = self.start_angle + part * self.sweep
        x, y = self.centre
        return x + self.radius * math.cos(angle), y + self.radius * math.sin(angle)


def pieces(corners: Sequence[Point], radii: Sequence[float]) -> list[Line | Arc]:
    """Return the lines and arcs of an open line of corners.

    Args:
        corners: Corners from first to last [mm].
        radii: Radius of each corner [mm]; those of the first and the last have no effect.

    Raises:
        InputError: A radius is too large for the lines beside it.
    """
    outline: list[Line | Arc] = []
    used = 0.0  # length of the line before a corner that the corner before it takes
    last = corners[0]
    for before, corner, after, radius in zip(
        corners[:-2], corners[1:-1], corners[2:], radii[1:-1], strict=True
    ):
        tangent, arc = _fillet(before, corner, after, radius)
        available = min(math.dist(before, corner) - used, math.dist(corner, after))
        if tangent > available + _ROUNDING:
            raise InputError.OUT_OF_RANGE(
                f"a corner radius of {radius:.6g} mm does not fit the cut: its arc takes "
                f"{tangent:.6g} mm of a line of {available:.6g} mm; give a smaller radius."
            )
        start, end = (corner, corner) if arc is None else (arc.at(0.0), arc.at(1.0))
        outline += [Line(last, start)] if math.dist(last, start) > _ROUNDING else []
        outline += [] if arc is None else [arc]
        last, used = end, tangent
    outline.append(Line(last, corners[-1]))
    return outline


def _fillet(before: Point, corner: Point, after: Point, radius: float) -> tuple[float, Arc | None]:
    """Return the length that a fillet takes of both lines, and its arc; none where it is sharp."""
    first = math.atan2(corner[1] - before[1], corner[0] - before[0])
    second = math.atan2(after[1] - corner[1], after[0] - corner[0])
    turn = math.remainder(second - first, math.tau)
    if radius <= 0.0 or turn == 0.0:
        return 0.0, None
    tangent = radius * math.tan(0.5 * abs(turn))
    side = math.copysign(1.0, turn)  # of the centre: left of the line for a left turn
    start = corner[0] - tangent * math.cos(first), corner[1] - tangent * math.sin(first)
    centre = (
        start[0] - side * radius * math.sin(first),
        start[1] + side * radius * math.cos(first),
    )
    return tangent, Arc(centre, radius, first - side * 0.5 * math.pi, turn)


def outline(cut: NotchCut, chord: float) -> list[Point]:
    """Return the profile of a cut as points.

    Args:
        cut: The cut.
        chord: Largest distance of an arc from its chords [mm].
    """
    points = [cut.corners[0]]
    for piece in pieces(cut.corners, cut.radii):
        count = 1
        if isinstance(piece, Arc):
            step = 2.0 * math.acos(max(1.0 - chord / piece.radius, 0.0))
            count = max(1, math.ceil(abs(piece.sweep) / step - 1e-9))
        points += [piece.at(number / count) for number in range(1, count + 1)]
    return points
