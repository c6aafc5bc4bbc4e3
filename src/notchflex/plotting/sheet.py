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


@dataclass(frozen=True, kw_only=True)
class Mark:
    """Fields of every mark: legend entry, group and drawing order (higher in front).

    A browser shows and hides the marks of one group together.
    """

    name: str = ""
    group: str = ""
    layer: int = 2


@dataclass(frozen=True)
class Curve(Mark):
    """Points that are connected, marked or both, (k, 2) in the plane or (k, 3) in space.

    A row of NaN is a gap; without points it is a legend entry only. Without `dash` it has markers
    alone; with `hover` a browser shows the numbers under the pointer.
    """

    points: Any
    colour: Colour
    dash: tuple[float, ...] | None = SOLID
    width: float = 1.4  # pt
    marker: str = ""  # one of `MARKERS`
    size: float = 3.0  # of the markers [pt]
    hollow: bool = False
    hover: bool = False
    error: Any = None  # half heights of error bars, (k,), NaN for none

    @property
    def rows(self) -> Points:
        """The points as an array, (k, 2) or (k, 3)."""
        points = np.asarray(self.points, float)
        return points if points.size else np.zeros((0, 2))


def dots(points: Any, colour: Colour, size: float = 3.0, **options: Any) -> Curve:
    """Return round markers without a line; `options` are those of `Curve`."""
    style: dict[str, Any] = {"dash": None, "marker": "o", "size": size}
    return Curve(points, colour, **(style | options))


@dataclass(frozen=True)
class Area(Mark):
    """Filled polygons in the plane, each (k, 2); none for a legend entry only."""

    polygons: Sequence[Points]
    face: Colour
    edge: Colour
    opacity: float = 0.85
    width: float = 0.8


@dataclass(frozen=True)
class Faces(Mark):
    """Quadrilaterals in space, (m, 4, 3), with a colour each; `colour` is that of the legend."""

    corners: Points
    colours: Sequence[Colour]
    colour: Colour
    layer: int = field(default=0, kw_only=True)


@dataclass(frozen=True)
class Arrow(Mark):
    """An arrow in the plane or in space; in the plane `bend` makes it an arc (1: a half circle).

    The axes include `reach`, (k, 2), in place of its ends.
    """

    start: Points
    end: Points
    colour: Colour
    bend: float = 0.0
    width: float = 1.4
    reach: Points | None = None
    layer: int = field(default=9, kw_only=True)


@dataclass(frozen=True)
class Span(Mark):
    """A line across the whole panel at one value of an axis (`low` == `high`), or a band.

    `axis` is "x" for a vertical one, "y" for a horizontal one. Its group is its name if "".
    """

    axis: str
    low: float
    high: float
    colour: Colour
    dash: tuple[float, ...] = SOLID
    width: float = 0.8
    opacity: float = 1.0
    layer: int = field(default=0, kw_only=True)


@dataclass(frozen=True)
class Bars(Mark):
    """Horizontal bars from top to bottom, with their values."""

    values: Sequence[float]
    names: Sequence[str]
    colours: Sequence[Colour]
    layer: int = field(default=0, kw_only=True)


@dataclass(frozen=True)
class Correlations(Mark):
    """A coloured matrix of correlations, (n, n), each with its value; NaN where there is none.

    A browser shows the `names` under the pointer. `rows` are labels; columns are numbered from 1.
    """

    values: Points
    names: Sequence[str]
    rows: Sequence[str]
    layer: int = field(default=0, kw_only=True)

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
class Note(Mark):
    """A sentence in the centre of an empty panel, or in its upper left corner."""

    text: str
    colour: Colour = "black"
    corner: bool = False
    layer: int = field(default=0, kw_only=True)


@dataclass(frozen=True)
class Panel:
    """Axes in the plane or in space, with units in their labels, and the marks in them."""

    items: Sequence[Mark]
    x_label: str
    y_label: str
    z_label: str = ""  # "" in the plane
    title: str = ""
    legend: str = ""  # `INSIDE`, `BESIDE`, `BELOW`, or "" for none
    equal: bool = False  # both axes have the same scale
    scale: str = ""  # panels with the same name show the same part of the plane
    x_range: tuple[float | None, float | None] | None = None  # None fits the marks
    y_range: tuple[float | None, float | None] | None = None
    whole: str = ""  # axes with integers only, as "xy"
    shared: str = ""  # axes with the same limits in all panels that share them, as "xy"
    most_x: int | None = None  # maximum number of ticks on the x axis

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
    """Panels on a grid under a heading, of a size on paper [in], with a common legend below."""

    title: str
    width: float
    height: float
    cells: Sequence[Cell]
    legend: Sequence[Curve | Area] = ()

    @property
    def shape(self) -> tuple[int, int]:
        """Rows and columns of the grid."""
        rows = max(one.row + one.height for one in self.cells)
        return rows, max(one.column + 1 for one in self.cells)
