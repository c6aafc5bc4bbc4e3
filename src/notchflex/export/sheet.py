"""The sheet for the shop and for incoming inspection: pattern, table of cuts, dimensions (PDF)."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Sequence
from pathlib import Path
from textwrap import wrap
from typing import TYPE_CHECKING, Any

from matplotlib.patches import Rectangle

from notchflex import __version__
from notchflex.export.drawing import pattern_drawing, title_lines
from notchflex.export.formats import Document, PatternOptions, Subject, plain
from notchflex.export.pattern import FlatPattern, PatternCut, flat_pattern
from notchflex.plotting import (
    INK,
    LETTER,
    MM,
    TEXT,
    draw_marks,
    draw_row,
    house_style,
    label,
    notch_rows,
    paper,
    scale_text,
    usual_scale,
)
from notchflex.support import robot_digest

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure


_SIZES = {"a4": (297.0, 210.0), "a3": (420.0, 297.0)}  # of a sheet that lies across [mm]
_LEFT, _EDGE = 20.0, 10.0  # margin for the file, and the others [mm]
_CELL, _LINE = 75.0, 8.0  # width and height of an entry of the title block [mm]
_MOST = 47  # letters of an entry
_GAP = 3.0  # between frame, title block and what is drawn [mm]
_WORD = 7.5  # size of notes, in points
_NOTE = 0.15  # height of a line of notes [in]
_ROW, _HEAD = 0.2, 0.36  # heights in a table [in]
_AXIS = 0.45  # room for the numbers along an axis of the pattern [in]
_HEADS = (
    "notch",
    "from\n[mm]",
    "to\n[mm]",
    "height\n[mm]",
    "side\n[deg]",
    "arc cut\n[deg]",
    "arc left\n[mm]",
    "depth\n[mm]",
    "walls",
    "height\nmeasured",
    "arc left\nmeasured",
)
_LOOKS: dict[str, dict[str, Any]] = {
    "CUT": {"color": "#D55E00", "lw": 0.8},
    "CUT_OFF": {"color": "#0072B2", "lw": 1.2},
    "REFERENCE": {"color": "#7F7F7F", "lw": 0.5},
}


class DrawingPage:
    """A page with its frame, and notes at the foot of the room for drawings.

    Attributes:
        figure: The page.
        axes: Axes on it, in inches of paper.
        room: Left, lower, right and upper end of the room above the notes [in].
    """

    def __init__(self, pattern: FlatPattern, subject: str, notes: Sequence[str]) -> None:
        """Draw the frame and write the notes."""
        width, height = _SIZES[pattern.options.paper]
        self.subject, self.scale = subject, "as stated"
        self.figure, self.axes = paper(MM * width, MM * height)
        self.frame(_LEFT, _EDGE, width - _LEFT - _EDGE, height - 2.0 * _EDGE, 1.4)
        low = _EDGE + 4.0 * _LINE + _GAP
        ends = _LEFT + _GAP, low, width - _EDGE - _GAP, height - _EDGE - _GAP
        left, low, right, top = (MM * end for end in ends)
        letters = int((right - left) / (LETTER * _WORD / TEXT))
        lines = [line for note in notes for line in wrap(note, letters, subsequent_indent="    ")]
        words = low + _NOTE * len(lines)
        self.write(left, words, "\n".join(lines), _WORD, linespacing=60.0 * _NOTE / _WORD)
        self.room = left, words, right, top

    def inset(self, left: float, low: float, right: float, top: float, **options: Any) -> Axes:
        """Return axes in a part of the page [in]."""
        width, height = self.figure.get_size_inches()
        place = left / width, low / height, (right - left) / width, (top - low) / height
        return self.figure.add_axes(place, **options)

    def write(self, left: float, top: float, text: str, size: float, **style: Any) -> None:
        """Write a text below or at a height [in]."""
        style = {"va": "top", "color": INK, "parse_math": False} | style
        self.axes.text(left, top, text, fontsize=size, **style)

    def frame(self, left: float, low: float, width: float, height: float, line: float) -> None:
        """Draw a frame [mm]."""
        corner = MM * left, MM * low
        box = Rectangle(corner, MM * width, MM * height, fill=False, lw=line, ec=INK)
        self.axes.add_patch(box)


def _add_title_block(page: DrawingPage, pattern: FlatPattern, sheet: str) -> None:
    """Write who made what, of which material, at which scale."""
    robot, entries = pattern.robot, pattern.robot.drawing
    cells = {
        "drawing": page.subject,
        "made by": f"notchflex {__version__}",
        "robot file": robot_digest(robot),
        "drawn": entries.drawn,
        "date": entries.date,
        "lengths": "mm",
        "material": entries.material or f"{robot.material.kind} (of the model)",
        "finish": entries.finish,
        "scale": page.scale,
        "part": entries.part or robot.name,
        "revision": entries.revision,
        "sheet": sheet,
    }
    width, _ = _SIZES[pattern.options.paper]
    for number, (name, value) in enumerate(cells.items()):
        left = width - _EDGE - _CELL * (3 - number % 3)
        low = _EDGE + _LINE * (number // 3)
        page.frame(left, low, _CELL, _LINE, 0.7)
        texts = (5.4, name, 5.5), (1.6, plain(value or "")[:_MOST], TEXT)
        for up, text, size in texts:
            page.write(MM * (left + 1.0), MM * (low + up), text, size, va="baseline")


def pattern_sheet(subject: Subject, options: PatternOptions) -> Document:
    """Make the sheet of a robot: its pattern, the table of its cuts, and its dimensioned drawing.

    It is in mm, whatever the unit round the tube in other files.

    Raises:
        InputError: See `flat_pattern`; or a kind of notch has no dimensioned drawing.
    """
    pattern = flat_pattern(subject, dataclasses.replace(options, y_unit="mm"))
    with house_style():
        pages = [_pattern_page(pattern), *_table_pages(pattern), *_dimension_pages(pattern)]
        for number, page in enumerate(pages, start=1):
            _add_title_block(page, pattern, f"{number} of {len(pages)}")
    facts = pattern.facts | {"pages": len(pages)}
    return Document([page.figure for page in pages], pattern.warnings, facts, _save)


def _save(pages: Sequence[Figure], file: Path) -> None:
    """Write pages; without a date, so that the same robot gives the same file."""
    from matplotlib.backends.backend_pdf import PdfPages

    with house_style(), PdfPages(file, metadata={"CreationDate": None}) as pdf:
        for page in pages:
            pdf.savefig(page)


def _pattern_page(pattern: FlatPattern) -> DrawingPage:
    """Draw the pattern to scale, with the numbers of its notches, and the notes below."""
    lines, _ = pattern_drawing(pattern)
    x, y = zip(*(point for line in lines for point in line.points), strict=True)
    colours = "orange: cut; blue: cut off; grey, not cut: edges of the tube, sides of the tendons"
    warnings = (f"WARNING: {text}" for text in pattern.warnings)
    notes = [*title_lines(pattern)[1:-1], colours, *warnings]
    page = DrawingPage(pattern, "Flat pattern", notes)
    left, low, right, top = page.room
    wide, high = max(x) - min(x), max(y) - min(y)
    scale = usual_scale(min((right - left - _AXIS) / wide, (top - low - 2.0 * _AXIS) / high))
    page.scale, wide, high = scale_text(scale), scale * wide, scale * high
    left, top = left + _AXIS + 0.5 * (right - left - _AXIS - wide), top - 0.1
    axes = page.inset(
        left, top - high, left + wide, top, xlim=(min(x), max(x)), ylim=(min(y), max(y))
    )
    for line in lines:
        closing = line.points[:1] if line.closed else ()
        axes.plot(*zip(*line.points, *closing, strict=True), clip_on=False, **_LOOKS[line.layer])
    draw_marks(axes, [label(cut.middle, cut.placed.name, size=6.5) for cut in pattern.cuts])
    axes.spines[:].set_visible(False)
    axes.tick_params(labelsize=7.0)
    axes.set_xlabel("along the tube [mm]", fontsize=7.0)
    if high > 1.05:  # as long as the words
        axes.set_ylabel("round the tube [mm]", fontsize=7.0)
    else:
        axes.set_yticks([])
    return page


def _row(pattern: FlatPattern, shown: PatternCut) -> list[str]:
    """Return the nominal numbers of a cut, with room for measured ones."""
    ys = [y for _, y in shown.nominal]
    cut, radius, arc = shown.placed.cut, pattern.tube.outer_radius, max(ys) - min(ys)
    return [
        shown.placed.name,
        f"{shown.placed.start:.4f}",
        f"{shown.placed.end:.4f}",
        f"{shown.placed.end - shown.placed.start:.4f}",
        f"{cut.side_deg % 360.0:.4g}",
        f"{math.degrees(arc / radius):.3f}",
        f"{pattern.around - arc:.4f}",
        f"{radius - min(height for _, height in cut.corners):.4f}",
        "on-axis" if cut.radial else "off-axis",
        "",
        "",
    ]


def _table_pages(pattern: FlatPattern) -> list[DrawingPage]:
    """Write the nominal numbers of every cut, from the base."""
    cuts = sorted(pattern.cuts, key=lambda cut: cut.placed.start)
    rows = [_row(pattern, cut) for cut in cuts]
    state = "before polishing" if pattern.options.polishing else "as cut"
    notes = [
        f"Nominal on the outer surface, {state}. Positions from the base of the robot. Arc left: "
        "wall beside the cut, round the outer surface."
    ]
    pages: list[DrawingPage] = []
    while rows:
        page = DrawingPage(pattern, f"Table of the cuts, {state}", notes)
        left, low, right, top = page.room
        count = int((top - low - _HEAD - _NOTE) / _ROW)
        page.scale, shown, rows = "none", rows[:count], rows[count:]
        high = _HEAD + _ROW * len(shown)
        axes = page.inset(left, top - high, right, top)
        axes.set_axis_off()
        table = axes.table(cellText=shown, colLabels=_HEADS, loc="upper center")
        table.auto_set_font_size(False)
        table.set_fontsize(8.0)
        for (row, _), cell in table.get_celld().items():
            cell.set(height=(_ROW if row else _HEAD) / high, linewidth=0.4)
        pages.append(page)
    return pages


def _dimension_pages(pattern: FlatPattern) -> list[DrawingPage]:
    """Draw every shape of notch, as many on a page as fit."""
    polishing, (width, _) = pattern.options.polishing, _SIZES[pattern.options.paper]
    rows, notes = notch_rows(pattern.robot, MM * (width - _LEFT - _EDGE - 2.0 * _GAP))
    length = f"Length from the base to the tip {pattern.end - polishing:.9g}, "
    notes = [f"{length}shank {-pattern.start - polishing:.6g}.", *notes]
    pages: list[DrawingPage] = []
    while rows:
        page = DrawingPage(pattern, f"Dimensions{', finished' if polishing else ''}", notes)
        left, low, right, top = page.room
        room = top - low
        axes = page.inset(left, low, right, top, xlim=(0.0, right - left), ylim=(0.0, room))
        axes.set_axis_off()
        while rows and (room >= rows[0].height or not axes.texts):
            draw_row(axes, rows[0], room)
            room -= rows.pop(0).height
        pages.append(page)
    return pages
