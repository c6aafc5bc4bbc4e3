"""The flat pattern of a robot: closed outlines in the order of cutting, and the webs between.

Kerf and corner radii belong to the plane that the beam is at right angles to: for a radial cut that
is the unrolled surface, for a beam beside the axis the plane of the cut's profile.

x runs along the tube from the base (0) toward the tip, y is the outer radius times the angle about
the tube axis, counted from direction 0 as `direction_deg` is.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import combinations_with_replacement
from typing import Any, NamedTuple

from shapely import LinearRing, Polygon, box, get_parts
from shapely.affinity import translate
from shapely.geometry.polygon import orient

from notchflex import InputError, Robot, Tube
from notchflex.export.cuts import PlacedCut, angle_at, check_one_tube, cuts_of, naming
from notchflex.export.formats import PatternOptions, Subject
from notchflex.support import Arc, Line, NotchCut, Point, pieces, robot_digest

Curve = Callable[[float], Point]

_DEEPEST = 14
"""Halvings of a piece at most: 16384 chords."""
_STRAIGHT = 1e-12
"""A point nearer than this to the line of its neighbours is left out [mm]."""
_EPSILON = 1e-9
"""What lies less than this beyond the seam is on it; a thinner web is none [mm]."""
_WEB_CHORD = 5e-4
"""Largest distance of a curve from its chords where webs are measured, in outer radii."""
_WEB_IN_KERFS = 3.0
"""A thinner web warns: the beam heats it from both sides."""


def unrolled(
    cut: NotchCut, radius: float, inside: Point, corner_radius: float, chord: float
) -> list[Point]:
    """Return the closed outline of a cut on the unrolled tube, about its own side at y = 0.

    Args:
        cut: The cut.
        radius: Outer radius of the tube [mm].
        inside: Distance of the path of the beam from the edge, into the waste: along the tube and
            round it [mm].
        corner_radius: Radius of the cut's sharp corners [mm].
        chord: Largest distance of a curve from its chords [mm].

    Returns:
        Corners, counter-clockwise as x goes right and y goes up; the first is not repeated.

    Raises:
        InputError: The kerf or the radius does not fit the cut.
    """
    # In the plane of a radial cut, height is minus the arc length from the middle of the cut.
    corners = cut.corners
    if cut.radial:
        corners = [(x, -radius * angle_at(height, radius)) for x, height in corners]
    radii = [corner or corner_radius for corner in cut.radii]
    least, (low, high) = min(radii[1:-1]), sorted(inside)
    # An ellipse rolls round a corner whose radius is not below its own largest one.
    if least and high**2 > (least + _STRAIGHT) * low:
        raise InputError.OUT_OF_RANGE(
            f"corners have a radius of {least:.6g} mm, and the path of the beam runs {high:.6g} mm "
            "inside; give a smaller kerf or a larger radius."
        )
    curves = [_on_surface(piece, cut.radial, radius) for piece in pieces(corners, radii, inside)]
    half = [point for curve in curves for point in _flattened(curve, chord)] + [curves[-1](1.0)]
    # `half` has positive y and goes toward the tip, which is clockwise.
    whole = LinearRing([*reversed(half), *((x, -y) for x, y in half)])
    corners = whole.simplify(_STRAIGHT, preserve_topology=False).coords[:-1]
    return [(x, y) for x, y in corners]


def _on_surface(piece: Line | Arc, radial: bool, radius: float) -> Curve:
    """Return a piece as a curve on the unrolled surface, from 0 to 1."""

    def in_plane(part: float) -> Point:
        along, height = piece.point(part)
        return along, -height if radial else radius * angle_at(height, radius)

    if radial or isinstance(piece, Arc) or abs(piece.end[1] - piece.start[1]) < _STRAIGHT:
        return in_plane
    (x, low), (u, high) = piece

    def even(part: float) -> Point:
        # Even steps of the angle: a curve that meets the surface is smooth in it.
        angle = (1.0 - part) * angle_at(low, radius) + part * angle_at(high, radius)
        along = (radius * math.cos(angle) - low) / (high - low) if 0.0 < part < 1.0 else part
        return (1.0 - along) * x + along * u, radius * angle

    return even


def _flattened(
    curve: Curve, chord: float, low: float = 0.0, high: float = 1.0, depth: int = 0
) -> Iterator[Point]:
    """Yield points of a curve from its start up to before its end."""
    start, end = curve(low), curve(high)
    parts = (low + part * (high - low) for part in (0.25, 0.5, 0.75))
    if max(_distance(curve(part), start, end) for part in parts) <= chord:
        yield start
        return
    if depth == _DEEPEST:
        raise InputError.OUT_OF_RANGE(
            f"chord: with {chord:g} mm a curve of this pattern needs more than "
            f"{2**_DEEPEST} points; give a larger chord."
        )
    middle = 0.5 * (low + high)
    yield from _flattened(curve, chord, low, middle, depth + 1)
    yield from _flattened(curve, chord, middle, high, depth + 1)


def _distance(point: Point, start: Point, end: Point) -> float:
    """Return the distance of a point from a line through two others."""
    length = math.dist(start, end)
    if length == 0.0:
        return math.dist(point, start)
    (x, y), (u, v) = start, end
    return abs((u - x) * (point[1] - y) - (v - y) * (point[0] - x)) / length


class Web(NamedTuple):
    """The thinnest material.

    Attributes:
        width: Its width on the outer surface [mm], before kerf.
        between: What lies on its two sides.
    """

    width: float
    between: tuple[str, str]


def smallest_web(
    edges: Mapping[str, Sequence[Point]], around: float, start: float, end: float
) -> Web:
    """Find the thinnest web of a pattern.

    Args:
        edges: Closed edges of the cuts by their names.
        around: Circumference [mm].
        start: Where the tube is cut off [mm].
        end: Where it ends at the tip [mm].
    """
    cuts = {name: Polygon(edge) for name, edge in edges.items()}
    webs = [Web(cut.bounds[0] - start, (name, "cut-off")) for name, cut in cuts.items()]
    webs += [Web(end - cut.bounds[2], (name, "tip")) for name, cut in cuts.items()]
    best = min(webs, key=lambda web: web.width)
    for (name, cut), (second, neighbour) in combinations_with_replacement(cuts.items(), 2):
        if cut.bounds[0] - neighbour.bounds[2] >= best.width:
            continue  # they lie farther apart along the tube
        for turn in (1,) if name == second else (-1, 0, 1):
            width = cut.distance(translate(neighbour, yoff=turn * around))
            best = min(best, Web(width, (name, second)), key=lambda web: web.width)
    return best


@dataclass(frozen=True)
class PatternCut:
    """One cut of a pattern.

    Args:
        placed: The cut on the robot.
        nominal: The edge of the cut, closed, counter-clockwise, [mm].
        outlines: What the beam follows: one closed outline, two where it is split at the seam.
    """

    placed: PlacedCut
    nominal: Sequence[Point]
    outlines: Sequence[Sequence[Point]]

    @property
    def middle(self) -> Point:
        """The middle of its box, where its number is written."""
        left, low, right, high = LinearRing(self.outlines[0]).bounds
        return 0.5 * (left + right), 0.5 * (low + high)


@dataclass(frozen=True)
class FlatPattern:
    """The unrolled tube with its cuts.

    Args:
        robot: The robot.
        options: How it is drawn.
        tube: The tube that is cut, before polishing.
        start: Where the tube is cut off [mm].
        end: Where it ends [mm].
        cuts: The cuts in order, the one nearest the tip first.
        web: The thinnest web.
        warnings: Sentences about the pattern.
    """

    robot: Robot
    options: PatternOptions
    tube: Tube
    start: float
    end: float
    cuts: Sequence[PatternCut]
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
    def facts(self) -> dict[str, Any]:
        """Numbers about the pattern."""
        lines = [outline for cut in self.cuts for outline in cut.outlines]
        return {
            "robot_hash": robot_digest(self.robot),
            "path_inside_edge_mm": list(self.options.inside),
            "polishing_mm": self.options.polishing,
            "stock_diameters_mm": [self.tube.outer_diameter, self.tube.inner_diameter],
            "cuts": len(self.cuts),
            "cut_order_notches": [cut.placed.notch for cut in self.cuts],
            "cut_length_mm": sum(LinearRing(line).length for line in lines),
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
    check_one_tube(robot)
    made = cuts_of(robot, options.shank, options.polishing)
    tube, placed, start, end, warnings = made[:5]
    if made.rings:
        raise InputError.UNSUPPORTED(
            "a robot of disks on a backbone is not cut from a tube, so it has no flat pattern; "
            "export a solid, --stl or --step."
        )
    if options.two_axis:
        _check_two_axis(placed)
    radius, corner = tube.outer_radius, max(options.corner_radius - options.polishing, 0.0)
    high = radius * math.radians(options.seam_deg)
    around = math.tau * radius
    cuts: list[PatternCut] = []
    for cut in sorted(placed, key=lambda cut: (-cut.end, -cut.start, cut.cut.side_deg)):
        middle = high - (high - radius * math.radians(cut.cut.side_deg)) % around
        ways = (
            ((0.0, 0.0), max(options.chord, _WEB_CHORD * radius)),
            (options.inside, options.chord),
        )
        with naming(f"the cut of notch {cut.notch}"):
            nominal, path = (
                [(x, y + middle) for x, y in unrolled(cut.cut, radius, inside, corner, chord)]
                for inside, chord in ways
            )
        outlines = _split(path, high - around, high) if options.seam == "split" else [path]
        cuts.append(PatternCut(cut, nominal, outlines))
    edges = {f"cut of notch {cut.placed.name}": cut.nominal for cut in cuts}
    web = smallest_web(edges, around, start, end)
    warnings += _web_warnings(web, options)
    return FlatPattern(robot, options, tube, start, end, cuts, web, warnings)


def _check_two_axis(cuts: Sequence[PlacedCut]) -> None:
    for placed in cuts:
        if not placed.cut.radial:
            raise InputError.UNSUPPORTED(
                f"two-axis: notch {placed.notch} has walls that do not point to the tube axis (a "
                "segment or a slot straight across the tube is left); a machine with a linear and "
                "a rotary axis cuts radial walls only, which would leave another section. Use a "
                'machine with an offset axis or a wire, or a notch with cut = "on-axis".'
            )


def _web_warnings(web: Web, options: PatternOptions) -> tuple[str, ...]:
    """Warn of a thin web.

    Raises:
        InputError: There is none.
    """
    first, second = web.between
    if web.width <= _EPSILON:
        raise InputError.UNSUPPORTED(
            f"the {first} and the {second} meet: no material is left "
            "between them; give the notches a larger uncut_length or a smaller depth"
            f"{', or a larger shank' if second == 'cut-off' else ''}."
        )
    least = _WEB_IN_KERFS * 2.0 * max(options.inside)
    if web.width >= least:
        return ()
    return (
        f"the web between the {first} and the {second} is {web.width:.4g} mm, "
        f"thinner than {_WEB_IN_KERFS:g} kerfs ({least:.4g} mm); it may burn through "
        "or bend while it is cut.",
    )


def _split(whole: Sequence[Point], low: float, high: float) -> list[Sequence[Point]]:
    """Split a closed outline at the seam; the part beyond it comes in on the other side."""
    if all(low - _EPSILON <= y <= high + _EPSILON for _, y in whole):
        return [whole]
    outline = Polygon(whole)
    start, _, end, _ = outline.bounds
    tube = box(start - 1.0, low, end + 1.0, high)
    turned = (translate(outline, yoff=turn * (high - low)) for turn in (0, -1, 1))
    parts = [part for outline in turned for part in get_parts(outline & tube)]
    rings = (orient(part).exterior.coords[:-1] for part in parts if part.area > _EPSILON)
    return [[(x, y) for x, y in ring] for ring in rings]
