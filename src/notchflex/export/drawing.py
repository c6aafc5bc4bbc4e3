"""A pattern as layers of lines and texts, written as DXF and SVG."""

from __future__ import annotations

import io
import math
from collections.abc import Sequence
from typing import Any, NamedTuple
from xml.sax.saxutils import escape

from shapely import MultiPoint

from notchflex import __version__
from notchflex.export.formats import Document, PatternOptions, Subject, plain_name
from notchflex.export.pattern import FlatPattern, flat_pattern
from notchflex.support import Point, robot_digest


class Layer(NamedTuple):
    """What is in a layer, and its colours in DXF and SVG."""

    content: str
    number: int
    colour: str


LAYERS = {
    "CUT": Layer("closed paths of the beam, in the order of cutting", 1, "#ff0000"),
    "CUT_OFF": Layer("the last cut, round the tube", 5, "#0000ff"),
    "REFERENCE": Layer("not cut: tube, seam, sides of the tendons", 8, "#808080"),
    "TEXT": Layer("not cut: numbers of the notches, title block", 7, "#000000"),
}

_LETTER = 0.014
"""Height of the title block's letters, in lengths of the tube: its lines are as long as that."""
_NUMBER = 0.04
"""Height of the numbers of the notches, in circumferences."""
_SMALLEST = 0.1  # mm


class DrawnLine(NamedTuple):
    """A line of a layer [as written]."""

    layer: str
    points: Sequence[Point]
    closed: bool = False


class DrawnText(NamedTuple):
    """A text: its lower left corner or its middle, and the height of a letter."""

    text: str
    place: Point
    height: float
    centred: bool = False


def pattern_drawing(pattern: FlatPattern) -> tuple[list[DrawnLine], list[DrawnText]]:
    """Lay a pattern out in file units: lines in the order of cutting; numbers, title below."""
    (low, high), start, end = pattern.seam, pattern.start, pattern.end
    lines = [
        DrawnLine("CUT", outline, closed=True) for cut in pattern.cuts for outline in cut.outlines
    ]
    lines.append(DrawnLine("CUT_OFF", [(start, low), (start, high)]))
    sides = sorted({tendon.direction_deg % 360.0 for tendon in pattern.robot.tendon})
    sides = [pattern.tube.outer_radius * math.radians(side) for side in sides]
    tendons = [high - (high - side) % pattern.around for side in sides]
    edges = [[(start, low), (end, low)], [(start, high), (end, high)], [(end, low), (end, high)]]
    edges += [[(start, y), (end, y)] for y in tendons]
    lines += [DrawnLine("REFERENCE", edge) for edge in edges]
    factor = 360.0 / pattern.around if pattern.options.y_unit == "deg" else 1.0

    def scaled(points: Sequence[Point]) -> list[Point]:
        return [(x, factor * y) for x, y in points]

    lines = [line._replace(points=scaled(line.points)) for line in lines]
    texts = [
        DrawnText(cut.placed.name, scaled([cut.middle])[0], _NUMBER * pattern.around, centred=True)
        for cut in pattern.cuts
    ]
    size = max(_LETTER * (end - start), _SMALLEST)
    below = min(y for line in lines for _, y in line.points) - 2.0 * size
    for number, text in enumerate(title_lines(pattern)):
        texts.append(DrawnText(text, (start, below - 1.7 * size * number), size))
    return lines, texts


def _box(lines: Sequence[DrawnLine], texts: Sequence[DrawnText]) -> tuple[float, ...]:
    """Return left, lower, right and upper end of lines and texts."""
    points = [point for line in lines for point in line.points]
    for text, (x, y), height, centred in texts:
        points += [(x, y), (x + (0.0 if centred else 0.75 * height * len(text)), y + height)]
    return MultiPoint(points).bounds


def title_lines(pattern: FlatPattern) -> list[str]:
    """Return the lines of the title block, in plain ASCII where the robot's name is."""
    robot, options, tube = pattern.robot, pattern.options, pattern.tube
    stock, finished = (
        f"outer diameter {tube.outer_diameter:.6g} mm, inner diameter {tube.inner_diameter:.6g} mm"
        for tube in (tube, robot.tube)
    )
    lines = [plain_name(robot), f"TUBE: {stock}"]
    if options.polishing:
        lines[1:] = [
            f"STOCK TUBE, before polishing, as is the pattern: {stock}",
            f"FINISHED TUBE, after electropolishing removes {options.polishing:.6g} mm from every "
            f"surface: {finished}",
        ]
    along, around = (f"{2.0 * inside:.6g} mm" for inside in options.inside)
    kerf = along if along == around else f"{along} along the tube and {around} round it"
    lines.append(
        f"KERF: COMPENSATED - the path runs inside the edges by half the kerf of {kerf}"
        if any(options.inside)
        else "KERF: NOT COMPENSATED - nominal edges of the cuts; compensate on the machine"
    )
    for radial, walls in (
        (True, "ON-AXIS, radial walls; a two-axis machine cuts them"),
        (False, "OFF-AXIS, walls straight across the tube; outer edges are drawn, a two-axis "
                "machine cannot cut them"),
    ):  # fmt: skip
        cuts = {cut.placed.notch for cut in pattern.cuts if cut.placed.cut.radial is radial}
        if cuts:
            lines.append(f"notches {_ranges(sorted(cuts))}: {walls}")
    turned = f"outer radius {tube.outer_radius:.6g} mm x angle [mm]"
    what = turned if options.y_unit == "mm" else "angle round the tube [deg]"
    split = "outlines that cross it are split; their edges on the seam lie in the waste"
    how = split if options.seam == "split" else "outlines that cross it run past it"
    lines += [
        "notches are numbered from the base; cut from the tip to the base, "
        f"{pattern.cuts[0].placed.name} first, CUT_OFF last, at x = {pattern.start:.6g} mm",
        f"x: along the axis [mm], 0 at the base of the robot, tube end at {pattern.end:.9g} mm",
        f"y: {what}, 0 at direction 0, positive counter-clockwise as seen from the tip",
        f"seam at {options.seam_deg:.6g} deg: {how}",
    ]
    if options.corner_radius:
        lines.append(f"radius of the corners of the cuts: {options.corner_radius:.6g} mm")
    if any(notch.precurvature_deg for notch in robot.notches):
        lines.append("precurvature is not in this pattern: it is of the straight tube")
    return [*lines, f"notchflex {__version__}, robot {robot_digest(robot)}"]


def _ranges(numbers: Sequence[int]) -> str:
    """Return numbers in order as text.

    Example:
        >>> _ranges([1, 2, 3, 7])
        '1-3, 7'
    """
    firsts = [number for number in numbers if number - 1 not in numbers]
    lasts = [number for number in numbers if number + 1 not in numbers]
    ends = zip(firsts, lasts, strict=True)
    return ", ".join(f"{first}" if first == last else f"{first}-{last}" for first, last in ends)


_UNITS = {"mm": 4, "deg": 0}  # $INSUNITS: x in mm and y in degrees have no common unit


def dxf_pattern(subject: Subject, options: PatternOptions) -> Document:
    """Make the flat pattern of a robot as DXF.

    Lengths are in mm; with `y_unit="deg"` the y coordinates are degrees.

    Raises:
        InputError: See `flat_pattern`.
    """
    pattern = flat_pattern(subject, options)
    content = _dxf(*pattern_drawing(pattern), options)
    return Document(content, pattern.warnings, pattern.facts)


def _dxf(lines: Sequence[DrawnLine], texts: Sequence[DrawnText], options: PatternOptions) -> bytes:
    from ezdxf._options import options as ezdxf_options
    from ezdxf.document import Drawing
    from ezdxf.enums import TextEntityAlignment

    # The same robot gives the same file: without times and random names.
    before = ezdxf_options.write_fixed_meta_data_for_testing
    ezdxf_options.write_fixed_meta_data_for_testing = True
    try:
        made = Drawing.new(options.dxf_version)  # `ezdxf.new` logs that R12 has no units
        space, is_old = made.modelspace(), options.dxf_version == "R12"
        add_line: Any = space.add_polyline2d if is_old else space.add_lwpolyline
        for name, content in LAYERS.items():
            layer = made.layers.add(name, color=content.number)
            if not is_old:  # R12 has neither units nor descriptions
                made.units, layer.description = _UNITS[options.y_unit], content.content
        for line in lines:
            add_line(line.points, close=line.closed, dxfattribs={"layer": line.layer})
        for content, place, height, centred in texts:
            text = space.add_text(content, height=height, dxfattribs={"layer": "TEXT"})
            middle = TextEntityAlignment.MIDDLE_CENTER
            text.set_placement(place, align=middle if centred else None)
        left, low, right, high = _box(lines, texts)
        made.header["$EXTMIN"], made.header["$EXTMAX"] = (left, low, 0.0), (right, high, 0.0)
        stream = io.StringIO()
        made.write(stream)
    finally:
        ezdxf_options.write_fixed_meta_data_for_testing = before
    # Old versions are in the code page of Windows; other letters are written as \\U+XXXX.
    return stream.getvalue().encode(made.output_encoding, errors="dxfreplace")


_LINE = 0.02  # mm; width of a line
_MARGIN = 1.0  # mm


def svg_pattern(subject: Subject, options: PatternOptions) -> Document:
    """Make the flat pattern of a robot as SVG, with the layers of the DXF as groups.

    Raises:
        InputError: See `flat_pattern`.
    """
    pattern = flat_pattern(subject, options)
    lines, texts = pattern_drawing(pattern)
    left, low, right, top = _box(lines, texts)
    wide, high = right - left + 2.0 * _MARGIN, top - low + 2.0 * _MARGIN
    # Degrees and mm have no common unit, so the drawing then has no size on paper.
    unit = "mm" if options.y_unit == "mm" else ""
    # y goes down in SVG: it is written as -y, so that the drawing looks like the DXF.
    svg = (
        '<?xml version="1.0" encoding="UTF-8"?>\n'
        f'<svg xmlns="http://www.w3.org/2000/svg" width="{wide:.6g}{unit}" '
        f'height="{high:.6g}{unit}" '
        f'viewBox="{left - _MARGIN!r} {-top - _MARGIN!r} {wide!r} {high!r}">\n'
        f"<title>{escape(plain_name(pattern.robot))}: flat pattern</title>\n"
    )
    for name, layer in LAYERS.items():
        style = f'fill="none" stroke="{layer.colour}" stroke-width="{_LINE}"'
        items = [_svg_line(line) for line in lines if line.layer == name]
        if name == "TEXT":
            style = f'fill="{layer.colour}" font-family="sans-serif"'
            items = [_svg_text(text) for text in texts]
        svg += f'<g id="{name}" {style} data-content="{layer.content}">\n'
        svg += "".join(f"  {item}\n" for item in items) + "</g>\n"
    return Document(svg + "</svg>\n", pattern.warnings, pattern.facts)


def _svg_line(line: DrawnLine) -> str:
    points = " L ".join(f"{x!r},{-y!r}" for x, y in line.points)
    return f'<path d="M {points}{" Z" if line.closed else ""}"/>'


def _svg_text(text: DrawnText) -> str:
    words, (x, y), height, centred = text
    middle = ' text-anchor="middle" dominant-baseline="central"' if centred else ""
    size = f'font-size="{1.4 * height:.6g}"{middle}'
    return f'<text x="{x!r}" y="{-y!r}" {size}>{escape(words)}</text>'
