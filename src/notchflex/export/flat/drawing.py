"""A pattern as layers of lines and texts, written as DXF and SVG."""

from __future__ import annotations

import io
import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Literal
from xml.sax.saxutils import escape, quoteattr

from notchflex import Robot, __version__
from notchflex.export.flat.pattern import FlatPattern, flat_pattern
from notchflex.export.formats import Document, PatternOptions, Subject
from notchflex.support import Point, robot_digest

if TYPE_CHECKING:
    from ezdxf.document import Drawing


Layer = Literal["CUT", "CUT_OFF", "REFERENCE", "TEXT"]

LAYERS: dict[Layer, str] = {
    "CUT": "closed paths of the beam, in the order of cutting",
    "CUT_OFF": "the last cut, round the tube",
    "REFERENCE": "not cut: tube, seam, sides of the tendons",
    "TEXT": "not cut: numbers of the notches, title block",
}
"""Layers and what is in them."""

_LETTER = 0.014
"""Height of the title block's letters, in lengths of the tube: its lines are as long as that."""
_NUMBER = 0.04
"""Height of the numbers of the notches, in circumferences."""
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
    size = max(_LETTER * (pattern.end - pattern.start), _SMALLEST)
    texts = [
        DrawnText(
            one.name,
            (one.middle[0], factor * one.middle[1]),
            _NUMBER * pattern.around,
            centred=True,
        )
        for one in pattern.cuts
    ]
    below = min(y for line in lines for _, y in line.points) - 2.0 * size
    for number, text in enumerate(title_lines(pattern)):
        texts.append(DrawnText(text, (pattern.start, below - 1.7 * size * number), size))
    return PatternDrawing(pattern, lines, texts)


def _cut_lines(pattern: FlatPattern) -> Iterator[DrawnLine]:
    for one in pattern.cuts:
        for outline in one.outlines:
            yield DrawnLine("CUT", outline, closed=True)
    yield DrawnLine("CUT_OFF", [(pattern.start, y) for y in pattern.seam])


def _reference_lines(pattern: FlatPattern) -> Iterator[DrawnLine]:
    """Draw the edges of the unrolled tube, and the side of every tendon."""
    low, high = pattern.seam
    start, end = pattern.start, pattern.end
    for y in (low, high):
        yield DrawnLine("REFERENCE", [(start, y), (end, y)])
    yield DrawnLine("REFERENCE", [(end, low), (end, high)])
    sides = {one.direction_deg % 360.0 for one in pattern.robot.tendon}
    for side in sorted(sides):
        y = pattern.tube.outer_radius * math.radians(side)
        y = high - (high - y) % pattern.around
        yield DrawnLine("REFERENCE", [(start, y), (end, y)])


def plain(text: str) -> str:
    """Return a text in one line, without characters that no file takes."""
    return " ".join("".join(letter if letter.isprintable() else " " for letter in text).split())


def plain_name(robot: Robot) -> str:
    """Return the name of a robot as `plain` text."""
    return plain(robot.name) or "robot"


def title_lines(pattern: FlatPattern) -> list[str]:
    """Return the lines of the title block, in plain ASCII where the robot's name is."""
    robot, options = pattern.robot, pattern.options
    lines = [
        plain_name(robot),
        *tube_lines(pattern),
        _kerf_line(pattern),
        *_wall_lines(pattern),
        "notches are numbered from the base; cut from the tip to the base, "
        f"{pattern.cuts[0].name} first, CUT_OFF last, at x = {pattern.start:.6g} mm",
        f"x: along the axis [mm], 0 at the base of the robot, tube end at {pattern.end:.9g} mm",
        _y_line(pattern),
        _seam_line(pattern),
    ]
    if options.corner_radius:
        lines.append(f"radius of the corners of the cuts: {options.corner_radius:.6g} mm")
    if any(notch.precurvature_deg for notch in robot.notches):
        lines.append("precurvature is not in this pattern: it is of the straight tube")
    lines.append(f"notchflex {__version__}, robot {robot_digest(robot)}")
    return lines


def tube_lines(pattern: FlatPattern) -> list[str]:
    """Name the tube to cut and, where polishing follows, the finished one."""
    polishing = pattern.options.polishing
    stock, finished = (
        f"outer diameter {tube.outer_diameter:.6g} mm, inner diameter {tube.inner_diameter:.6g} mm"
        for tube in (pattern.tube, pattern.robot.tube)
    )
    if not polishing:
        return [f"TUBE: {stock}"]
    return [
        f"STOCK TUBE, before polishing, as is the pattern: {stock}",
        f"FINISHED TUBE, after electropolishing removes {polishing:.6g} mm from every surface: "
        f"{finished}",
    ]


def _kerf_line(pattern: FlatPattern) -> str:
    along, around = pattern.options.inside
    if not along + around:
        return "KERF: NOT COMPENSATED - nominal edges of the cuts; compensate on the machine"
    kerf = f"{2.0 * along:.6g} mm"
    if along != around:
        kerf += f" along the tube and {2.0 * around:.6g} mm round it"
    return f"KERF: COMPENSATED - the path runs inside the edges by half the kerf of {kerf}"


def _wall_lines(pattern: FlatPattern) -> list[str]:
    """Say which cuts have radial walls, and which need an axis beside the tube axis."""
    radial, offset = (
        sorted({one.placed.notch for one in pattern.cuts if one.placed.cut.radial is kind})
        for kind in (True, False)
    )
    lines = []
    if radial:
        lines.append(
            f"notches {_ranges(radial)}: ON-AXIS, radial walls; a two-axis machine cuts them"
        )
    if offset:
        lines.append(
            f"notches {_ranges(offset)}: OFF-AXIS, walls straight across the tube; outer edges are "
            "drawn, a two-axis machine cannot cut them"
        )
    return lines


def _y_line(pattern: FlatPattern) -> str:
    if pattern.options.y_unit == "deg":
        what = "angle round the tube [deg]"
    else:
        what = f"outer radius {pattern.tube.outer_radius:.6g} mm x angle [mm]"
    return f"y: {what}, 0 at direction 0, positive counter-clockwise as seen from the tip"


def _seam_line(pattern: FlatPattern) -> str:
    options = pattern.options
    how = "outlines that cross it run past it"
    if options.seam == "split":
        how = "outlines that cross it are split; their edges on the seam lie in the waste"
    return f"seam at {options.seam_deg:.6g} deg: {how}"


def _ranges(numbers: list[int]) -> str:
    """Return numbers in order as text.

    Example:
        >>> _ranges([1, 2, 3, 7])
        '1-3, 7'
    """
    parts: list[list[int]] = []
    for number in numbers:
        if parts and number == parts[-1][-1] + 1:
            parts[-1].append(number)
        else:
            parts.append([number])
    return ", ".join(str(p[0]) if len(p) == 1 else f"{p[0]}-{p[-1]}" for p in parts)


_DXF_COLOURS = {"CUT": 1, "CUT_OFF": 5, "REFERENCE": 8, "TEXT": 7}  # 7 is black or white
_UNITS = {"mm": 4, "deg": 0}  # $INSUNITS: x in mm and y in degrees have no common unit


def dxf_pattern(subject: Subject, options: PatternOptions) -> Document:
    """Make the flat pattern of a robot as DXF.

    Lengths are in mm; with `y_unit="deg"` the y coordinates are degrees.

    Raises:
        InputError: See `flat_pattern`.
    """
    pattern = flat_pattern(subject, options)
    return Document(_content_of(pattern_drawing(pattern)), pattern.warnings, pattern.facts)


def _content_of(drawing: PatternDrawing) -> bytes:
    from ezdxf._options import options as ezdxf_options
    from ezdxf.document import Drawing
    from ezdxf.enums import TextEntityAlignment

    options = drawing.pattern.options
    # The same robot gives the same file: without times and random names.
    before = ezdxf_options.write_fixed_meta_data_for_testing
    ezdxf_options.write_fixed_meta_data_for_testing = True
    try:
        made = Drawing.new(options.dxf_version)  # `ezdxf.new` logs that R12 has no units
        if options.dxf_version != "R12":
            made.units = _UNITS[options.y_unit]
        _layers(made)
        space = made.modelspace()
        for line in drawing.lines:
            attributes = {"layer": line.layer}
            if options.dxf_version == "R12":
                space.add_polyline2d(line.points, close=line.closed, dxfattribs=attributes)
            else:
                space.add_lwpolyline(line.points, close=line.closed, dxfattribs=attributes)
        for one in drawing.texts:
            text = space.add_text(one.text, height=one.height, dxfattribs={"layer": "TEXT"})
            middle = TextEntityAlignment.MIDDLE_CENTER
            text.set_placement(one.place, align=middle if one.centred else None)
        (low, bottom), (high, top) = drawing.box
        made.header["$EXTMIN"], made.header["$EXTMAX"] = (low, bottom, 0.0), (high, top, 0.0)
        stream = io.StringIO()
        made.write(stream)
    finally:
        ezdxf_options.write_fixed_meta_data_for_testing = before
    # Old versions are in the code page of Windows; other letters are written as \\U+XXXX.
    return stream.getvalue().encode(made.output_encoding, errors="dxfreplace")


def _layers(drawing: Drawing) -> None:
    for name, text in LAYERS.items():
        layer = drawing.layers.add(name, color=_DXF_COLOURS[name])
        if drawing.dxfversion > "AC1009":  # R12 has no descriptions
            layer.description = text


_SVG_COLOURS = {"CUT": "#ff0000", "CUT_OFF": "#0000ff", "REFERENCE": "#808080", "TEXT": "#000000"}
_LINE = 0.02  # mm; width of a line
_MARGIN = 1.0  # mm


def svg_pattern(subject: Subject, options: PatternOptions) -> Document:
    """Make the flat pattern of a robot as SVG, with the layers of the DXF as groups.

    Raises:
        InputError: See `flat_pattern`.
    """
    pattern = flat_pattern(subject, options)
    return Document(_text_of(pattern_drawing(pattern)), pattern.warnings, pattern.facts)


def _text_of(drawing: PatternDrawing) -> str:
    (left, bottom), (right, top) = drawing.box
    wide, high = right - left + 2.0 * _MARGIN, top - bottom + 2.0 * _MARGIN
    # Degrees and mm have no common unit, so the drawing then has no size on paper.
    unit = "mm" if drawing.pattern.options.y_unit == "mm" else ""
    # y goes down in SVG: it is written as -y, so that the drawing looks like the DXF.
    head = (
        '<?xml version="1.0" encoding="UTF-8"?>\n'
        f'<svg xmlns="http://www.w3.org/2000/svg" width="{wide:.6g}{unit}" '
        f'height="{high:.6g}{unit}" '
        f'viewBox="{left - _MARGIN!r} {-top - _MARGIN!r} {wide!r} {high!r}">\n'
        f"<title>{escape(plain_name(drawing.pattern.robot))}: flat pattern</title>\n"
    )
    groups = [_group(drawing, layer) for layer in LAYERS]
    return head + "".join(groups) + "</svg>\n"


def _group(drawing: PatternDrawing, layer: str) -> str:
    colour = _SVG_COLOURS[layer]
    inside = [_path(line) for line in drawing.lines if line.layer == layer]
    if layer == "TEXT":
        attributes = f'fill="{colour}" font-family="sans-serif"'
        inside = [
            f'<text x="{one.place[0]!r}" y="{-one.place[1]!r}" font-size="{1.4 * one.height:.6g}"'
            + (' text-anchor="middle" dominant-baseline="central"' if one.centred else "")
            + f">{escape(one.text)}</text>"
            for one in drawing.texts
        ]
    else:
        attributes = f'fill="none" stroke="{colour}" stroke-width="{_LINE}"'
    about = quoteattr(LAYERS[layer])  # pyright: ignore[reportArgumentType]
    lines = "".join(f"  {one}\n" for one in inside)
    return f'<g id="{layer}" {attributes} data-content={about}>\n{lines}</g>\n'


def _path(line: DrawnLine) -> str:
    points = " L ".join(f"{x!r},{-y!r}" for x, y in line.points)
    return f'<path d="M {points}{" Z" if line.closed else ""}"/>'
