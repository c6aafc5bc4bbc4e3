"""Draws a picture with matplotlib."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import FancyArrowPatch, Polygon
from matplotlib.ticker import MaxNLocator
from mpl_toolkits.mplot3d.art3d import Poly3DCollection

from notchflex.plotting.sheet import (
    BELOW,
    BESIDE,
    Area,
    Arrow,
    Bars,
    Correlations,
    Curve,
    Faces,
    Note,
    Panel,
    Sheet,
    Span,
)
from notchflex.plotting.style import (
    DIVERGING,
    for_paper,
    heading_lines,
    house_style,
    new_figure,
    rgb,
)

ELEVATION, AZIMUTH = 18.0, -60.0


def figure_of(picture: Sheet) -> Figure:
    """Return a picture as a figure of matplotlib."""
    with house_style():
        heading = "\n".join(map(for_paper, heading_lines(picture.title, picture.width)))
        figure = new_figure(picture.width, picture.height, heading)
        grid = figure.add_gridspec(*picture.shape)
        scales: dict[str, list[Axes]] = {}
        shared: dict[str, Axes] = {}
        for cell in picture.cells:
            panel = cell.panel
            cells = grid[cell.row : cell.row + cell.height, cell.column]
            options: dict[str, Any] = {"projection": "3d"} if panel.in_space else {}
            options |= {f"share{name}": shared.get(name) for name in panel.shared}
            axes: Any = figure.add_subplot(cells, **options)
            for name in panel.shared:
                shared.setdefault(name, axes)
            draw_panel(axes, panel)
            if panel.scale:
                scales.setdefault(panel.scale, []).append(axes)
        # matplotlib cannot share axes of equal scale, so each takes in what the others show.
        for group in scales.values():
            for axes in group:
                for other in group:
                    axes.update_datalim(other.dataLim.get_points())
                axes.autoscale_view()
        if picture.legend:
            entries = [
                Line2D([], [], **_line_look(one))
                if isinstance(one, Curve)
                else _polygon(one, np.zeros((1, 2)), one.name)
                for one in picture.legend
            ]
            columns = _columns([one.name for one in picture.legend], picture.width)
            figure.legend(handles=entries, loc="outside lower center", ncols=columns)
    return figure


def _columns(names: list[str], width: float) -> int:
    """Return the number of columns, 8 at most, with which a legend fits a width [in]."""
    # Room for the mark and the gap, and the mean width of a letter of 8 points.
    wide = [0.55 + 0.068 * len(name) for name in names]
    for columns in range(min(8, len(names)), 1, -1):
        if sum(part.max() for part in np.array_split(wide, columns)) <= width:
            return columns
    return 1


def draw_panel(axes: Any, panel: Panel) -> None:
    """Draw a panel into axes of matplotlib, of three dimensions where it is in space."""
    faces = [item for item in panel.items if isinstance(item, Faces)]
    if faces:
        _draw_faces(axes, faces)
    for item in panel.items:
        _draw(axes, item)
    if panel.in_space:
        _set_equal_in_space(axes, panel)
        axes.view_init(elev=ELEVATION, azim=AZIMUTH)
        axes.set_zlabel(for_paper(panel.z_label), labelpad=12.0)
    else:
        axes.autoscale_view()
    if panel.equal:
        axes.set_aspect("equal", adjustable="datalim")
    axes.set(xlabel=for_paper(panel.x_label), ylabel=for_paper(panel.y_label))
    if panel.title:
        axes.set_title(for_paper(panel.title), loc="left")
    for name in panel.whole:
        getattr(axes, f"{name}axis").set_major_locator(MaxNLocator(integer=True))
    if panel.most_x is not None:
        axes.locator_params(axis="x", nbins=panel.most_x)
    if panel.x_range is not None:
        axes.set_xlim(*panel.x_range)
    if panel.y_range is not None:
        axes.set_ylim(*panel.y_range)
    if panel.legend == BELOW:  # axes of three dimensions have no empty corner
        axes.legend(loc="upper center", bbox_to_anchor=(0.5, -0.085))
    elif panel.legend == BESIDE:
        # In space the labels of the vertical axis are there too.
        at = (1.25, 1.0) if panel.in_space else (1.0, 1.0)
        axes.legend(loc="upper left", bbox_to_anchor=at, borderaxespad=0.2)
    elif panel.legend:
        axes.legend(loc="best")


def _draw(axes: Any, item: Any) -> None:
    match item:
        case Curve():
            rows = item.rows if len(item.rows) else np.zeros((0, 3 if axes.name == "3d" else 2))
            axes.plot(*rows.T, **_line_look(item))
            if item.error is not None:
                bars: dict[str, Any] = {"ecolor": item.colour, "elinewidth": 0.7}
                half = np.nan_to_num(item.error)  # a bar without height is not seen
                axes.errorbar(*rows.T, yerr=half, fmt="none", zorder=item.layer, **bars)
        case Area():
            for index, polygon in enumerate(item.polygons):
                axes.add_patch(_polygon(item, polygon, "" if index else item.name))
        case Arrow():
            _draw_arrow(axes, item)
        case Span():
            style: dict[str, Any] = {"color": item.colour, "label": for_paper(item.name) or None}
            way = "v" if item.axis == "x" else "h"
            if item.low == item.high:
                style |= {"linestyle": _dashes(item.dash), "linewidth": item.width}
                getattr(axes, f"ax{way}line")(item.low, **style)
            else:
                style |= {"alpha": item.opacity, "linewidth": 0.0}
                getattr(axes, f"ax{way}span")(item.low, item.high, **style)
        case Bars():
            positions = np.arange(len(item.values))
            bars = axes.barh(positions, item.values, color=item.colours, height=0.6)
            axes.bar_label(bars, fmt="{:.2f}", padding=3, fontsize=8.0)
            axes.set_yticks(positions, [for_paper(name) for name in item.names])
            axes.invert_yaxis()
            axes.grid(visible=False, axis="y")
        case Correlations():
            _draw_correlations(axes, item)
        case Note():
            at = (0.03, 0.95) if item.corner else (0.5, 0.5)
            aligned = {"va": "top"} if item.corner else {"ha": "center"}
            style = {"transform": axes.transAxes, "color": item.colour, **aligned}
            write = axes.text2D if axes.name == "3d" else axes.text
            write(*at, for_paper(item.text), **style)
        case _:
            pass  # faces are drawn together, before


def _polygon(item: Area, points: Any, name: str) -> Polygon:
    return Polygon(
        points,
        facecolor=(*rgb(item.face), item.opacity),
        edgecolor=item.edge,
        linewidth=item.width,
        joinstyle="round",
        zorder=item.layer,
        label=for_paper(name) or None,
    )


def _dashes(dash: tuple[float, ...] | None) -> Any:
    return "" if dash is None else (0, dash) if dash else "-"


def _line_look(item: Curve) -> dict[str, Any]:
    return {
        "color": item.colour,
        "linestyle": _dashes(item.dash),
        "linewidth": item.width,
        "marker": item.marker or None,
        "markersize": item.size,
        "markerfacecolor": "none" if item.hollow else item.colour,
        "markeredgewidth": 0.8 if item.hollow else None,
        "zorder": item.layer,
        "label": for_paper(item.name),
    }


def _draw_arrow(axes: Any, item: Arrow) -> None:
    start, end = np.asarray(item.start, float), np.asarray(item.end, float)
    style: dict[str, Any] = {"color": item.colour, "linewidth": item.width}
    if len(start) == 3:
        axes.quiver(*start, *(end - start), label=for_paper(item.name) or None, **style)
        return
    shape: dict[str, Any] = {"arrowstyle": "-|>", "mutation_scale": 9.0}
    shape |= {"connectionstyle": f"arc3,rad={item.bend}", "shrinkA": 0.0, "shrinkB": 0.0}
    axes.add_patch(FancyArrowPatch(tuple(start), tuple(end), zorder=item.layer, **shape, **style))
    axes.update_datalim(np.stack([start, end]) if item.reach is None else item.reach)
    if item.name:
        axes.plot(
            [],
            [],
            color=item.colour,
            marker=">",
            markersize=4.0,
            label=for_paper(item.name) or None,
        )


def _draw_correlations(axes: Any, item: Correlations) -> None:
    axes.imshow(item.values, cmap=DIVERGING, vmin=-1.0, vmax=1.0)
    texts = item.texts
    for (row, column), value in np.ndenumerate(item.values):
        shade = "white" if abs(value) > 0.7 else "black"
        style: dict[str, Any] = {"fontsize": item.font_size, "color": shade}
        axes.text(column, row, texts[row][column], ha="center", va="center", **style)
    positions, size = range(len(item.names)), min(7.0, 3.1 * item.font_size)
    axes.set_xticks(positions, [str(number + 1) for number in positions], fontsize=size)
    axes.set_yticks(positions, [for_paper(row) for row in item.rows], fontsize=size)
    axes.grid(visible=False)


def _draw_faces(axes: Any, faces: Sequence[Faces]) -> None:
    # In one collection, so that all of them are sorted by their distance.
    together = np.concatenate([one.corners for one in faces])
    colours = [colour for one in faces for colour in one.colours]
    axes.add_collection3d(
        Poly3DCollection(together, facecolors=colours, edgecolors=colours, linewidths=0.2)
    )
    for one in faces:
        if one.name:
            axes.plot(
                [], [], [], color=one.colour, linewidth=5.0, label=for_paper(one.name) or None
            )


def _set_equal_in_space(axes: Any, panel: Panel) -> None:
    """Show all faces and arrows with one scale on the three axes."""
    points = [item.corners.reshape(-1, 3) for item in panel.items if isinstance(item, Faces)]
    points += [np.stack([one.start, one.end]) for one in panel.items if isinstance(one, Arrow)]
    if not points:
        return
    every = np.concatenate(points)
    low, high = every.min(axis=0), every.max(axis=0)
    room = 0.02 * float((high - low).max())
    for name, first, last in zip("xyz", low - room, high + room, strict=True):
        getattr(axes, f"set_{name}lim")(first, last)
        part = (last - first) / (high - low).max()
        locator = MaxNLocator(nbins=max(2, round(6 * part)))
        getattr(axes, f"{name}axis").set_major_locator(locator)
    axes.set_box_aspect(high - low + 2.0 * room, zoom=0.92)
