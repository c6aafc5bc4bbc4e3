"""A flat pattern as SVG at full size: 1 user unit is 1 mm, one group a layer."""

from __future__ import annotations

from xml.sax.saxutils import escape, quoteattr

from notchflex.export.document import FileDocument, Subject
from notchflex.export.flat.drawing import LAYERS, DrawnLine, PatternDrawing, pattern_drawing
from notchflex.export.flat.pattern import flat_pattern
from notchflex.export.flat.title import plain_name
from notchflex.export.options import PatternOptions

_COLOURS = {"CUT": "#ff0000", "CUT_OFF": "#0000ff", "REFERENCE": "#808080", "TEXT": "#000000"}
_LINE = 0.02  # mm; width of a line
_MARGIN = 1.0  # mm


def svg_pattern(subject: Subject, options: PatternOptions) -> FileDocument:
    """Make the flat pattern of a robot as SVG, with the layers of the DXF as groups.

    Raises:
        InputError: See `flat_pattern`.
    """
    pattern = flat_pattern(subject, options)
    return FileDocument(_text_of(pattern_drawing(pattern)), pattern.warnings, pattern.facts)


def _text_of(drawing: PatternDrawing) -> str:
    (left, bottom), (right, top) = drawing.box
    wide, high = right - left + 2.0 * _MARGIN, top - bottom + 2.0 * _MARGIN
    # y goes down in SVG: it is written as -y, so that the drawing looks like the DXF.
    head = (
        '<?xml version="1.0" encoding="UTF-8"?>\n'
        f'<svg xmlns="http://www.w3.org/2000/svg" width="{wide:.6g}mm" height="{high:.6g}mm" '
        f'viewBox="{left - _MARGIN!r} {-top - _MARGIN!r} {wide!r} {high!r}">\n'
        f"<title>{escape(plain_name(drawing.pattern.robot))}: flat pattern</title>\n"
    )
    groups = [_group(drawing, layer) for layer in LAYERS]
    return head + "".join(groups) + "</svg>\n"


def _group(drawing: PatternDrawing, layer: str) -> str:
    colour = _COLOURS[layer]
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
