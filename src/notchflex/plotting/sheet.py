"""What a picture shows, told once: panels of lines, areas and arrows, with their axes.

matplotlib draws it for paper (`plotting/renderers/with_matplotlib.py`), plotly for a browser (`plotting/renderers/with_plotly.py`). What
a result has to show is described in terms of this file and of nothing else, so that both show the
same curves under the same names.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

if TYPE_CHECKING:
    from pathlib import Path as FilePath

    from matplotlib.figure import Figure

Colour = str | tuple[float, ...]
Points = NDArray[np.float64]

# notation: lengths of strokes and gaps, in widths of the line.
SOLID: tuple[float, ...] = ()
DASHED, DOTTED, DASH_DOT = (4.0, 2.0), (1.0, 1.6), (6.4, 1.6, 1.0, 1.6)
FINE, MIXED = (3.0, 2.0), (5.0, 1.0, 1.0, 1.0, 1.0, 1.0)

MARKERS = "osD^vP*X"
"""Marks that a line can have at its points."""

SCREEN_DOTS = 72
"""Dots per inch of a picture in a notebook."""

INSIDE, BESIDE, BELOW = "inside", "beside", "below"
"""Where the legend of a panel stands."""


@dataclass(frozen=True)
class Line:
    """Points that are joined, marked or both; in the plane (k, 2) or in space (k, 3).

    Attributes:
        points: Where it goes; a row of NaN is a gap.
        colour: Its colour.
        dash: Lengths of strokes and gaps; `SOLID`, or None for marks alone.
        width: In points.
        marker: The mark at every point, one of `MARKERS`, or "".
        size: Of the marks, in points.
        hollow: Whether marks have no filling.
        name: What a legend calls it; "" for nothing.
        group: What is shown and hidden together in a browser.
        layer: Above what it lies.
        told: Whether a browser tells the numbers under the pointer.
        blunt: Whether its ends are cut off straight.
        half: Half the height of the error bar at every point, (k,), NaN for none; in the plane.
    """

    points: Any
    colour: Colour
    dash: tuple[float, ...] | None = SOLID
    width: float = 1.4
    marker: str = ""
    size: float = 3.0
    hollow: bool = False
    name: str = ""
    group: str = ""
    layer: int = 2
    told: bool = False
    blunt: bool = False
    half: Any = None

    @property
    def rows(self) -> Points:
        """The points as an array, (k, 2) or (k, 3)."""
        points = np.asarray(self.points, float)
        return points if points.size else np.zeros((0, 2))


@dataclass(frozen=True)
class Area:
    """Polygons of one kind in the plane, each (k, 2)."""

    polygons: Sequence[Points]
    face: Colour
    edge: Colour
    opacity: float = 0.85
    width: float = 0.8
    name: str = ""
    group: str = ""
    layer: int = 2


@dataclass(frozen=True)
class Faces:
    """Flat pieces with four corners in space, (m, 4, 3), each of its own colour."""

    corners: Points
    colours: Sequence[Colour]
    colour: Colour
    name: str = ""
    group: str = ""


@dataclass(frozen=True)
class Arrow:
    """An arrow, in the plane or in space; `bend` makes it an arc (1 a half circle or so)."""

    start: Points
    end: Points
    colour: Colour
    bend: float = 0.0
    width: float = 1.4
    name: str = ""
    layer: int = 9
    reach: Points | None = None
    """Points that the axes must show beside it, (k, 2)."""


@dataclass(frozen=True)
class Upright:
    """A vertical line over the whole height of a panel."""

    at: float
    colour: Colour = "#666666"
    dash: tuple[float, ...] = DOTTED
    width: float = 0.8
    name: str = ""
    group: str = ""


@dataclass(frozen=True)
class Level:
    """A horizontal line over the whole width of a panel."""

    at: float
    colour: Colour
    dash: tuple[float, ...] = SOLID
    width: float = 0.8
    name: str = ""
    group: str = ""


@dataclass(frozen=True)
class Stripe:
    """All between two heights, over the whole width of a panel."""

    low: float
    high: float
    colour: Colour
    opacity: float
    name: str = ""
    group: str = ""


@dataclass(frozen=True)
class Bars:
    """Bars to the right, one under the other, with their numbers."""

    values: Sequence[float]
    names: Sequence[str]
    colours: Sequence[Colour]
    form: str = ".2f"


@dataclass(frozen=True)
class Correlations:
    """Correlations of n numbers as a square of colours, each with its value.

    Attributes:
        values: From -1 to 1, (n, n); NaN where there is none.
        names: Of the n numbers, which a browser tells under the pointer.
        rows: What stands beside the rows; under the columns stand their numbers from 1.
    """

    values: Points
    names: Sequence[str]
    rows: Sequence[str]

    @property
    def texts(self) -> list[list[str]]:
        """What stands in the square."""
        return [[f"{one:.2f}" if np.isfinite(one) else "-" for one in row] for row in self.values]

    @property
    def letters(self) -> float:
        """Size of the letters in it, in points, with which a value fits its place."""
        count = len(self.names)
        return 8.0 if count < 6 else 36.0 / count

    @property
    def outer_letters(self) -> float:
        """Size of the letters beside and below it, in points."""
        return min(7.0, 3.1 * self.letters)


@dataclass(frozen=True)
class Note:
    """A sentence in the middle of a panel that has nothing else to show, or in its corner."""

    text: str
    colour: Colour = "black"
    corner: bool = False
    """Whether it stands at the upper left, beside what else is drawn."""


Item = Line | Area | Faces | Arrow | Upright | Level | Stripe | Bars | Correlations | Note


@dataclass(frozen=True)
class Panel:
    """One pair or triple of axes and what is drawn into them.

    Attributes:
        items: What is drawn.
        x_label: What stands at the axis, with its unit.
        y_label: The same upward.
        z_label: The same in space; "" in the plane.
        title: Above it, on the left.
        legend: `INSIDE`, `BESIDE`, `BELOW`, or "" for none.
        equal: Whether both axes have one scale.
        scale: Panels of one name show the same part of the plane.
        x_range: From where to where; None is found from what is drawn, also one end alone.
        y_range: The same upward.
        whole_x: Whether the axis has whole numbers only.
        whole_y: The same upward.
        most_x: How many numbers stand at the axis at most; None for what has room.
        shared_x: Whether its horizontal axis is that of the other such panels.
        shared_y: The same upward.
    """

    items: Sequence[Item]
    x_label: str
    y_label: str
    z_label: str = ""
    title: str = ""
    legend: str = ""
    equal: bool = False
    scale: str = ""
    x_range: tuple[float | None, float | None] | None = None
    y_range: tuple[float | None, float | None] | None = None
    whole_x: bool = False
    whole_y: bool = False
    most_x: int | None = None
    shared_x: bool = False
    shared_y: bool = False

    @property
    def in_space(self) -> bool:
        """Whether it has three axes."""
        return bool(self.z_label)


@dataclass(frozen=True)
class Cell:
    """A panel at its place: rows and columns of the grid, first and last and one."""

    panel: Panel
    rows: tuple[int, int]
    columns: tuple[int, int]


@dataclass(frozen=True, repr=False)
class Picture:
    """Panels on a grid, under a heading.

    Attributes:
        title: The heading.
        width: In inches on paper.
        height: In inches on paper.
        cells: The panels.
        legend: Entries of a legend for all panels, below them.
    """

    title: str
    width: float
    height: float
    cells: Sequence[Cell]
    legend: Sequence[Line | Area] = field(default_factory=tuple[Line, ...])

    @property
    def shape(self) -> tuple[int, int]:
        """Rows and columns of the grid."""
        return max(one.rows[1] for one in self.cells), max(one.columns[1] for one in self.cells)

    def figure(self) -> Figure:
        """Return it as a figure of matplotlib."""
        from notchflex.plotting.renderers.with_matplotlib import figure_of

        return figure_of(self)

    def __repr__(self) -> str:
        """What it shows, and how to write it."""
        count = len(self.cells)
        return f"Picture {self.title!r} of {count} panel{'s' * (count != 1)}; .save(file) writes it"

    def _repr_png_(self) -> bytes:
        """Return it as a notebook shows it."""
        from io import BytesIO

        written = BytesIO()
        self.figure().savefig(written, format="png", dpi=SCREEN_DOTS)
        return written.getvalue()

    def interactive(self) -> Any:
        """Return it as a figure of plotly.

        Raises:
            InputError: plotly is not installed.
        """
        from notchflex.plotting.renderers.with_plotly import interactive_of

        return interactive_of(self)

    def save(self, target: str | FilePath) -> None:
        """Write it as PNG, SVG, PDF or HTML, by the suffix; the file is whole or not there.

        An HTML file holds all it needs and asks no other host for anything.

        Args:
            target: Path that ends in .png, .svg, .pdf or .html.

        Raises:
            InputError: Another suffix, a library that is not installed, or it cannot be written.
        """
        from pathlib import Path as FilePath

        from notchflex.results.files.writing import check_picture

        check_picture(str(target), "the picture")
        if FilePath(target).suffix.lower() == ".html":
            from notchflex.plotting.renderers.with_plotly import save_html

            save_html(self, target)
        else:
            from notchflex.plotting.style import save

            save(self.figure(), target)
