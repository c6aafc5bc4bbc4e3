"""Describes a picture: panels of lines, areas and arrows with their axes, on a grid.

matplotlib arranges and draws it (`renderers/with_matplotlib.py`). The interactive version
(`renderers/with_plotly.py`) takes over that arrangement and draws the same marks.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

Colour = str | tuple[float, ...]
Points = NDArray[np.float64]

# notation: lengths of strokes and gaps, in widths of the line.
SOLID: tuple[float, ...] = ()
DASHED, DOTTED, DASH_DOT = (4.0, 2.0), (1.0, 1.6), (6.4, 1.6, 1.0, 1.6)
FINE, MIXED = (3.0, 2.0), (5.0, 1.0, 1.0, 1.0, 1.0, 1.0)

MARKERS = "osD^vP*X"
"""Markers of the points of a line."""

INSIDE, BESIDE, BELOW = "inside", "beside", "below"
"""Positions of the legend of a panel."""


@dataclass(frozen=True)
class Line:
    """Points that are connected, marked or both, (k, 2) in the plane or (k, 3) in space.

    Attributes:
        points: Coordinates; a row of NaN is a gap. No points at all: a legend entry only.
        colour: Colour of line and markers.
        dash: Lengths of strokes and gaps; `SOLID`, or None for markers alone.
        width: Line width [pt].
        marker: One of `MARKERS`, or "".
        size: Size of the markers [pt].
        hollow: Whether the markers are open.
        name: Legend entry; "" for none.
        group: Marks of one group are shown and hidden together in a browser.
        layer: Drawing order; higher is in front.
        hover: Whether a browser shows the numbers under the pointer.
        error: Half heights of error bars, (k,), NaN for none; None without error bars.
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
    hover: bool = False
    error: Any = None

    @property
    def rows(self) -> Points:
        """The points as an array, (k, 2) or (k, 3)."""
        points = np.asarray(self.points, float)
        return points if points.size else np.zeros((0, 2))


def dots(points: Any, colour: Colour, size: float = 3.0, **options: Any) -> Line:
    """Return round markers without a line; `options` are those of `Line`."""
    look: dict[str, Any] = {"dash": None, "marker": "o", "size": size}
    return Line(points, colour, **(look | options))


@dataclass(frozen=True)
class Area:
    """Filled polygons in the plane, each (k, 2); none for a legend entry only."""

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
    """Quadrilaterals in space, (m, 4, 3), with a colour each; `colour` is that of the legend."""

    corners: Points
    colours: Sequence[Colour]
    colour: Colour
    name: str = ""
    group: str = ""
    layer: int = 0


@dataclass(frozen=True)
class Arrow:
    """An arrow in the plane or in space; in the plane `bend` makes it an arc (1: a half circle)."""

    start: Points
    end: Points
    colour: Colour
    bend: float = 0.0
    width: float = 1.4
    name: str = ""
    group: str = ""
    layer: int = 9
    reach: Points | None = None
    """Points that the axes must include, (k, 2); the ends of the arrow if None."""


@dataclass(frozen=True)
class Span:
    """A line or band across the whole panel, at one value or between two values of an axis.

    Attributes:
        axis: "x" for a vertical line or band, "y" for a horizontal one.
        low: Where it begins.
        high: Where it ends; a line if equal to `low`.
        colour: Colour of the line or the band.
        dash: Of a line, as in `Line`.
        width: Of a line [pt].
        opacity: Of a band.
        name: Legend entry; "" for none.
        group: As in `Line`; the name if "".
    """

    axis: str
    low: float
    high: float
    colour: Colour
    dash: tuple[float, ...] = SOLID
    width: float = 0.8
    opacity: float = 1.0
    name: str = ""
    group: str = ""
    layer: int = 0


@dataclass(frozen=True)
class Bars:
    """Horizontal bars from top to bottom, with their values."""

    values: Sequence[float]
    names: Sequence[str]
    colours: Sequence[Colour]
    layer: int = 0


@dataclass(frozen=True)
class Correlations:
    """A coloured matrix of correlations, each with its value.

    Attributes:
        values: From -1 to 1, (n, n); NaN where there is none.
        names: Names of the n variables, which a browser shows under the pointer.
        rows: Labels of the rows; the columns are numbered from 1.
    """

    values: Points
    names: Sequence[str]
    rows: Sequence[str]
    layer: int = 0

    @property
    def texts(self) -> list[list[str]]:
        """The values as text."""
        return [[f"{one:.2f}" if np.isfinite(one) else "-" for one in row] for row in self.values]

    @property
    def font_size(self) -> float:
        """Font size [pt] at which a value fits its cell."""
        count = len(self.names)
        return 8.0 if count < 6 else 36.0 / count


@dataclass(frozen=True)
class Note:
    """A sentence in the centre of an empty panel, or in its upper left corner."""

    text: str
    colour: Colour = "black"
    corner: bool = False
    layer: int = 0


Mark = Line | Area | Faces | Arrow | Span | Bars | Correlations | Note


@dataclass(frozen=True)
class Panel:
    """Axes in the plane or in space and the marks in them.

    Attributes:
        items: The marks.
        x_label: Label of the axis, with its unit.
        y_label: The same for y.
        z_label: The same for z; "" in the plane.
        title: Title, left-aligned.
        legend: `INSIDE`, `BESIDE`, `BELOW`, or "" for none.
        equal: Whether both axes have the same scale.
        scale: Panels with the same name show the same part of the plane.
        x_range: Limits; None is chosen to fit the marks, also for one end.
        y_range: The same for y.
        whole: Axes with integers only: "", "x", "y" or "xy".
        shared: Axes with the same limits in all panels that share them, as `whole`.
        most_x: Maximum number of ticks on the x axis; None for no limit.
    """

    items: Sequence[Mark]
    x_label: str
    y_label: str
    z_label: str = ""
    title: str = ""
    legend: str = ""
    equal: bool = False
    scale: str = ""
    x_range: tuple[float | None, float | None] | None = None
    y_range: tuple[float | None, float | None] | None = None
    whole: str = ""
    shared: str = ""
    most_x: int | None = None

    @property
    def in_space(self) -> bool:
        """Whether it has three axes."""
        return bool(self.z_label)


@dataclass(frozen=True)
class Cell:
    """A panel in one column of the grid, over one or more rows."""

    panel: Panel
    row: int
    column: int
    height: int = 1


def grid(panels: Sequence[Panel], columns: int, first: int = 0) -> list[Cell]:
    """Arrange panels row by row in columns, counted from `first`."""
    return [
        Cell(panel, index // columns, first + index % columns) for index, panel in enumerate(panels)
    ]


def stack(panels: Iterable[Panel], column: int = 0, height: int = 1) -> list[Cell]:
    """Arrange panels in one column from top to bottom, each over `height` rows."""
    return [Cell(panel, height * row, column, height) for row, panel in enumerate(panels)]


@dataclass(frozen=True)
class Sheet:
    """Panels on a grid, with a heading.

    Attributes:
        title: The heading.
        width: Width on paper [in].
        height: Height on paper [in].
        cells: The panels.
        legend: Entries of a common legend below the panels.
    """

    title: str
    width: float
    height: float
    cells: Sequence[Cell]
    legend: Sequence[Line | Area] = field(default_factory=tuple[Line, ...])

    @property
    def shape(self) -> tuple[int, int]:
        """Rows and columns of the grid."""
        rows = max(one.row + one.height for one in self.cells)
        return rows, max(one.column + 1 for one in self.cells)
