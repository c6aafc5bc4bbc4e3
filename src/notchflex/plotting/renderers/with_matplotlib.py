"""A picture drawn by matplotlib, for paper."""

from __future__ import annotations

from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import FancyArrowPatch, Polygon
from matplotlib.ticker import MaxNLocator
from mpl_toolkits.mplot3d.art3d import Poly3DCollection

from notchflex.plotting.output import Picture
from notchflex.plotting.renderers.labels import for_paper, heading_lines, translated
from notchflex.plotting.sheet import (
    BELOW,
    BESIDE,
    Area,
    Arrow,
    Bars,
    Correlations,
    Faces,
    Level,
    Line,
    Note,
    Panel,
    Stripe,
    Upright,
)
from notchflex.plotting.style import DIVERGING, house_style, new_figure, rgb

ELEVATION, AZIMUTH = 18.0, -60.0


def figure_of(picture: Picture) -> Figure:
    """Return a picture as a figure of matplotlib."""
    heading = heading_lines(picture.title, picture.width)
    picture = translated(picture, for_paper)
    with house_style():
        title = "\n".join(map(for_paper, heading))
        figure = new_figure(picture.width, picture.height, title)
        grid = figure.add_gridspec(*picture.shape)
        scales: dict[str, list[Axes]] = {}
        shared: dict[str, Axes] = {}
        for cell in picture.cells:
            panel = cell.panel
            place = grid[slice(*cell.rows), slice(*cell.columns)]
            options: dict[str, Any] = {"projection": "3d"} if panel.in_space else {}
            sharing = [name for name in "xy" if getattr(panel, f"shared_{name}")]
            options |= {f"share{name}": shared.get(name) for name in sharing}
            axes: Any = figure.add_subplot(place, **options)
            for name in sharing:
                shared.setdefault(name, axes)
            _draw_panel(axes, panel)
            if panel.scale:
                scales.setdefault(panel.scale, []).append(axes)
        # matplotlib shares no axes of equal scale, so that each learns what the others show.
        for group in scales.values():
            for axes in group:
                for other in group:
                    axes.update_datalim(other.dataLim.get_points())
                axes.autoscale_view()
        if picture.legend:
            entries = [
                _line_2d(one)
                if isinstance(one, Line)
                else _polygon(one, np.zeros((1, 2)), one.name)
                for one in picture.legend
            ]
            columns = _columns([one.name for one in picture.legend], picture.width)
            figure.legend(handles=entries, loc="outside lower center", ncols=columns)
    return figure


def _columns(names: list[str], width: float) -> int:
    """How many columns a legend has, 8 at most, to be no wider than its picture [in]."""
    # Room for the mark and the gap, and the mean width of a letter of 8 points.
    wide = [0.55 + 0.068 * len(name) for name in names]
    for columns in range(min(8, len(names)), 1, -1):
        if sum(part.max() for part in np.array_split(wide, columns)) <= width:
            return columns
    return 1


def draw_panel(axes: Any, panel: Panel) -> None:
    """Draw a panel into axes of matplotlib, of three dimensions where it is in space."""
    _draw_panel(axes, translated(panel, for_paper))


def _draw_panel(axes: Any, panel: Panel) -> None:
    faces = [item for item in panel.items if isinstance(item, Faces)]
    if faces:
        _draw_faces(axes, faces)
    for item in panel.items:
        _draw(axes, item)
    if panel.in_space:
        _equal_in_space(axes, panel)
        axes.view_init(elev=ELEVATION, azim=AZIMUTH)
        axes.set_zlabel(panel.z_label, labelpad=12.0)
    else:
        axes.autoscale_view()
    if panel.equal:
        axes.set_aspect("equal", adjustable="datalim")
    axes.set_xlabel(panel.x_label)
    axes.set_ylabel(panel.y_label)
    if panel.title:
        axes.set_title(panel.title, loc="left")
    for name, wanted, whole in (
        ("x", panel.x_range, panel.whole_x),
        ("y", panel.y_range, panel.whole_y),
    ):
        if whole:
            getattr(axes, f"{name}axis").set_major_locator(MaxNLocator(integer=True))
        if name == "x" and panel.most_x is not None:
            axes.locator_params(axis="x", nbins=panel.most_x)
        if wanted is not None:
            getattr(axes, f"set_{name}lim")(*wanted)
    if panel.legend == BELOW:  # axes of three dimensions have no empty corner
        axes.legend(loc="upper center", bbox_to_anchor=(0.5, -0.06), ncols=2)
    elif panel.legend == BESIDE:
        # In space the numbers and the name of the upright axis stand there too.
        at = (1.25, 1.0) if panel.in_space else (1.0, 1.0)
        axes.legend(loc="upper left", bbox_to_anchor=at, borderaxespad=0.2)
    elif panel.legend:
        axes.legend(loc="best")


def _draw(axes: Any, item: Any) -> None:
    match item:
        case Line():
            axes.add_line(_line(axes, item))
            if item.half is not None:
                x, y = item.rows.T
                bars: dict[str, Any] = {"ecolor": item.colour, "elinewidth": 0.7}
                half = np.nan_to_num(item.half)  # no bar has no height
                axes.errorbar(x, y, yerr=half, fmt="none", zorder=item.layer, **bars)
        case Area():
            for index, polygon in enumerate(item.polygons):
                axes.add_patch(_polygon(item, polygon, "" if index else item.name))
        case Arrow():
            _draw_arrow(axes, item)
        case Upright():
            axes.axvline(item.at, **_straight(item))
        case Level():
            axes.axhline(item.at, **_straight(item))
        case Stripe():
            look: dict[str, Any] = {"color": item.colour, "alpha": item.opacity, "linewidth": 0.0}
            axes.axhspan(item.low, item.high, label=item.name or None, **look)
        case Bars():
            _draw_bars(axes, item)
        case Correlations():
            _draw_correlations(axes, item)
        case Note():
            place = (0.03, 0.95, item.text) if item.corner else (0.5, 0.5, item.text)
            aligned = {"va": "top"} if item.corner else {"ha": "center"}
            axes.text(*place, transform=axes.transAxes, color=item.colour, **aligned)
        case _:
            pass  # faces are drawn together, before


def _line(axes: Any, item: Line) -> Any:
    """A line of the axes, in space where it has three coordinates."""
    made = _line_2d(item)
    points = item.rows
    if not len(points):
        if axes.name == "3d":
            from mpl_toolkits.mplot3d.art3d import line_2d_to_3d

            line_2d_to_3d(made)
    elif points.shape[1] == 3:
        from mpl_toolkits.mplot3d.art3d import Line3D

        space = Line3D(*points.T)
        space.update_from(made)
        space.set_label(made.get_label())
        return space
    else:
        made.set_data(*points.T)
    return made


def _polygon(item: Area, points: Any, name: str) -> Polygon:
    return Polygon(
        points,
        facecolor=(*rgb(item.face), item.opacity),
        edgecolor=item.edge,
        linewidth=item.width,
        joinstyle="round",
        zorder=item.layer,
        label=name or None,
    )


def _straight(item: Upright | Level) -> dict[str, Any]:
    return {
        "color": item.colour, "linestyle": _dashes(item.dash), "linewidth": item.width,
        "label": item.name or None,
    }  # fmt: skip


def _dashes(dash: tuple[float, ...]) -> Any:
    return (0, dash) if dash else "-"


def _line_2d(item: Line) -> Any:
    from matplotlib.lines import Line2D

    colour: Any = item.colour
    style: Any = "" if item.dash is None else _dashes(item.dash)
    options: dict[str, Any] = {"label": item.name} if item.name else {}
    if item.blunt:
        options["solid_capstyle"] = "butt"
    return Line2D(
        [],
        [],
        color=colour,
        linestyle=style,
        linewidth=item.width,
        marker=item.marker or None,
        markersize=item.size,
        markerfacecolor="none" if item.hollow else colour,
        markeredgewidth=0.8 if item.hollow else None,
        zorder=item.layer,
        **options,
    )


def _draw_arrow(axes: Any, item: Arrow) -> None:
    start, end = np.asarray(item.start, float), np.asarray(item.end, float)
    label = item.name or None
    if len(start) == 3:
        axes.quiver(*start, *(end - start), color=item.colour, linewidth=item.width, label=label)
        return
    axes.add_patch(
        FancyArrowPatch(
            tuple(start),
            tuple(end),
            arrowstyle="-|>",
            connectionstyle=f"arc3,rad={item.bend}",
            mutation_scale=9.0,
            shrinkA=0.0,
            shrinkB=0.0,
            color=item.colour,
            linewidth=item.width,
            zorder=item.layer,
        )
    )
    axes.update_datalim(np.stack([start, end]) if item.reach is None else item.reach)
    if label:
        axes.plot([], [], color=item.colour, marker=">", markersize=4.0, label=label)


def _draw_bars(axes: Any, item: Bars) -> None:
    places = np.arange(len(item.values))
    bars = axes.barh(places, item.values, color=item.colours, height=0.6)
    axes.bar_label(bars, fmt=f"{{:{item.form}}}", padding=3, fontsize=8.0)
    axes.set_yticks(places, list(item.names))
    axes.invert_yaxis()
    axes.grid(visible=False, axis="y")


def _draw_correlations(axes: Any, item: Correlations) -> None:
    axes.imshow(item.values, cmap=DIVERGING, vmin=-1.0, vmax=1.0)
    texts = item.texts
    for (row, column), value in np.ndenumerate(item.values):
        shade = "white" if abs(value) > 0.7 else "black"
        look: dict[str, Any] = {"fontsize": item.letters, "color": shade}
        axes.text(column, row, texts[row][column], ha="center", va="center", **look)
    places = range(len(item.names))
    axes.set_xticks(places, [str(number + 1) for number in places], fontsize=item.outer_letters)
    axes.set_yticks(places, list(item.rows), fontsize=item.outer_letters)
    axes.grid(visible=False)


def _draw_faces(axes: Any, faces: list[Faces]) -> None:
    # In one collection, so that all pieces are sorted by how far away they are.
    together = np.concatenate([one.corners for one in faces])
    colours = [colour for one in faces for colour in one.colours]
    axes.add_collection3d(
        Poly3DCollection(together, facecolors=colours, edgecolors=colours, linewidths=0.2)
    )
    for one in faces:
        if one.name:
            axes.plot([], [], [], color=one.colour, linewidth=5.0, label=one.name)


def _equal_in_space(axes: Any, panel: Panel) -> None:
    points = [
        np.asarray(corners, float).reshape(-1, 3)
        for item in panel.items
        for corners in _corners(item)
    ]
    if not points:
        return
    every = np.concatenate(points)
    low, high = every.min(axis=0), every.max(axis=0)
    room = 0.02 * float((high - low).max())
    for name, first, last in zip("xyz", low - room, high + room, strict=True):
        getattr(axes, f"set_{name}lim")(first, last)
        axis = getattr(axes, f"{name}axis")
        part = (last - first) / (high - low).max()
        axis.set_major_locator(MaxNLocator(nbins=max(2, round(6 * part))))
    axes.set_box_aspect(high - low + 2.0 * room, zoom=0.92)


def _corners(item: Any) -> list[Any]:
    if isinstance(item, Faces):
        return [item.corners]
    return [item.start, item.end] if isinstance(item, Arrow) else []
