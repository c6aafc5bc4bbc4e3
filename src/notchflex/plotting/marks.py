"""What a picture is made of: marks in panels with their axes, on a grid under a heading.

matplotlib arranges and draws it (`with_matplotlib.py`). The interactive version (`with_plotly.py`)
takes over that arrangement and draws the same marks.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from notchflex.plotting.style import SKY, Colour

Array = NDArray[np.float64]

# notation: lengths of strokes and gaps, in widths of the line.
SOLID: tuple[float, ...] = ()
DASHED, DOTTED, DASH_DOT = (4.0, 2.0), (1.0, 1.6), (6.4, 1.6, 1.0, 1.6)
FINE, MIXED = (3.0, 2.0), (5.0, 1.0, 1.0, 1.0, 1.0, 1.0)

MARKERS = "osD^vP*X"
"""Markers of the points of a curve."""

INSIDE, BESIDE, BELOW = "inside", "beside", "below"
"""Positions of the legend of a panel."""


@dataclass(frozen=True, kw_only=True)
class Mark:
    """Fields of every mark: legend entry, group and drawing order (higher in front).

    A legend has a name once. A browser shows and hides the marks of one group together, which is
    the name if not given.
    """

    name: str = ""
    group: str = ""
    layer: int = 2


@dataclass(frozen=True)
class Curve(Mark):
    """Points that are connected, marked or both, (k, 2) in the plane or (k, 3) in space.

    A row of NaN is a gap; without points it is a legend entry only. Without `dash` it has markers
    alone. A browser shows the numbers under the pointer.
    """

    points: Any
    colour: Colour
    dash: tuple[float, ...] | None = SOLID
    width: float = 1.4  # pt
    marker: str = ""  # one of `MARKERS`
    size: float = 3.0  # of the markers [pt]
    hollow: bool = False

    @property
    def rows(self) -> Array:
        """The points as an array, (k, 2) or (k, 3)."""
        points = np.asarray(self.points, float)
        return points if points.size else np.zeros((0, 2))


def line(x: Any, y: Any, colour: Colour, *style: Any, **options: Any) -> Curve:
    """Return the curve of y over x; `style` and `options` are those of `Curve`."""
    return Curve(np.stack([x, y], axis=1), colour, *style, **options)


def dots(points: Any, colour: Colour, size: float = 3.0, **options: Any) -> Curve:
    """Return round markers without a line; `options` are those of `Curve`."""
    style: dict[str, Any] = {"dash": None, "marker": "o", "size": size}
    return Curve(points, colour, **(style | options))


@dataclass(frozen=True)
class Area(Mark):
    """Filled polygons in the plane, each (k, 2); none for a legend entry only."""

    polygons: Sequence[Array]
    colour: Colour
    opacity: float = 0.85
    width: float = 0.0  # of the edge, in its colour [pt]
    face: Colour = ""  # the colour of the edge if ""


def band(x: Any, low: Any, high: Any, colour: Colour, opacity: float, **options: Any) -> Area:
    """Return the area between two curves over x, where both have numbers."""
    is_finite = np.isfinite(low) & np.isfinite(high)
    ends = [np.stack([x, end], axis=1)[is_finite] for end in (low, high)]
    return Area([np.concatenate([ends[0], ends[1][::-1]])], colour, opacity, **options)


@dataclass(frozen=True)
class Faces(Mark):
    """Quadrilaterals in space, (m, 4, 3), shaded by their angle to the light."""

    corners: Array
    colour: Colour


@dataclass(frozen=True)
class Arrow(Mark):
    """An arrow along points to the last of them, (k, 2) in the plane or (2, 3) in space."""

    points: Any
    colour: Colour
    width: float = 1.4
    head: float = 9.0  # its size [pt]
    layer: int = field(default=9, kw_only=True)


@dataclass(frozen=True)
class Span(Mark):
    """A line across the whole panel at one value of an axis, or a band up to another one.

    `axis` is "x" for a vertical one, "y" for a horizontal one.
    """

    axis: str
    low: float
    colour: Colour
    dash: tuple[float, ...] = SOLID
    width: float = 0.8
    high: float | None = None
    opacity: float = 1.0
    layer: int = field(default=0, kw_only=True)


@dataclass(frozen=True)
class Note(Mark):
    """A text at a point of the panel; `inside` gives it in parts of the panel, from 0 to 1.

    `align` is where the point lies in the text, such as "left top".
    """

    text: str
    at: tuple[float, float] = (0.5, 0.5)
    colour: Colour = "black"
    align: str = "center center"
    inside: bool = True
    size: float = 9.0  # pt
    bold: bool = False
    turned: bool = False  # by a right angle
    layer: int = field(default=20, kw_only=True)


@dataclass(frozen=True)
class Panel:
    """Axes in the plane or in space, with units in their labels, and the marks in them.

    Its legend has the marks with names.
    """

    items: Sequence[Mark]
    x_label: str
    y_label: str
    z_label: str = ""  # "" in the plane
    title: str = ""
    legend: str = BESIDE  # `INSIDE`, `BESIDE`, `BELOW`, or "" for none
    equal: bool = False  # both axes have the same scale
    shared: str = ""  # axes with the same limits in all panels that share them, as "xy"
    whole: str = ""  # axes with integers only, as "xy"
    from_zero: bool = False  # the y axis starts at 0, unless something is negative
    ticks: Mapping[str, Sequence[str]] = field(default_factory=dict)
    """Labels at 0, 1, 2, ... of the axes that have some, in place of numbers and grid."""
    x_range: tuple[float | None, float | None] | None = None  # None fits the marks
    y_range: tuple[float | None, float | None] | None = None
    z_range: tuple[float | None, float | None] | None = None

    @property
    def axes(self) -> str:
        """The names of its axes."""
        return "xyz" if self.z_label else "xy"


def box(left: Any, low: Any, right: Any, high: Any) -> Array:
    """Return the corners of a rectangle."""
    return np.array([(left, low), (right, low), (right, high), (left, high)])


def bar_panel(
    values: Array,
    names: Sequence[str],
    label: str,
    extra: Sequence[Mark] = (),
    colours: Sequence[Colour] = (),
    **options: Any,
) -> Panel:
    """Return horizontal bars from top to bottom, with their values; `options` are of `Panel`."""
    marks, last = [*extra], len(values) - 1
    for number, value in enumerate(values.tolist()):
        row, colour = last - number, colours[number] if colours else SKY
        marks.append(Area([box(0.0, row - 0.3, value, row + 0.3)], colour, 1.0))
        marks.append(Note(f" {value:.2f}", (value, row), align="left center", inside=False))
    limits = 0.0, 1.2 * np.nanmax(values, initial=0.0) or 1.2
    options = {"x_range": limits, "ticks": {"y": names[::-1]}} | options
    return Panel(marks, label, "", **options)


@dataclass(frozen=True)
class Cell:
    """A panel in one column of the grid, over one or more rows."""

    panel: Panel
    row: int
    column: int
    height: int = 1


def grid(panels: Sequence[Panel], columns: int) -> list[Cell]:
    """Arrange panels row by row in columns."""
    return [Cell(panel, *divmod(index, columns)) for index, panel in enumerate(panels)]


def stack(panels: Iterable[Panel], column: int = 0, height: int = 1) -> list[Cell]:
    """Arrange panels in one column from top to bottom, each over `height` rows."""
    return [Cell(panel, height * row, column, height) for row, panel in enumerate(panels)]


def side_by_side(columns: Iterable[Sequence[Panel]]) -> list[Cell]:
    """Arrange panels in columns that are two rows high, each with one panel or two."""
    return [
        cell
        for number, panels in enumerate(columns)
        for cell in stack(panels, number, 2 // len(panels))
    ]


@dataclass(frozen=True)
class Sheet:
    """Panels on a grid under a heading, with a common legend below."""

    title: str
    cells: Sequence[Cell]
    legend: Sequence[Curve | Area] = ()
    column_width: float = 4.4  # in
    row_height: float = 3.2  # in

    @property
    def shape(self) -> tuple[int, int]:
        """Rows and columns of the grid."""
        rows = max(cell.row + cell.height for cell in self.cells)
        return rows, max(cell.column for cell in self.cells) + 1

    @property
    def size(self) -> tuple[float, float]:
        """Width and height on paper [in]."""
        rows, columns = self.shape
        return 1.0 + self.column_width * columns, 0.6 + self.row_height * rows
