"""A pattern as layers of lines and texts, that DXF and SVG both write."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Literal

from notchflex.export.flat.pattern import FlatPattern
from notchflex.export.flat.title import title_lines
from notchflex.robot.notches.cut import Point

Layer = Literal["CUT", "CUT_OFF", "REFERENCE", "TEXT"]

LAYERS: dict[Layer, str] = {
    "CUT": "closed paths of the beam, in the order of cutting",
    "CUT_OFF": "the last cut, round the tube",
    "REFERENCE": "not cut: tube, seam, sides of the tendons",
    "TEXT": "not cut: numbers of the cuts, title block",
}
"""Layers and what is in them."""

_LETTER = 0.014
"""Height of the title block's letters, in lengths of the tube: its lines are as long as that."""
_NUMBER = 0.04
"""Height of the numbers of the cuts, in circumferences."""
_SMALLEST = 0.1  # mm


@dataclass(frozen=True)
class DrawnLine:
    """A line of a layer [as written]."""

    layer: Layer
    points: Sequence[Point]
    closed: bool = False


@dataclass(frozen=True)
class DrawnText:
    """A text of a layer: its lower left corner or its middle, and the height of a letter."""

    text: str
    place: Point
    height: float
    centred: bool = False


@dataclass(frozen=True)
class PatternDrawing:
    """Everything that is written of a pattern, in file units."""

    pattern: FlatPattern
    lines: Sequence[DrawnLine]
    texts: Sequence[DrawnText]

    @property
    def box(self) -> tuple[Point, Point]:
        """Lower left and upper right corner of lines and texts."""
        xs = [x for line in self.lines for x, _ in line.points]
        ys = [y for line in self.lines for _, y in line.points]
        for one in self.texts:
            wide = 0.0 if one.centred else 0.75 * one.height * len(one.text)
            xs += [one.place[0], one.place[0] + wide]
            ys += [one.place[1], one.place[1] + one.height]
        return (min(xs), min(ys)), (max(xs), max(ys))


def pattern_drawing(pattern: FlatPattern) -> PatternDrawing:
    """Lay a pattern out: lines in the order of cutting, numbers, title block below."""
    factor = pattern.y_factor
    lines = [*_cut_lines(pattern), *_reference_lines(pattern)]
    lines = [
        DrawnLine(one.layer, [(x, factor * y) for x, y in one.points], one.closed) for one in lines
    ]
    size = max(_LETTER * (pattern.end + pattern.options.shank), _SMALLEST)
    texts = [
        DrawnText(
            str(one.number),
            (one.middle[0], factor * one.middle[1]),
            _NUMBER * pattern.around,
            centred=True,
        )
        for one in pattern.cuts
    ]
    below = min(y for line in lines for _, y in line.points) - 2.0 * size
    for number, text in enumerate(title_lines(pattern)):
        texts.append(DrawnText(text, (-pattern.options.shank, below - 1.7 * size * number), size))
    return PatternDrawing(pattern, lines, texts)


def _cut_lines(pattern: FlatPattern) -> Iterator[DrawnLine]:
    for one in pattern.cuts:
        for outline in one.outlines:
            yield DrawnLine("CUT", outline, closed=True)
    at = -pattern.options.shank
    yield DrawnLine("CUT_OFF", [(at, y) for y in pattern.seam])


def _reference_lines(pattern: FlatPattern) -> Iterator[DrawnLine]:
    """Draw the edges of the unrolled tube, and the side of every tendon."""
    low, high = pattern.seam
    start, end = -pattern.options.shank, pattern.end
    for y in (low, high):
        yield DrawnLine("REFERENCE", [(start, y), (end, y)])
    yield DrawnLine("REFERENCE", [(end, low), (end, high)])
    sides = {one.direction_deg % 360.0 for one in pattern.robot.tendon}
    for side in sorted(sides):
        y = pattern.robot.tube.outer_radius * math.radians(side)
        y = high - (high - y) % pattern.around
        yield DrawnLine("REFERENCE", [(start, y), (end, y)])
