"""A flat pattern as DXF, by ezdxf: R2000, or R12 for old programs."""

from __future__ import annotations

import io
from typing import TYPE_CHECKING

from notchflex.export.document import FileDocument, Subject
from notchflex.export.flat.drawing import LAYERS, PatternDrawing, pattern_drawing
from notchflex.export.flat.pattern import flat_pattern
from notchflex.export.options import PatternOptions

if TYPE_CHECKING:
    from ezdxf.document import Drawing

_COLOURS = {"CUT": 1, "CUT_OFF": 5, "REFERENCE": 8, "TEXT": 7}  # red, blue, grey, black or white
_MM = 4  # $INSUNITS


def dxf_pattern(subject: Subject, options: PatternOptions) -> FileDocument:
    """Make the flat pattern of a robot as DXF.

    Lengths are in mm; with `y_unit="deg"` the y coordinates are degrees.

    Raises:
        InputError: See `flat_pattern`.
    """
    pattern = flat_pattern(subject, options)
    return FileDocument(_content_of(pattern_drawing(pattern)), pattern.warnings, pattern.facts)


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
            made.units = _MM
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
        layer = drawing.layers.add(name, color=_COLOURS[name])
        if drawing.dxfversion > "AC1009":  # R12 has no descriptions
            layer.description = text
