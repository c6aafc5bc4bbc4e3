"""Draws a picture with plotly: one HTML file that needs no network.

matplotlib arranges the panels, limits and legends; plotly draws the marks there.
"""

from __future__ import annotations

from collections.abc import Iterator
from html import escape
from pathlib import Path as FilePath
from typing import Any

import numpy as np

from notchflex.plotting.marks import (
    Area,
    Arrow,
    Curve,
    Faces,
    Mark,
    Note,
    Panel,
    Sheet,
    Span,
    box,
)
from notchflex.plotting.style import for_browser, heading_lines, rgb
from notchflex.plotting.with_matplotlib import figure_of
from notchflex.support import need, write_text

Layout = dict[str, Any]
"""A trace, a layout or a part of it, as plotly takes it."""

INCH = 100.0
"""Pixels for an inch of paper, if the window is as wide as the picture."""
POINT = INCH / 72.0
"""Pixels for a point."""

_SYMBOLS = {
    "o": "circle", "s": "square", "^": "triangle-up", "D": "diamond", "v": "triangle-down",
    "P": "cross", "*": "star", "X": "x",
}  # fmt: skip


def interactive_of(picture: Sheet) -> Any:
    """Return a picture as a figure of plotly.

    Raises:
        InputError: plotly is not installed.
    """
    need("plotly", "plot", "an interactive picture")
    import plotly.graph_objects as go

    paper = figure_of(picture)
    paper.draw_without_rendering()  # arranges everything
    width, height = (INCH * side for side in picture.size)
    heading = heading_lines(picture.title, picture.size[0])
    layout: Layout = {
        "font": {"size": 9.0 * POINT, "family": "DejaVu Sans, Verdana, sans-serif"},
        "template": "simple_white", "hovermode": "closest", "annotations": [],
        # The width is that of the window; `meta` holds the one of the arrangement.
        "autosize": True, "height": height, "meta": {"width": width},
        "margin": {"t": 0, "b": 0, "l": 0, "r": 0},
        "title": {
            "text": "<br>".join(map(for_browser, heading)), "x": 0.5, "font": {"size": 17},
            "yref": "container", "y": 1.0 - 8.0 / height, "yanchor": "top",
        },
    }  # fmt: skip
    traces: list[Layout] = []
    for number, (cell, axes) in enumerate(zip(picture.cells, paper.axes, strict=True), 1):
        panel = cell.panel
        where = _add_axes(panel, axes, str(number) if number > 1 else "", layout)
        where |= _add_legend(axes.get_legend(), f"legend{number + 1}", layout)
        named = {""}
        for mark in sorted(panel.items, key=lambda mark: mark.layer):
            for trace in _traces(mark, panel, where, layout):
                traces.append(trace | {"showlegend": mark.name not in named} | where)
                named.add(mark.name)
    for legend in paper.legends:
        _add_legend(legend, "legend", layout)
        layout["legend"] |= {"orientation": "h", "x": 0.5, "xanchor": "center"}
        traces += (
            _entry(mark) | {"legend": "legend", "showlegend": True} for mark in picture.legend
        )
    return go.Figure(traces, layout)


def save_html(picture: Sheet, target: str | FilePath) -> None:
    """Write a picture as one HTML file that works without a network.

    Raises:
        InputError: plotly is not installed, or the file cannot be written.
    """
    config = {"displaylogo": False, "responsive": True, "toImageButtonOptions": {"format": "svg"}}
    # With a fixed name of the element the same picture gives the same file.
    text = interactive_of(picture).to_html(div_id="notchflex", default_width="100%", config=config)
    # It shrinks with its window to three quarters of its width; below it is scrolled.
    narrowest = round(0.75 * INCH * picture.size[0])
    head = f"<head><title>{escape(picture.title)}</title>"
    head += f"<style>#notchflex {{min-width: {narrowest}px}}</style>"
    write_text(target, text.replace("<head>", head, 1))


def chart_of(panel: Panel) -> Any:
    """Return a panel in the plane alone, small, as a figure of plotly whose axes include 0.

    Example:
        >>> from notchflex.plotting import line
        >>> figure = chart_of(Panel([line([0.0, 2.0], [0.0, 90.0], "#0072B2")], "x", "y"))
        >>> figure.layout.xaxis.title.text
        'x'
    """
    import plotly.graph_objects as go

    layout: Layout = {
        "template": "none", "font": {"size": 10}, "showlegend": False, "hovermode": "closest",
        "margin": {"t": 8, "r": 10, "b": 38, "l": 46},
    }  # fmt: skip
    for name in panel.axes:
        title = {"text": for_browser(getattr(panel, f"{name}_label")), "standoff": 6}
        layout[f"{name}axis"] = {"title": title, "rangemode": "tozero", "nticks": 6}
    traces = [trace for mark in panel.items for trace in _traces(mark, panel, {}, layout)]
    return go.Figure(traces, layout)


def _add_axes(panel: Panel, axes: Any, number: str, layout: Layout) -> Layout:
    """Add the axes of a panel where matplotlib has them; return where its traces belong."""
    box = axes.get_position()
    domain = {"x": [box.x0, box.x1], "y": [box.y0, box.y1]}
    if panel.title:
        layout["annotations"].append(
            {"text": for_browser(panel.title), "x": box.x0, "xref": "paper", "xanchor": "left",
             "y": box.y1, "yref": "paper", "yanchor": "bottom", "showarrow": False}
        )  # fmt: skip
    scales: dict[str, Any] = {}
    for name in panel.axes:
        label, limits = getattr(panel, f"{name}_label"), getattr(axes, f"get_{name}lim")()
        scales[f"{name}axis"] = {
            "title": {"text": for_browser(label), "font": {"size": 9.0 * POINT}},
            "gridcolor": "#e6e6e6", "showgrid": True, "range": list(limits), "nticks": 8,
            "tickformat": "d" if name in panel.whole else "",
        }  # fmt: skip
        if texts := [for_browser(text) for text in panel.ticks.get(name, ())]:
            scales[f"{name}axis"] |= {"tickvals": [*range(len(texts))], "ticktext": texts}
            scales[f"{name}axis"] |= {"showgrid": False, "ticks": ""}
    if panel.z_label:
        layout[f"scene{number}"] = {
            "domain": domain, "aspectmode": "data", **scales,
            "camera": {"eye": {"x": 0.8, "y": -1.7, "z": 0.55}},
        }  # fmt: skip
        return {"scene": f"scene{number}"}
    for name, across in ("xy", "yx"):
        scale = scales[f"{name}axis"] | {"domain": domain[name], "anchor": across + number}
        scale["title"]["standoff"] = 6
        if name in panel.shared and not panel.equal:
            first = layout["meta"].setdefault(name, name + number)
            scale |= {"matches": first} if first != name + number else {}
        if panel.equal and name == "y":
            scale["scaleanchor"] = f"x{number}"
        layout[f"{name}axis{number}"] = scale
    return {"xaxis": f"x{number}", "yaxis": f"y{number}"}


def _add_legend(legend: Any, name: str, layout: Layout) -> Layout:
    """Add a legend where matplotlib has it; return what its traces have for it."""
    if legend is None:
        return {"showlegend": False}
    box = legend.get_window_extent().transformed(legend.figure.transFigure.inverted())
    layout[name] = {
        "x": box.x0, "xanchor": "left", "y": box.y1, "yanchor": "top", "indentation": -4,
        "font": {"size": 7.5 * POINT}, "bgcolor": "rgba(255,255,255,0.7)", "tracegroupgap": 0,
    }  # fmt: skip
    return {"legend": name}


def _traces(mark: Mark, panel: Panel, where: Layout, layout: Layout) -> Iterator[Layout]:
    """Yield the traces of a mark; texts are added to `layout`."""
    match mark:
        case Curve() | Area():
            yield _entry(mark, panel)
        case Faces():
            yield _mesh(mark)
        case Arrow():
            yield from _arrow(mark)
        case Span():  # over all that the panel shows
            # What a trace calls y2 is yaxis2 in the layout.
            over = "yaxis" if mark.axis == "x" else "xaxis"
            ends = layout[over + where[over][1:]]["range"]
            high = mark.low if mark.high is None else mark.high
            corners = box(mark.low, ends[0], high, ends[1])
            corners = corners if mark.axis == "x" else corners[:, ::-1]
            style: Layout = {"name": mark.name, "group": mark.group}
            if mark.high is None:
                yield _line(Curve(corners[1:3], mark.colour, mark.dash, mark.width, **style), panel)
            else:
                yield _area(Area([corners], mark.colour, mark.opacity, **style))
        case Note():
            anchor = mark.align.replace("center", "middle").split()
            part = " domain" if mark.inside else ""
            layout["annotations"].append(
                {"text": for_browser(mark.text), "x": mark.at[0], "y": mark.at[1],
                 "xref": where["xaxis"] + part, "yref": where["yaxis"] + part,
                 "xanchor": anchor[0].replace("middle", "center"), "yanchor": anchor[1],
                 "font": {"color": css(mark.colour), "size": POINT * mark.size},
                 "textangle": -90.0 * mark.turned, "showarrow": False}
            )  # fmt: skip
        case _:
            raise NotImplementedError(f"plotly draws no {type(mark).__name__}")


def _entry(mark: Curve | Area, panel: Panel | None = None) -> Layout:
    """Return a curve or an area as a trace; without a panel it is only the entry of a legend."""
    return _area(mark) if isinstance(mark, Area) else _line(mark, panel or Panel([], "", ""))


def _line(mark: Curve, panel: Panel) -> Layout:
    rows = mark.rows if len(mark.rows) else np.full((1, len(panel.axes)), np.nan)
    colour, symbol = css(mark.colour), _SYMBOLS.get(mark.marker, "circle")
    labels = [for_browser(getattr(panel, f"{name}_label")) for name in panel.axes]
    hover = [f"{label}: %{{{name}:.4g}}" for name, label in zip(panel.axes, labels, strict=True)]
    trace: Layout = {
        "type": "scatter3d" if panel.z_label else "scatter",
        **dict(zip("xyz", rows.T, strict=False)),
        "mode": "+".join(["lines"] * (mark.dash is not None) + ["markers"] * bool(mark.marker)),
        "line": {"color": colour, "width": POINT * mark.width},
        "marker": {"size": POINT * mark.size, "color": colour,
                   "symbol": f"{symbol}-open" if mark.hollow else symbol},
        "hovertemplate": "<br>".join([for_browser(mark.name or mark.group), *hover]),
        **_named(mark),
    }  # fmt: skip
    if mark.dash and not panel.z_label:
        dashes = [f"{POINT * mark.width * length:.1f}px" for length in mark.dash]
        trace["line"]["dash"] = ",".join(dashes)
    trace["hovertemplate"] += "<extra></extra>"
    return trace


def _area(mark: Area) -> Layout:
    """Return polygons as a trace, closed and with a gap behind each."""
    gap = np.full((1, 2), np.nan)
    rows = [part for ring in mark.polygons for part in (ring, ring[:1], gap)]
    x, y = np.concatenate(rows or [gap]).T
    return {
        "type": "scatter", "mode": "lines", "fill": "toself", "x": x, "y": y, "hoverinfo": "name",
        "hoveron": "fills", "fillcolor": css(mark.face or mark.colour, mark.opacity),
        "line": {"color": css(mark.colour), "width": POINT * mark.width}, **_named(mark),
    }  # fmt: skip


def _mesh(mark: Faces) -> Layout:
    first = 4 * np.arange(len(mark.corners))
    triangles = np.repeat(first, 2), *(np.ravel([first + a, first + a + 1], "F") for a in (1, 2))
    return {
        "type": "mesh3d", **dict(zip("xyz", mark.corners.reshape(-1, 3).T, strict=True)),
        **dict(zip("ijk", triangles, strict=True)), "flatshading": True, "hoverinfo": "skip",
        "color": css(mark.colour), **_named(mark),
    }  # fmt: skip


def _arrow(mark: Arrow) -> Iterator[Layout]:
    points, colour = np.asarray(mark.points, float), css(mark.colour)
    line = {"color": colour, "width": POINT * mark.width}
    style: Layout = {
        "hoverinfo": "skip",
        **_named(mark),
        **dict(zip("xyz", points.T, strict=False)),
    }
    if points.shape[1] == 2:
        sizes = [0.0] * (len(points) - 1) + [1.2 * mark.head]
        head = {"symbol": "arrow", "angleref": "previous", "color": colour, "size": sizes}
        yield style | {"type": "scatter", "mode": "lines+markers", "line": line, "marker": head}
        return
    yield style | {"type": "scatter3d", "mode": "lines", "line": line}
    step = 0.3 * (points[1:] - points[:1])
    yield style | dict(zip("xyzuvw", np.append(points[1:], step, axis=1).T, strict=True)) | {
        "type": "cone", "anchor": "tip", "sizemode": "raw", "showscale": False,
        "colorscale": [[0, colour], [1, colour]],
    }  # fmt: skip


def _named(mark: Mark) -> Layout:
    """Return the legend entry of a mark, and the group with which it is shown and hidden."""
    group = for_browser(mark.group or mark.name)
    return {"name": for_browser(mark.name) or group} | ({"legendgroup": group} if group else {})


def css(colour: Any, opacity: float = 1.0) -> str:
    """Return a colour as HTML takes it."""
    red, green, blue = (round(255 * part) for part in rgb(colour))
    return f"rgba({red},{green},{blue},{opacity:g})"
