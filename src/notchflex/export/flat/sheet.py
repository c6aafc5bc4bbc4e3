"""The sheet for the shop and for incoming inspection: pattern, table of cuts, dimensions (PDF)."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from notchflex.export.document import Subject
from notchflex.export.flat.drawing import DrawnLine, PatternDrawing, pattern_drawing
from notchflex.export.flat.pattern import FlatPattern, PatternCut, flat_pattern
from notchflex.export.flat.title import plain_name, title_lines
from notchflex.export.options import PatternOptions
from notchflex.robot.tolerance import Tolerance

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

_PAPER = 11.69, 8.27  # A4 across [in]
_ROWS = 30  # of a table on one page
_HEADS = (
    "cut",
    "notch",
    "from\n[mm]",
    "to\n[mm]",
    "width\n[mm]",
    "side\n[deg]",
    "arc cut\n[deg]",
    "arc left\n[mm]",
    "depth\n[mm]",
    "walls",
    "width\nmeasured",
    "arc left\nmeasured",
)
_LOOKS: dict[str, dict[str, Any]] = {
    "CUT": {"color": "#D55E00", "lw": 0.8},
    "CUT_OFF": {"color": "#0072B2", "lw": 1.2},
    "REFERENCE": {"color": "#7F7F7F", "lw": 0.5},
}


@dataclass(frozen=True)
class PatternSheet:
    """Pages of a sheet."""

    pattern: FlatPattern
    pages: Sequence[Figure]

    @property
    def warnings(self) -> tuple[str, ...]:
        """Sentences about the pattern."""
        return self.pattern.warnings

    @property
    def facts(self) -> dict[str, Any]:
        """Numbers about the pattern."""
        return self.pattern.facts | {"pages": len(self.pages)}

    def save(self, file: Path) -> None:
        """Write the pages; without a date, so that the same robot gives the same file."""
        from matplotlib.backends.backend_pdf import PdfPages

        from notchflex.plotting.style import house_style

        with house_style(), PdfPages(file, metadata={"CreationDate": None}) as pages:
            for page in self.pages:
                pages.savefig(page)


def pattern_sheet(subject: Subject, options: PatternOptions) -> PatternSheet:
    """Make the sheet of a robot: its pattern, the table of its cuts, and its dimensioned drawing.

    Raises:
        InputError: See `flat_pattern`; or a kind of notch has no dimensioned drawing.
    """
    from notchflex.plotting.drawings.dimensioned import dimensioned_figure
    from notchflex.plotting.style import house_style

    pattern = flat_pattern(subject, options)
    rows = [_row(pattern, one) for one in pattern.cuts]
    with house_style():
        pages = [_pattern_page(pattern_drawing(pattern))]
        for start in range(0, len(rows), _ROWS):
            pages.append(_table_page(pattern, rows[start : start + _ROWS]))
        pages.append(dimensioned_figure(subject.robot.replace(name=plain_name(subject.robot))))
    return PatternSheet(pattern, pages)


def _new_page(title: str) -> tuple[Figure, Axes]:
    from matplotlib.figure import Figure

    figure = Figure(figsize=_PAPER)
    axes = figure.add_axes((0.06, 0.06, 0.88, 0.86))
    figure.text(0.06, 0.945, title, fontsize=12.0, va="center", parse_math=False)
    return figure, axes


def _pattern_page(drawing: PatternDrawing) -> Figure:
    """Draw the pattern to scale, with the numbers of its cuts and the title block below."""
    pattern = drawing.pattern
    figure, axes = _new_page(f"{plain_name(pattern.robot)}: flat pattern")
    figure.delaxes(axes)
    axes = figure.add_axes((0.08, 0.44, 0.86, 0.46))
    for line in drawing.lines:
        axes.plot(*zip(*_ring(line), strict=True), **_LOOKS[line.layer])
    for one in pattern.cuts:
        x, y = one.middle
        axes.text(x, pattern.y_factor * y, str(one.number), fontsize=7.0, ha="center", va="center")
    if pattern.options.y_unit == "mm":
        axes.set_aspect("equal")
    axes.set_xlabel("along the tube [mm]")
    axes.set_ylabel(f"round the tube [{pattern.options.y_unit}]")
    lines = title_lines(pattern)
    lines += [f"WARNING: {text}" for text in pattern.warnings]
    tolerances = [f"{one.value} {_written(one)}" for one in pattern.robot.tolerance]
    lines += [f"tolerances of the robot file: {', '.join(tolerances)}"] if tolerances else []
    words = "\n".join(lines)
    figure.text(0.06, 0.37, words, fontsize=8.0, va="top", wrap=True, parse_math=False)
    return figure


def _written(one: Tolerance) -> str:
    """Return a tolerance as text."""
    parts = {"standard deviation ": one.sd, "+": one.plus, "-": one.minus}
    return " ".join(f"{name}{value}" for name, value in parts.items() if value is not None)


def _ring(line: DrawnLine) -> Sequence[tuple[float, float]]:
    return [*line.points, line.points[0]] if line.closed else line.points


def _row(pattern: FlatPattern, one: PatternCut) -> list[str]:
    """Return the nominal numbers of a cut, with room for measured ones."""
    ys = [y for _, y in one.nominal]
    arc = max(ys) - min(ys)
    cut, radius = one.placed.cut, pattern.robot.tube.outer_radius
    depth = radius - min(height for _, height in cut.corners)
    return [
        str(one.number),
        str(one.placed.notch),
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


def _table_page(pattern: FlatPattern, rows: Sequence[Sequence[str]]) -> Figure:
    figure, axes = _new_page(f"{plain_name(pattern.robot)}: cuts, nominal on the outer surface")
    axes.set_axis_off()
    table = axes.table(
        cellText=[list(row) for row in rows], colLabels=list(_HEADS), loc="upper center"
    )
    table.auto_set_font_size(False)
    table.set_fontsize(8.0)
    for (row, _), cell in table.get_celld().items():
        cell.set_height(0.052 if row == 0 else 0.028)
        cell.set_linewidth(0.4)
    foot = "Positions from the base of the robot. "
    foot += "Arc left: wall beside the cut, measured round the outer surface."
    figure.text(0.06, 0.03, foot, fontsize=7.5)
    return figure
