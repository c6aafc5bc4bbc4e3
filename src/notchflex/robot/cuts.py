"""What a notch removes from the tube: cuts as they are seen from the side."""

import math
from collections.abc import Sequence
from itertools import pairwise
from typing import Any, NamedTuple

from notchflex.errors import InputError

Point = tuple[float, float]


def cosine_of(angle_deg: float) -> float:
    """Return the cosine of an angle [deg]."""
    return math.cos(math.radians(angle_deg))


class NotchCut(NamedTuple):
    """One cut, from the outer surface into the tube and back out.

    Its corners lie in the plane through the tube axis and the middle of the cut.  The first
    coordinate runs along the tube from the start of the notch toward the tip, the second from the
    tube axis toward the side of the cut.

    Attributes:
        side_deg: Side of the tube from which it is cut [deg].
        corners: Corners from the base toward the tip [mm]; the first and the last one lie on the
            outer surface.
        radii: Radius of each corner [mm]; 0 is sharp.
        radial: Whether its walls point to the tube axis (a beam on the axis); otherwise they are
            at right angles to the plane of the corners (a beam or saw beside the axis).
    """

    side_deg: float
    corners: tuple[Point, ...]
    radii: tuple[float, ...]
    radial: bool = False

    def moved(self, along: float) -> "NotchCut":
        """Return the cut farther toward the tip [mm]."""
        return self._replace(corners=tuple((x + along, height) for x, height in self.corners))


class CutLayout(NamedTuple):
    """The cuts of one notch.

    Attributes:
        cuts: The cuts, measured from the start of the notch.
        length: Length of tube from the start of the notch to that of the next one, or to the
            tip [mm].
    """

    cuts: tuple[NotchCut, ...]
    length: float


def whole_gap(notch: Any, outer: float) -> CutLayout:
    """Return the layout of a gap that leaves nothing of a tube of an outer radius, mm."""
    gap = slot(notch.direction_deg, (0.0, notch.length), -1.5 * outer, outer)
    return CutLayout((gap,), notch.length + notch.uncut_length)


def slot(
    side_deg: float,
    ends: Point,
    bottom: float,
    surface: float,
    *,
    radius: float = 0.0,
    radial: bool = False,
) -> NotchCut:
    """Return a slot: its ends along the tube, bottom above the axis, radius of its corners [mm]."""
    start, end = ends
    corners = ((start, surface), (start, bottom), (end, bottom), (end, surface))
    return NotchCut(side_deg, corners, (0.0, radius, radius, 0.0), radial)


# Openings of the wall at a notch, through which a tendon passes from body to body.


class Opening(NamedTuple):
    """An opening of the wall through which a tendon enters the body beyond a notch.

    Attributes:
        side_deg: Side of the tube that is open [deg]; None is open all round.
        leaves: How far beyond its nominal distal face the last body that the tendon was in has its
            edge here [mm]; the nominal face is `Notch.spacing` beyond the body's origin, and
            `Tube.base_length` for the base.
        enters: Distance of the edge of the body beyond the notch from its origin [mm].
        leaves_rise: How much farther the first of these edges lies for each mm that it lies inside
            the outer surface, across the tube: the edge of a triangular notch leans.
        enters_rise: The same of the second edge.

    Example:
        >>> Opening(90.0, 0.0, 0.0).admits(60.0), Opening(90.0, 0.0, 0.0).admits(-60.0)
        (True, False)
    """

    # A tendon may bypass a body: where its side of the wall is not cut, the wall there belongs to a
    # body nearer the base or nearer the tip.

    side_deg: float | None
    leaves: float
    enters: float
    leaves_rise: float = 0.0
    enters_rise: float = 0.0

    def admits(self, direction_deg: float) -> bool:
        """Return whether a tendon on this side of the tube [deg] passes through."""
        return self._cosine(direction_deg) > 0.0

    def inside(self, direction_deg: float, outer_radius: float, radius: float) -> float:
        """Return the depth of a line at a radius, on a side [deg], below the outer surface [mm]."""
        return outer_radius - radius * self._cosine(direction_deg)

    def faces(self, direction_deg: float) -> bool:
        """Return whether this side of the tube [deg] is the middle of the opening."""
        return self.side_deg is not None and self._cosine(direction_deg) > 1.0 - 1e-9

    def _cosine(self, direction_deg: float) -> float:
        return 1.0 if self.side_deg is None else cosine_of(direction_deg - self.side_deg)


# Lines and arcs of a cut's profile: corners joined by lines, each rounded by its radius.
#
# Both move into the waste for a beam, which may be wider along the tube than round it: each by the
# distance of an ellipse's tangent from its centre, so that the ellipse rolls on the profile.

_ROUNDING = 1e-9
"""Lengths that differ by less are equal [mm]: far below any laser, above rounding."""
_STRAIGHT = 1e-12
"""Sine of the angle between two lines that are the same line."""


class Line(NamedTuple):
    """A straight piece."""

    start: Point
    end: Point

    def point(self, part: float) -> Point:
        """Return the point at a part of its length, 0 to 1."""
        (x, y), (u, v) = self
        return (1.0 - part) * x + part * u, (1.0 - part) * y + part * v


class Arc(NamedTuple):
    """A circular piece from an angle [rad] on, counter-clockwise for a positive `sweep`.

    Its points move to its left by the semi-axes `inside` of an ellipse.
    """

    centre: Point
    radius: float
    start_angle: float
    sweep: float
    inside: Point

    def point(self, part: float) -> Point:
        """Return the point at a part of its length, 0 to 1."""
        angle = self.start_angle + part * self.sweep
        cosine, sine = math.cos(angle), math.sin(angle)
        (x, y), (along, across) = self.centre, self.inside
        # The point of an ellipse with this normal: its squared semi-axes times the normal over the
        # distance of the tangent.
        scale = math.copysign(math.hypot(along * cosine, across * sine) or 1.0, self.sweep)
        return (
            x + (self.radius - along**2 / scale) * cosine,
            y + (self.radius - across**2 / scale) * sine,
        )


def pieces(
    corners: Sequence[Point], radii: Sequence[float], inside: Point = (0.0, 0.0)
) -> list[Line | Arc]:
    """Return lines and arcs through corners [mm], moved `inside` to the left along x and y."""
    outline: list[Line | Arc] = []
    moved = shrunk(corners, inside, corners[0][1])
    used = 0.0  # length of the line before a corner that the corner before it takes
    last = moved[0]
    for before, corner, after, radius, sharp in zip(
        corners[:-2], corners[1:-1], corners[2:], radii[1:-1], moved[1:-1], strict=True
    ):
        # The length that a fillet takes of both lines, and its arc; none where it is sharp.
        tangent, arc = 0.0, None
        first = math.atan2(corner[1] - before[1], corner[0] - before[0])
        second = math.atan2(after[1] - corner[1], after[0] - corner[0])
        turn = math.remainder(second - first, math.tau)
        if radius > 0.0 and turn != 0.0:
            tangent = radius * math.tan(0.5 * abs(turn))
            side = math.copysign(1.0, turn)  # of the centre: left of the line for a left turn
            start = corner[0] - tangent * math.cos(first), corner[1] - tangent * math.sin(first)
            centre = (
                start[0] - side * radius * math.sin(first),
                start[1] + side * radius * math.cos(first),
            )
            arc = Arc(centre, radius, first - side * 0.5 * math.pi, turn, inside)
        available = min(math.dist(before, corner) - used, math.dist(corner, after))
        if tangent > available + _ROUNDING:
            raise InputError.OUT_OF_RANGE(
                f"a corner radius of {radius:.6g} mm does not fit the cut: its arc takes "
                f"{tangent:.6g} mm of a line of {available:.6g} mm; give a smaller radius."
            )
        start, end = (sharp, sharp) if arc is None else (arc.point(0.0), arc.point(1.0))
        outline += [Line(last, start)] if math.dist(last, start) > _ROUNDING else []
        outline += [] if arc is None else [arc]
        last, used = end, tangent
    outline.append(Line(last, moved[-1]))
    return outline


def shrunk(corners: Sequence[Point], inside: Point, top: float) -> list[Point]:
    """Return the corners [mm] of a profile, open at `top`, that moved `inside` to the left."""
    lines: list[tuple[Point, float]] = []  # their normals, and how far they move
    for (x, y), (u, v) in pairwise(corners):
        length = math.dist((x, y), (u, v))
        normal = (y - v) / length, (u - x) / length
        lines.append((normal, math.hypot(inside[0] * normal[0], inside[1] * normal[1])))
    first, last = (((0.0, 1.0), top - y) for _, y in (corners[0], corners[-1]))
    points: list[Point] = []
    for (x, y), ((a, b), far), ((c, d), away) in zip(
        corners, [first, *lines], [*lines, last], strict=True
    ):
        turn = a * d - b * c
        if abs(turn) < _STRAIGHT:
            points.append((x + far * a, y + far * b))
        else:
            points.append((x + (far * d - away * b) / turn, y + (away * a - far * c) / turn))
    for ((x, y), (u, v)), ((a, b), (c, d)) in zip(pairwise(points), pairwise(corners), strict=True):
        if (u - x) * (c - a) + (v - y) * (d - b) <= 0.0:
            raise InputError.OUT_OF_RANGE(
                f"a path {max(inside):.6g} mm inside the edges does not fit into it; give a "
                "smaller kerf, less polishing or a larger cut."
            )
    return points


def outline(cut: NotchCut, chord: float) -> list[Point]:
    """Return the profile of a cut as points; arcs are at most `chord` [mm] from their chords."""
    points = [cut.corners[0]]
    for piece in pieces(cut.corners, cut.radii):
        count = 1
        if isinstance(piece, Arc):
            step = 2.0 * math.acos(max(1.0 - chord / piece.radius, 0.0))
            count = max(1, math.ceil(abs(piece.sweep) / step - 1e-9))
        points += [piece.point(number / count) for number in range(1, count + 1)]
    return points
