"""The flat pattern of a robot: closed outlines in the order of cutting, and the webs between.

Kerf and corner radii belong to the plane that the beam is at right angles to: for a radial cut that
is the unrolled surface, for a beam beside the axis the plane of the cut's profile.

x runs along the tube from the base (0) toward the tip, y is the outer radius times the angle about
the tube axis, counted from direction 0 as `direction_deg` is.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from itertools import groupby
from string import ascii_lowercase
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from notchflex import InputError, Robot, Tube
from notchflex.export.cuts import PlacedCut, angle_at, cuts_of, naming
from notchflex.export.formats import PatternOptions, Subject
from notchflex.support import Arc, Line, NotchCut, Point, pieces, robot_digest

_DEEPEST = 14
"""Halvings of a piece at most: 16384 chords."""
_STRAIGHT = 1e-12
"""A point nearer than this to the line of its neighbours is left out [mm]."""


class Path(NamedTuple):
    """Offset of the path of the beam from the edge of the cut.

    Attributes:
        inside: Distance of the path from the edge, into the waste: along the tube and round it
            [mm].
        corner_radius: Radius of the cut's sharp corners [mm].
        chord: Largest distance of a curve from its chords [mm].
    """

    inside: Point
    corner_radius: float
    chord: float


def unrolled(cut: NotchCut, outer_radius: float, path: Path) -> list[Point]:
    """Return the closed outline of a cut on the unrolled tube, about its own side at y = 0.

    Args:
        cut: The cut.
        outer_radius: Outer radius of the tube [mm].
        path: The path of the beam.

    Returns:
        Corners, counter-clockwise as x goes right and y goes up; the first is not repeated.

    Raises:
        InputError: The kerf or the radius does not fit the cut.
    """
    # In the plane of a radial cut, height is minus the arc length from the middle of the cut.
    corners = cut.corners
    if cut.radial:
        corners = [(x, -outer_radius * angle_at(height, outer_radius)) for x, height in corners]
    radii = [radius or path.corner_radius for radius in cut.radii]
    least, (low, high) = min(radii[1:-1]), sorted(path.inside)
    # An ellipse rolls round a corner whose radius is not below its own largest one.
    if least and high**2 > (least + _STRAIGHT) * low:
        raise InputError.OUT_OF_RANGE(
            f"corners have a radius of {least:.6g} mm, and the path of the beam runs {high:.6g} mm "
            "inside; give a smaller kerf or a larger radius."
        )
    half: list[Point] = []
    curves = pieces(corners, radii, path.inside)
    for piece in curves:
        half += _flattened(_on_surface(piece, cut.radial, outer_radius), path.chord)
    half.append(_surface_point(curves[-1].point(1.0), cut.radial, outer_radius))
    # `half` has positive y and goes toward the tip, which is clockwise.
    return _without_straight([*reversed(half), *((x, -y) for x, y in half)])


def _surface_point(point: Point, radial: bool, outer_radius: float) -> Point:
    """Return a point of the plane on the unrolled surface."""
    along, height = point
    return along, -height if radial else outer_radius * angle_at(height, outer_radius)


def _on_surface(piece: Line | Arc, radial: bool, outer_radius: float) -> Callable[[float], Point]:
    """Return a piece as a curve on the unrolled surface, from 0 to 1."""
    if radial or isinstance(piece, Arc):
        return lambda part: _surface_point(piece.point(part), radial, outer_radius)
    (x, low), (u, high) = piece
    first, last = (angle_at(height, outer_radius) for height in (low, high))
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


Points = NDArray[np.float64]


class Web(NamedTuple):
    """The thinnest material.

    Attributes:
        width: Its width on the outer surface [mm], before kerf.
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
                # Two closed lines that do not cross are nearest at a corner of one.
                width = min(_to_line(edge, moved), _to_line(moved, edge))
                width = 0.0 if _overlap(edge, moved) else width
                if width < best.width:
                    best = Web(width, (names[first], names[second]))
    return best


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


WEB_IN_KERFS = 3.0
"""A thinner web warns: the beam heats it from both sides."""

WEB_CHORD = 5e-4
"""Largest distance of a curve from its chords where webs are measured, in outer radii."""

_EPSILON = 1e-9  # mm; less than this beyond the seam is on it


@dataclass(frozen=True)
class PatternCut:
    """One cut of a pattern.

    Args:
        name: Number of its notch, with a letter where the notch has several cuts.
        placed: The cut on the robot.
        nominal: The edge of the cut, closed, counter-clockwise, [mm].
        outlines: What the beam follows: one closed outline, two where it is split at the seam.
    """

    name: str
    placed: PlacedCut
    nominal: Sequence[Point]
    outlines: Sequence[Sequence[Point]]

    @property
    def middle(self) -> Point:
        """The middle of its box, where its number is written."""
        xs, ys = zip(*self.outlines[0], strict=True)
        return 0.5 * (min(xs) + max(xs)), 0.5 * (min(ys) + max(ys))


@dataclass(frozen=True)
class FlatPattern:
    """The unrolled tube with its cuts.

    Args:
        robot: The robot.
        options: How it is drawn.
        tube: The tube that is cut, before polishing.
        cuts: The cuts in order, the one nearest the tip first.
        start: Where the tube is cut off [mm].
        end: Where it ends [mm].
        web: The thinnest web.
        warnings: Sentences about the pattern.
    """

    robot: Robot
    options: PatternOptions
    tube: Tube
    cuts: Sequence[PatternCut]
    start: float
    end: float
    web: Web
    warnings: tuple[str, ...]

    @property
    def seam(self) -> tuple[float, float]:
        """The two sides of the seam [mm]."""
        high = self.tube.outer_radius * math.radians(self.options.seam_deg)
        return high - self.around, high

    @property
    def around(self) -> float:
        """Circumference of the tube [mm]."""
        return math.tau * self.tube.outer_radius

    @property
    def y_factor(self) -> float:
        """What y is multiplied by when it is written: 1, or degrees for each mm."""
        return 360.0 / self.around if self.options.y_unit == "deg" else 1.0

    @property
    def facts(self) -> dict[str, Any]:
        """Numbers about the pattern."""
        return {
            "robot_hash": robot_digest(self.robot),
            "path_inside_edge_mm": list(self.options.inside),
            "polishing_mm": self.options.polishing,
            "stock_diameters_mm": [self.tube.outer_diameter, self.tube.inner_diameter],
            "cuts": len(self.cuts),
            "cut_order_notches": [one.placed.notch for one in self.cuts],
            "cut_length_mm": sum(_length(line) for one in self.cuts for line in one.outlines),
            "tip_mm": self.end,
            "cut_off_mm": self.start,
            "thinnest_web_mm": self.web.width,
            "thinnest_web_between": list(self.web.between),
        }


def flat_pattern(subject: Subject, options: PatternOptions) -> FlatPattern:
    """Unroll a robot.

    Raises:
        InputError: A kind of notch does not know its cuts, a cut is not for a two-axis machine,
            cuts meet, or kerf and radii do not fit.
    """
    robot = subject.robot
    tube, placed, start, end, warnings = cuts_of(robot, options.shank, options.polishing)
    if options.two_axis:
        _check_two_axis(placed)
    order = sorted(placed, key=lambda one: (-one.end, -one.start, one.cut.side_deg))
    radius = tube.outer_radius
    corner = max(options.corner_radius - options.polishing, 0.0)
    edge = Path((0.0, 0.0), corner, max(options.chord, WEB_CHORD * radius))
    beam = Path(options.inside, corner, options.chord)
    high = radius * math.radians(options.seam_deg)
    low = high - math.tau * radius
    cuts: list[PatternCut] = []
    names = _names(placed)
    for one in order:
        middle = high - (high - radius * math.radians(one.cut.side_deg)) % (high - low)
        with naming(one.name):
            nominal, path = (
                [(x, y + middle) for x, y in unrolled(one.cut, radius, way)] for way in (edge, beam)
            )
        outlines = _split(path, low, high) if options.seam == "split" else [path]
        cuts.append(PatternCut(names[one], one, nominal, outlines))
    edges = {f"cut of notch {one.name}": one.nominal for one in cuts}
    web = smallest_web(edges, math.tau * radius, start, end)
    if web.width <= _EPSILON:
        raise InputError.UNSUPPORTED(
            f"the {web.between[0]} and the {web.between[1]} meet: no material is left "
            "between them; give the notches a larger uncut_length or a smaller depth"
            f"{', or a larger shank' if 'cut-off' in ' '.join(web.between) else ''}."
        )
    warnings += _web_warnings(web, options)
    return FlatPattern(robot, options, tube, cuts, start, end, web, warnings)


def _names(cuts: Sequence[PlacedCut]) -> dict[PlacedCut, str]:
    """Return the numbers of the notches of cuts; the cuts of one notch have letters."""
    names: dict[PlacedCut, str] = {}
    for notch, group in groupby(cuts, key=lambda one: one.notch):
        same = tuple(group)
        letters = ascii_lowercase if len(same) > 1 else ("",)
        names |= {one: f"{notch}{letter}" for one, letter in zip(same, letters, strict=False)}
    return names


def _check_two_axis(cuts: Sequence[PlacedCut]) -> None:
    others = [one.notch for one in cuts if not one.cut.radial]
    if others:
        raise InputError.UNSUPPORTED(
            f"two-axis: notch {others[0]} has walls that do not point to the tube axis (a segment "
            "or a slot straight across the tube is left); a machine with a linear and a rotary "
            "axis cuts radial walls only, which would leave another section. Use a machine with "
            'an offset axis or a wire, or a notch with cut = "on-axis".'
        )


def _web_warnings(web: Web, options: PatternOptions) -> tuple[str, ...]:
    kerf = 2.0 * max(options.inside)
    if kerf == 0.0 or web.width >= WEB_IN_KERFS * kerf:
        return ()
    return (
        f"the web between the {web.between[0]} and the {web.between[1]} is {web.width:.4g} mm, "
        f"thinner than {WEB_IN_KERFS:g} kerfs ({WEB_IN_KERFS * kerf:.4g} mm); it may burn through "
        "or bend while it is cut.",
    )


def _split(points: Sequence[Point], low: float, high: float) -> list[list[Point]]:
    """Split a closed outline at the seam; the part beyond it comes in on the other side."""
    around = high - low
    whole = list(points)
    if all(low - _EPSILON <= y <= high + _EPSILON for _, y in whole):
        return [whole]
    inside = _clipped(_clipped(whole, low, 1.0), high, -1.0)
    above = [(x, y - around) for x, y in _clipped(whole, high, 1.0)]
    below = [(x, y + around) for x, y in _clipped(whole, low, -1.0)]
    return [part for part in (inside, above, below) if part]


def _clipped(points: Sequence[Point], level: float, side: float) -> list[Point]:
    """Return the part of a closed outline above a level of y (side 1) or below it (side -1)."""
    kept: list[Point] = []
    for (x, y), (u, v) in zip(points, [*points[1:], points[0]], strict=True):
        begin, end = side * (y - level), side * (v - level)
        if begin >= 0.0:
            kept.append((x, y))
        if begin * end < 0.0:
            part = begin / (begin - end)
            kept.append((x + part * (u - x), level))
    has_area = any(side * (y - level) > _EPSILON for _, y in kept)
    return kept if has_area else []


def _length(points: Sequence[Point]) -> float:
    return sum(map(math.dist, points, [*points[1:], points[0]]))
