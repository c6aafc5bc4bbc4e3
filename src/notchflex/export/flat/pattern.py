"""The flat pattern of a robot: closed outlines in the order of cutting, and what is drawn beside.

x runs along the tube from the base (0) toward the tip, y is the outer radius times the angle about
the tube axis, counted from direction 0 as `direction_deg` is.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

from notchflex.errors import InputError
from notchflex.export.cuts import PlacedCut, cuts_of
from notchflex.export.document import Subject
from notchflex.export.flat.unroll import Path, unrolled
from notchflex.export.flat.webs import Web, smallest_web
from notchflex.export.options import PatternOptions
from notchflex.export.tube_ends import tube_end
from notchflex.results.same_robot import robot_digest
from notchflex.robot import Robot
from notchflex.robot.notches.cut import Point

WEB_IN_KERFS = 3.0
"""A thinner web warns: the beam heats it from both sides."""

WEB_CHORD = 5e-4
"""Largest distance of a curve from its chords where webs are measured, in outer radii."""

_EPSILON = 1e-9  # mm; less than this beyond the seam is on it


@dataclass(frozen=True)
class PatternCut:
    """One cut of a pattern.

    Args:
        number: Its place in the order of cutting, from 1 at the tip.
        placed: The cut on the robot.
        nominal: The edge of the cut, closed, counter-clockwise, [mm].
        outlines: What the beam follows: one closed outline, two where it is split at the seam.
    """

    number: int
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
        cuts: The cuts in order, the one nearest the tip first.
        end: Where the tube ends [mm].
        web: The thinnest web.
        warnings: Sentences about the pattern.
    """

    robot: Robot
    options: PatternOptions
    cuts: Sequence[PatternCut]
    end: float
    web: Web
    warnings: tuple[str, ...]

    @property
    def seam(self) -> tuple[float, float]:
        """The two sides of the seam [mm]."""
        high = self.robot.tube.outer_radius * math.radians(self.options.seam_deg)
        return high - self.around, high

    @property
    def around(self) -> float:
        """Circumference of the tube [mm]."""
        return math.tau * self.robot.tube.outer_radius

    @property
    def y_factor(self) -> float:
        """What y is multiplied by when it is written: 1, or degrees for each mm."""
        return 360.0 / self.around if self.options.y_unit == "deg" else 1.0

    @property
    def facts(self) -> dict[str, Any]:
        """Numbers about the pattern."""
        return {
            "robot_hash": robot_digest(self.robot),
            "kerf_mm": self.options.kerf,
            "path_inside_edge_mm": self.options.inside,
            "cuts": len(self.cuts),
            "cut_order_notches": [one.placed.notch for one in self.cuts],
            "cut_length_mm": sum(_length(line) for one in self.cuts for line in one.outlines),
            "tip_mm": self.end,
            "cut_off_mm": -self.options.shank,
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
    found = cuts_of(robot)
    if options.two_axis:
        _check_two_axis(found.cuts)
    end = tube_end(robot, found)
    order = sorted(found.cuts, key=lambda one: (-one.end, -one.start, one.cut.side_deg))
    radius = robot.tube.outer_radius
    edge = Path(0.0, options.corner_radius, max(options.chord, WEB_CHORD * radius))
    beam = Path(options.inside, options.corner_radius, options.chord)
    high = radius * math.radians(options.seam_deg)
    low = high - math.tau * radius
    cuts: list[PatternCut] = []
    for number, one in enumerate(order, start=1):
        name = f"the cut of notch {one.notch}"
        middle = high - (high - radius * math.radians(one.cut.side_deg)) % (high - low)
        nominal, path = (
            [(x, y + middle) for x, y in unrolled(one.cut, radius, way, name)]
            for way in (edge, beam)
        )
        outlines = _split(path, low, high) if options.seam == "split" else [path]
        cuts.append(PatternCut(number, one, nominal, outlines))
    edges = {f"cut {one.number} of notch {one.placed.notch}": one.nominal for one in cuts}
    web = smallest_web(edges, math.tau * radius, -options.shank, end.at)
    if web.width <= _EPSILON:
        raise InputError.UNSUPPORTED(
            f"the {web.between[0]} and the {web.between[1]} meet: no material is left "
            "between them; give the notches a larger uncut_length or a smaller depth"
            f"{', or a larger shank' if 'cut-off' in ' '.join(web.between) else ''}."
        )
    warnings = [end.warning] if end.warning else []
    return FlatPattern(robot, options, cuts, end.at, web, (*warnings, *_web_warnings(web, options)))


def _check_two_axis(cuts: Sequence[PlacedCut]) -> None:
    others = [one.notch for one in cuts if not one.cut.radial]
    if others:
        raise InputError.UNSUPPORTED(
            f"two-axis: notch {others[0]} has walls that do not point to the tube axis (a segment "
            "or a slot straight across the tube is left); a machine with a linear and a rotary "
            "axis cuts radial walls only, which would leave another section. Use a machine with "
            'an offset axis or a wire, or a notch with cut = "on-axis".'
        )


def _web_warnings(web: Web, options: PatternOptions) -> list[str]:
    kerf = options.kerf
    if kerf == 0.0 or web.width >= WEB_IN_KERFS * kerf:
        return []
    return [
        f"the web between the {web.between[0]} and the {web.between[1]} is {web.width:.4g} mm, "
        f"thinner than {WEB_IN_KERFS:g} kerfs ({WEB_IN_KERFS * kerf:.4g} mm); it may burn through "
        "or bend while it is cut."
    ]


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
