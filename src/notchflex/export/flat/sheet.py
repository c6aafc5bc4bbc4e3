"""The sheet for the shop and for incoming inspection: pattern, table of cuts, dimensions (PDF)."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from textwrap import wrap
from typing import TYPE_CHECKING, Any

from matplotlib.patches import Rectangle

from notchflex import __version__
from notchflex.export.flat.drawing import pattern_drawing, plain, title_lines
from notchflex.export.flat.pattern import FlatPattern, PatternCut, flat_pattern
from notchflex.export.formats import Document, Paper, PatternOptions, Subject
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


SIZES: dict[str, tuple[float, float]] = {"a4": (297.0, 210.0), "a3": (420.0, 297.0)}
"""Width and height of a sheet that lies across [mm]."""
_LEFT, _EDGE = 20.0, 10.0  # margin for the file, and the others [mm]
_CELL, _LINE = 75.0, 8.0  # width and height of an entry of the title block [mm]
_MOST = 47  # letters of an entry
_GAP = 3.0  # between frame, title block and what is drawn [mm]
_WORD = 7.5  # size of notes, in points
NOTE = 0.15
"""Height of a line of notes [in]."""


@dataclass(frozen=True)
class DrawingPage:
    """A page with its frame.

    Args:
        figure: The page.
        axes: Axes on it, in inches of paper.
        subject: What it shows.
        scale: Its scale, as text.
    """

    figure: Figure
    axes: Axes
    subject: str
    scale: str

    def inset(self, left: float, low: float, right: float, top: float, **options: Any) -> Axes:
        """Return axes in a part of the page [in]."""
        width, height = self.figure.get_size_inches()
        place = left / width, low / height, (right - left) / width, (top - low) / height
        return self.figure.add_axes(place, **options)

    def write(self, left: float, at: float, text: str, size: float = _WORD, **style: Any) -> None:
        """Write a text, in lines of the height `NOTE`, below or at a height [in]."""
        style = {"va": "top", "color": INK, "parse_math": False} | style
        self.axes.text(left, at, text, fontsize=size, linespacing=60.0 * NOTE / size, **style)


def box_of(size: Paper) -> tuple[float, ...]:
    """Return left, lower, right and upper end of the room for drawings on a page [in]."""
    width, height = SIZES[size]
    low = _EDGE + 4.0 * _LINE
    ends = _LEFT + _GAP, low + _GAP, width - _EDGE - _GAP, height - _EDGE - _GAP
    return tuple(MM * end for end in ends)


def new_page(size: Paper, subject: str, scale: str) -> DrawingPage:
    """Return an empty page with its frame."""
    width, height = SIZES[size]
    figure, axes = paper(MM * width, MM * height)
    _frame(axes, _LEFT, _EDGE, width - _LEFT - _EDGE, height - 2.0 * _EDGE, 1.4)
    return DrawingPage(figure, axes, subject, scale)


def folded(lines: Sequence[str], width: float) -> list[str]:
    """Return notes in lines that are not longer than a width [in]."""
    letters = int(width / (LETTER * _WORD / TEXT))
    return [part for line in lines for part in wrap(line, letters, subsequent_indent="    ")]


def add_title_block(page: DrawingPage, pattern: FlatPattern, sheet: str) -> None:
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
    width, _ = SIZES[pattern.options.paper]
    for number, (name, value) in enumerate(cells.items()):
        left = width - _EDGE - _CELL * (3 - number % 3)
        low = _EDGE + _LINE * (number // 3)
        _frame(page.axes, left, low, _CELL, _LINE, 0.7)
        texts = (5.4, name, 5.5), (1.6, plain(value or "")[:_MOST], TEXT)
        for up, text, size in texts:
            page.write(MM * (left + 1.0), MM * (low + up), text, size, va="baseline")


def _frame(axes: Axes, left: float, low: float, width: float, height: float, line: float) -> None:
    """Draw a frame [mm]."""
    corner = MM * left, MM * low
    axes.add_patch(Rectangle(corner, MM * width, MM * height, fill=False, lw=line, ec=INK))


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
            add_title_block(page, pattern, f"{number} of {len(pages)}")
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
    drawing = pattern_drawing(pattern)
    x, y = zip(*(point for line in drawing.lines for point in line.points), strict=True)
    wide, high = max(x) - min(x), max(y) - min(y)
    left, low, right, top = box_of(pattern.options.paper)
    colours = "orange: cut; blue: cut off; grey, not cut: edges of the tube, sides of the tendons"
    warnings = (f"WARNING: {text}" for text in pattern.warnings)
    notes = folded([*title_lines(pattern)[1:-1], colours, *warnings], right - left)
    words = low + NOTE * len(notes)
    room = (right - left - _AXIS) / wide, (top - words - 2.0 * _AXIS) / high
    scale = usual_scale(min(room))
    page = new_page(pattern.options.paper, "Flat pattern", scale_text(scale))
    page.write(left, words, "\n".join(notes))
    wide, high = scale * wide, scale * high
    left, top = left + _AXIS + 0.5 * (right - left - _AXIS - wide), top - 0.1
    limits = {"xlim": (min(x), max(x)), "ylim": (min(y), max(y))}
    axes = page.inset(left, top - high, left + wide, top, **limits)
    for line in drawing.lines:
        closing = line.points[:1] if line.closed else ()
        axes.plot(*zip(*line.points, *closing, strict=True), clip_on=False, **_LOOKS[line.layer])
    draw_marks(axes, [label(one.middle, one.name, size=6.5) for one in pattern.cuts])
    axes.spines[:].set_visible(False)
    axes.tick_params(labelsize=7.0)
    axes.set_xlabel("along the tube [mm]", fontsize=7.0)
    if high > 1.05:  # as long as the words
        axes.set_ylabel("round the tube [mm]", fontsize=7.0)
    else:
        axes.set_yticks([])
    return page


def _row(pattern: FlatPattern, one: PatternCut) -> list[str]:
    """Return the nominal numbers of a cut, with room for measured ones."""
    ys = [y for _, y in one.nominal]
    arc = max(ys) - min(ys)
    cut, radius = one.placed.cut, pattern.tube.outer_radius
    depth = radius - min(height for _, height in cut.corners)
    return [
        one.name,
        f"{one.placed.start:.4f}",
        f"{one.placed.end:.4f}",
        f"{one.placed.end - one.placed.start:.4f}",
        f"{cut.side_deg % 360.0:.4g}",
        f"{math.degrees(arc / radius):.3f}",
        f"{pattern.around - arc:.4f}",
        f"{depth:.4f}",
        "on-axis" if cut.radial else "off-axis",
        "",
        "",
    ]


def _table_pages(pattern: FlatPattern) -> list[DrawingPage]:
    """Write the nominal numbers of every cut, from the base."""
    rows = [_row(pattern, one) for one in sorted(pattern.cuts, key=lambda one: one.placed.start)]
    state = "before polishing" if pattern.options.polishing else "as cut"
    notes = [
        f"Nominal on the outer surface, {state}. Positions from the base of the robot. Arc left: "
        "wall beside the cut, round the outer surface."
    ]
    left, low, right, top = box_of(pattern.options.paper)
    words = folded(notes, right - left)
    low += NOTE * len(words)
    count = int((top - low - _HEAD - NOTE) / _ROW)
    pages: list[DrawingPage] = []
    while rows:
        page = new_page(pattern.options.paper, f"Table of the cuts, {state}", "none")
        shown, rows = rows[:count], rows[count:]
        high = _HEAD + _ROW * len(shown)
        axes = page.inset(left, top - high, right, top)
        axes.set_axis_off()
        table = axes.table(cellText=shown, colLabels=_HEADS, loc="upper center")
        table.auto_set_font_size(False)
        table.set_fontsize(8.0)
        for (row, _), cell in table.get_celld().items():
            cell.set_height((_ROW if row else _HEAD) / high)
            cell.set_linewidth(0.4)
        page.write(left, low, "\n".join(words))
        pages.append(page)
    return pages


def _dimension_pages(pattern: FlatPattern) -> list[DrawingPage]:
    """Draw every shape of notch, as many on a page as fit."""
    polishing, size = pattern.options.polishing, pattern.options.paper
    left, low, right, top = box_of(size)
    rows, notes = notch_rows(pattern.robot, right - left)
    length = f"Length from the base to the tip {pattern.end - polishing:.9g}, "
    notes = [f"{length}shank {-pattern.start - polishing:.6g}.", *notes]
    words = folded(notes, right - left)
    low += NOTE * len(words)
    pages: list[DrawingPage] = []
    while rows:
        page = new_page(size, f"Dimensions{', finished' if polishing else ''}", "as stated")
        page.write(left, low, "\n".join(words))
        room = top - low
        axes = page.inset(left, low, right, top, xlim=(0.0, right - left), ylim=(0.0, room))
        axes.set_axis_off()
        while rows and (room >= rows[0].height or not axes.texts):
            draw_row(axes, rows[0], room)
            room -= rows.pop(0).height
        pages.append(page)
    return pages
