"""Draws a picture with matplotlib."""

from __future__ import annotations

from typing import Any

import numpy as np
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import FancyArrowPatch, Polygon
from matplotlib.ticker import MaxNLocator
from mpl_toolkits.mplot3d.art3d import Poly3DCollection

from notchflex.plotting.marks import (
    BELOW,
    BESIDE,
    INSIDE,
    Area,
    Arrow,
    Curve,
    Faces,
    Mark,
    Note,
    Panel,
    Sheet,
    Span,
)
from notchflex.plotting.style import for_paper, heading_lines, house_style, new_figure, rgb


def figure_of(picture: Sheet) -> Figure:
    """Return a picture as a figure of matplotlib."""
    with house_style():
        width, height = picture.size
        heading = "\n".join(map(for_paper, heading_lines(picture.title, width)))
        figure = new_figure(width, height, heading)
        places = figure.add_gridspec(*picture.shape)
        for cell in picture.cells:
            place = places[cell.row : cell.row + cell.height, cell.column]
            draw_panel(figure.add_subplot(place, **projection(cell.panel)), cell.panel)
        # matplotlib cannot share axes of equal scale, so each takes in what the others show.
        for shared in {cell.panel.shared for cell in picture.cells}:
            group = [
                axes
                for axes, cell in zip(figure.axes, picture.cells, strict=True)
                if cell.panel.shared == shared
            ]
            limits = np.concatenate([axes.dataLim.get_points() for axes in group])
            for axes in group if shared else ():
                axes.update_datalim(limits, "x" in shared, "y" in shared)
                axes.autoscale_view()
        entries = [_legend_entry(mark) for mark in picture.legend]
        for columns in range(len(entries), 0, -1):  # as many as fit the width
            legend = figure.legend(handles=entries, loc="outside lower center", ncols=columns)
            if legend.get_window_extent().width <= figure.bbox.width:
                break
            legend.remove()
    return figure


def projection(panel: Panel) -> dict[str, Any]:
    """Return the options of new axes for a panel."""
    return {"projection": "3d"} if panel.z_label else {}


def draw_panel(axes: Any, panel: Panel) -> None:
    """Draw a panel into axes of matplotlib, of three dimensions where it is in space."""
    draw_marks(axes, panel.items)
    if panel.z_label:
        _fill_box(axes)
    elif panel.equal:
        axes.set_aspect("equal", adjustable="datalim")
    elif panel.from_zero and axes.dataLim.y0 >= 0.0:
        axes.set_ylim(0.0)
    for name in panel.axes:
        axis, label = getattr(axes, f"{name}axis"), for_paper(getattr(panel, f"{name}_label"))
        axis.set_label_text(label)
        if name in panel.ticks:
            texts = [for_paper(text) for text in panel.ticks[name]]
            axis.set_ticks(range(len(texts)), texts)
            axes.grid(visible=False, axis=name)
        elif name + panel.z_label == "x" or name in panel.whole:  # few, as numbers may be wide
            steps = [1.0, 2.0, 2.5, 5.0, 10.0]
            axis.set_major_locator(MaxNLocator(6, steps=steps, integer=name in panel.whole))
        if limits := getattr(panel, f"{name}_range"):
            getattr(axes, f"set_{name}lim")(*limits)
    if panel.title:
        axes.set_title(for_paper(panel.title), loc="left")
    entries: dict[str, Any] = {}
    for handle, name in zip(*axes.get_legend_handles_labels(), strict=True):
        entries.setdefault(name, handle)
    if not (panel.legend and entries):
        return
    # In space the labels of the vertical axis are beside it too.
    corner = (1.25 if panel.z_label else 1.0, 1.0)
    place: dict[str, Any] = {
        INSIDE: {"loc": "best"},
        BELOW: {"loc": "upper center", "bbox_to_anchor": (0.5, -0.085)},
        BESIDE: {"loc": "upper left", "bbox_to_anchor": corner, "borderaxespad": 0.2},
    }[panel.legend]
    axes.legend(entries.values(), entries, **place)


def _fill_box(axes: Any) -> None:
    """Give three axes one scale, each at least a third as long as the longest."""
    three = (axes.xaxis, axes.yaxis, axes.zaxis)
    ends = np.array([axis.get_view_interval() for axis in three])
    extent = np.maximum(np.ptp(ends, axis=1), np.ptp(ends, axis=1).max() / 3.0)
    for axis, middle, part in zip(three, ends.mean(axis=1), extent, strict=True):
        axis.set_view_interval(middle - 0.5 * part, middle + 0.5 * part, ignore=True)
        axis.set_major_locator(MaxNLocator(round(6.0 * part / extent.max())))
    axes.zaxis.labelpad = 12.0
    axes.set_box_aspect(extent, zoom=0.92)
    axes.view_init(elev=18.0, azim=-60.0)


def draw_marks(axes: Any, marks: Any) -> None:
    """Draw marks into axes of matplotlib."""
    faces = [mark for mark in marks if isinstance(mark, Faces)]
    if faces:  # in one collection, so that all of them are sorted by their distance
        corners = np.concatenate([mark.corners for mark in faces])
        colours = [mark.colour for mark in faces for _ in mark.corners]
        axes.add_collection3d(Poly3DCollection(corners, facecolors=colours, shade=True))
        axes.auto_scale_xyz(*corners.reshape(-1, 3).T)
    for mark in marks:
        _draw(axes, mark)
    if axes.name != "3d":
        axes.autoscale_view()


def _draw(axes: Any, mark: Mark) -> None:
    named: dict[str, Any] = {"label": for_paper(mark.name) or None}
    match mark:
        case Curve():
            rows = mark.rows if len(mark.rows) else np.zeros((0, 3 if axes.name == "3d" else 2))
            axes.plot(*rows.T, **_line_style(mark))
        case Area():
            for polygon in mark.polygons:
                axes.add_patch(_polygon(mark, polygon))
        case Faces():
            style = {"color": mark.colour, "linewidth": 5.0}
            axes.plot([], [], [], **style, **named)
        case Arrow():
            _draw_arrow(axes, mark, named)
        case Span():
            way, style = "v" if mark.axis == "x" else "h", named | {"color": mark.colour}
            if mark.high is None:
                style |= {"linestyle": _dashes(mark), "linewidth": mark.width}
                getattr(axes, f"ax{way}line")(mark.low, zorder=mark.layer, **style)
            else:
                style |= {"alpha": mark.opacity, "linewidth": 0.0}
                getattr(axes, f"ax{way}span")(mark.low, mark.high, **style)
        case Note():
            _write(axes, mark)
        case _:
            raise NotImplementedError(f"matplotlib draws no {type(mark).__name__}")


def _legend_entry(mark: Curve | Area) -> Any:
    if isinstance(mark, Curve):
        return Line2D([], [], **_line_style(mark))
    return _polygon(mark, np.zeros((1, 2)))


def _polygon(mark: Area, points: Any) -> Polygon:
    return Polygon(
        points,
        facecolor=(*rgb(mark.face or mark.colour), mark.opacity),
        edgecolor=mark.colour,
        linewidth=mark.width,
        joinstyle="round",
        zorder=mark.layer,
        label=for_paper(mark.name) or None,
    )


def _dashes(mark: Curve | Span) -> Any:
    return "" if mark.dash is None else (0, mark.dash) if mark.dash else "-"


def _line_style(mark: Curve) -> dict[str, Any]:
    return {
        "color": mark.colour,
        "linestyle": _dashes(mark),
        "linewidth": mark.width,
        "marker": mark.marker or None,
        "markersize": mark.size,
        "markerfacecolor": "none" if mark.hollow else mark.colour,
        "markeredgewidth": 0.8 if mark.hollow else None,
        "zorder": mark.layer,
        "label": for_paper(mark.name),
    }


def _draw_arrow(axes: Any, mark: Arrow, named: dict[str, Any]) -> None:
    *_, start, end = points = np.asarray(mark.points, float)
    style: dict[str, Any] = {"color": mark.colour, "linewidth": mark.width}
    if len(end) == 3:
        axes.quiver(*start, *(end - start), **named, **style)
        return
    axes.plot(*points[:-1].T, zorder=mark.layer, **style)
    head: dict[str, Any] = {"arrowstyle": "-|>", "mutation_scale": mark.head}
    head |= {"shrinkA": 0.0, "shrinkB": 0.0, "zorder": mark.layer}
    axes.add_patch(FancyArrowPatch(tuple(start), tuple(end), **head, **style))
    axes.update_datalim(points)
    if mark.name:
        axes.plot([], [], color=mark.colour, marker=">", markersize=4.0, **named)


def _write(axes: Any, mark: Note) -> None:
    style: dict[str, Any] = dict(zip(("ha", "va"), mark.align.split(), strict=True))
    style |= {"fontsize": mark.size, "color": mark.colour, "zorder": mark.layer}
    style |= {"fontweight": "bold" if mark.bold else "normal", "rotation": 90.0 * mark.turned}
    style["linespacing"] = 1.05
    if mark.inside:
        style["transform"] = axes.transAxes
    else:
        style["bbox"] = {"facecolor": "white", "edgecolor": "none", "pad": 0.6}
    (axes.text2D if axes.name == "3d" else axes.text)(*mark.at, for_paper(mark.text), **style)
