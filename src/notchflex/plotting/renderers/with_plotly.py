"""Draws a picture with plotly: one HTML file that needs no network.

matplotlib arranges the panels, limits and legends; `plotly_marks.py` draws the marks there.
"""

from __future__ import annotations

from collections.abc import Iterator
from html import escape
from pathlib import Path as FilePath
from typing import Any

import numpy as np

from notchflex.plotting.renderers.with_matplotlib import figure_of
from notchflex.plotting.sheet import (
    Area,
    Arrow,
    Bars,
    Correlations,
    Curve,
    Faces,
    Mark,
    Note,
    Panel,
    Sheet,
    Span,
)
from notchflex.plotting.style import diverging_colours, for_browser, heading_lines, rgb
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


def traces(item: Mark, panel: Panel, where: Layout, layout: Layout) -> Iterator[Layout]:
    """Yield the traces of a mark; shapes, notes and tick labels are added to `layout`."""
    match item:
        case Curve() | Area():
            yield entry_trace(item, panel)
        case Faces():
            yield _mesh(item)
        case Arrow():
            yield from _arrow(item)
        case Span():
            layout["shapes"].append(_shape(item, where))
            if item.name:  # a shape has no entry in a legend
                style: Layout = {"name": item.name, "group": item.group or item.name}
                line = Curve([], item.colour, item.dash, item.width, **style)
                band = Area([], item.colour, item.colour, item.opacity, 0.0, **style)
                yield entry_trace(line if item.low == item.high else band)
        case Bars():
            yield _bars(item, _axis(layout, where, "y"))
        case Correlations():
            yield _correlations(item, where, layout)
        case Note():
            anchor: Layout = {"x": 0.5, "y": 0.5}
            if item.corner:
                anchor = {"x": 0.03, "y": 0.95, "xanchor": "left", "yanchor": "top"}
            layout["annotations"].append(
                {"text": for_browser(item.text), "font": {"color": css(item.colour)}, **anchor,
                 "xref": f"{where['xaxis']} domain", "yref": f"{where['yaxis']} domain",
                 "showarrow": False}
            )  # fmt: skip
        case _:
            raise NotImplementedError(f"plotly draws no {type(item).__name__}")


def entry_trace(item: Curve | Area, panel: Panel | None = None) -> Layout:
    """Return a line or an area as a trace; without a panel it is only the entry of a legend."""
    return _area(item) if isinstance(item, Area) else _line(item, panel)


def _line(item: Curve, panel: Panel | None) -> Layout:
    in_space = panel is not None and panel.in_space
    rows = item.rows if len(item.rows) else np.full((1, 3 if in_space else 2), np.nan)
    colour = css(item.colour)
    symbol = _SYMBOLS.get(item.marker, "circle")
    trace: Layout = {
        "type": "scatter3d" if in_space else "scatter", **dict(zip("xyz", rows.T, strict=False)),
        "mode": "+".join(["lines"] * (item.dash is not None) + ["markers"] * bool(item.marker)),
        "line": {"color": colour, "width": POINT * item.width * (2 if in_space else 1)},
        "marker": {"size": POINT * item.size, "color": colour,
                   "symbol": f"{symbol}-open" if item.hollow else symbol},
        "hoverinfo": "skip", **_named(item),
    }  # fmt: skip
    if item.dash and not in_space:
        trace["line"]["dash"] = _dashes(item)
    if item.error is not None:
        trace["error_y"] = {
            "type": "data", "array": np.asarray(item.error), "width": 0, "thickness": POINT * 0.7,
            "color": colour,
        }  # fmt: skip
        trace["text"] = [f" ± {one:.2g}" if np.isfinite(one) else "" for one in item.error]
    if item.hover and panel is not None:
        name, x, y = map(for_browser, (item.name or item.group, panel.x_label, panel.y_label))
        error = "" if item.error is None else "%{text}"
        hover = f"{name}<br>{x}: %{{x:.4g}}<br>{y}: %{{y:.4g}}{error}<extra></extra>"
        trace |= {"hoverinfo": "all", "hovertemplate": hover}
    return trace


def _area(item: Area) -> Layout:
    """Return polygons as a trace, closed and with a gap behind each."""
    gap = np.full((1, 2), np.nan)
    rows = np.concatenate([gap, *(part for one in item.polygons for part in (one, one[:1], gap))])
    return {
        "type": "scatter", "mode": "lines", "fill": "toself", "x": rows[1:, 0], "y": rows[1:, 1],
        "fillcolor": css(item.face, item.opacity),
        "line": {"color": css(item.edge), "width": POINT * item.width},
        "hoverinfo": "skip", **_named(item),
    }  # fmt: skip


def _mesh(item: Faces) -> Layout:
    corners = item.corners.reshape(-1, 3)
    first = 4 * np.arange(len(item.corners))
    triangles = np.concatenate(
        [np.stack([first, first + 1, first + 2]), np.stack([first, first + 2, first + 3])], axis=1
    )
    return {
        "type": "mesh3d", **dict(zip("xyz", corners.T, strict=True)),
        **dict(zip("ijk", triangles, strict=True)),
        "facecolor": [css(colour) for colour in item.colours] * 2, "flatshading": True,
        "lighting": {"ambient": 1.0, "diffuse": 0.0, "specular": 0.0}, "hoverinfo": "skip",
        # The faces have colours of their own; this one is that of the legend.
        "color": css(item.colour), **_named(item),
    }  # fmt: skip


def _arrow(item: Arrow) -> Iterator[Layout]:
    start, end = np.asarray(item.start, float), np.asarray(item.end, float)
    step, colour = end - start, css(item.colour)
    style: Layout = {"hoverinfo": "skip", **_named(item)}
    if len(start) == 3:
        ends = zip("xyz", np.stack([start, end]).T, strict=True)
        line = {"color": colour, "width": 3.0 * item.width}
        yield {"type": "scatter3d", "mode": "lines", "line": line, **dict(ends), **style}
        yield {
            "type": "cone", "anchor": "tip", "sizemode": "raw", "showscale": False,
            "colorscale": [[0, colour], [1, colour]], "hoverinfo": "skip", "showlegend": False,
            **dict(zip("xyzuvw", np.concatenate([end, 0.3 * step])[:, None], strict=True)),
        }  # fmt: skip
        return
    # As matplotlib's arc3: a parabola whose control point is offset by `bend` of the length.
    control = 0.5 * (start + end) + item.bend * np.array([step[1], -step[0]])
    part = np.linspace(0.0, 1.0, 21)[:, None]
    curve = (1 - part) ** 2 * start + 2 * part * (1 - part) * control + part**2 * end
    yield {
        "type": "scatter", "mode": "lines+markers", "x": curve[:, 0], "y": curve[:, 1],
        "line": {"color": colour, "width": POINT * item.width},
        "marker": {"symbol": "arrow", "angleref": "previous", "color": colour,
                   "size": [0.0] * 20 + [11.0]}, **style,
    }  # fmt: skip


def _shape(item: Span, where: Layout) -> Layout:
    """Return what goes across the whole panel; it is shown and hidden with its group."""
    along, across = ("x", "y") if item.axis == "x" else ("y", "x")
    shape: Layout = {
        f"{along}0": item.low, f"{along}1": item.high, f"{along}ref": where[f"{along}axis"],
        f"{across}0": 0, f"{across}1": 1, f"{across}ref": f"{where[f'{across}axis']} domain",
    }  # fmt: skip
    if group := item.group or item.name:
        shape["legendgroup"] = for_browser(group)
    if item.low == item.high:
        line = {"color": css(item.colour), "width": POINT * item.width}
        return shape | {"type": "line", "line": line | {"dash": _dashes(item) or "solid"}}
    fill = css(item.colour, item.opacity)
    return shape | {"type": "rect", "line": {"width": 0}, "layer": "below", "fillcolor": fill}


def _bars(item: Bars, axis: Layout) -> Layout:
    names = [for_browser(name) for name in item.names]
    axis |= {"tickvals": list(range(len(names))), "ticktext": names, "showgrid": False, "ticks": ""}
    return {
        "type": "bar", "orientation": "h", "x": list(item.values),
        "marker": {"color": [css(colour) for colour in item.colours]}, "width": 0.6,
        "text": [f"{value:.2f}" for value in item.values], "customdata": names,
        "textposition": "outside", "cliponaxis": False, "showlegend": False,
        "hovertemplate": "%{customdata}: %{x}<extra></extra>",
    }  # fmt: skip


def _correlations(item: Correlations, where: Layout, layout: Layout) -> Layout:
    names = [for_browser(name) for name in item.names]
    numbers = [str(number + 1) for number in range(len(names))]
    for name, texts in (("x", numbers), ("y", item.rows)):
        _axis(layout, where, name).update(
            tickvals=list(range(len(names))), ticktext=[for_browser(text) for text in texts],
            tickfont={"size": POINT * min(7.0, 3.1 * item.font_size)}, showgrid=False,
        )  # fmt: skip
    return {
        "type": "heatmap", "z": item.values, "zmin": -1.0, "zmax": 1.0, "showscale": False,
        "colorscale": [[i / 20, css(colour)] for i, colour in enumerate(diverging_colours(21))],
        "text": item.texts, "texttemplate": "%{text}",
        "textfont": {"size": POINT * item.font_size},
        "customdata": [[f"{one}<br>{other}" for other in names] for one in names],
        "hovertemplate": "%{customdata}<br>%{text}<extra></extra>",
    }  # fmt: skip


def _axis(layout: Layout, where: Layout, name: str) -> Layout:
    """Return the layout of the axis x or y of a panel, whose name for plotly is like x2."""
    return layout[f"{name}axis{where[f'{name}axis'][1:]}"]


def _named(item: Mark) -> Layout:
    """Return the legend entry of a mark, and the group with which it is shown and hidden."""
    group = for_browser(item.group)
    named = {"name": for_browser(item.name) or group, "showlegend": bool(item.name)}
    return named | ({"legendgroup": group} if group else {})


def _dashes(item: Curve | Span) -> str:
    return ",".join(f"{POINT * item.width * one:.1f}px" for one in item.dash or ())


def css(colour: Any, opacity: float = 1.0) -> str:
    """Return a colour as HTML takes it."""
    red, green, blue = (round(255 * part) for part in rgb(colour))
    return f"rgba({red},{green},{blue},{opacity:g})"


NARROWEST = 0.75
"""A picture shrinks with its window to this part of its width; below it is scrolled."""


def interactive_of(picture: Sheet) -> Any:
    """Return a picture as a figure of plotly.

    Raises:
        InputError: plotly is not installed.
    """
    need("plotly", "plot", "an interactive picture")
    import plotly.graph_objects as go

    paper = figure_of(picture)
    paper.draw_without_rendering()  # arranges everything
    width, height = INCH * picture.width, INCH * picture.height
    heading = heading_lines(picture.title, picture.width)
    layout: Layout = {
        "font": {"size": 9.0 * POINT, "family": "DejaVu Sans, Verdana, sans-serif",
                 "color": "#222"},
        "template": None, "paper_bgcolor": "white", "plot_bgcolor": "white",
        "hovermode": "closest", "margin": {"t": 0, "b": 0, "l": 0, "r": 0},
        # The width is that of the window; `meta` holds the one of the arrangement.
        "autosize": True, "height": height, "meta": {"width": width},
        "annotations": [], "shapes": [],
        "title": {
            "text": "<br>".join(map(for_browser, heading)), "x": 0.5, "font": {"size": 17},
            "yref": "container", "y": 1.0 - 8.0 / height, "yanchor": "top",
        },
    }  # fmt: skip
    figure = go.Figure()
    shared: dict[str, str] = {}
    for number, (cell, axes) in enumerate(zip(picture.cells, paper.axes, strict=True), 1):
        where = _add_axes(cell.panel, axes, number, layout, shared)
        where |= _add_legend(axes.get_legend(), f"legend{number + 1}", layout)
        for item in sorted(cell.panel.items, key=lambda item: item.layer):
            for trace in traces(item, cell.panel, where, layout):
                figure.add_trace(trace | where)
    for legend in paper.legends:
        _add_legend(legend, "legend", layout)
        layout["legend"] |= {"orientation": "h", "x": 0.5, "xanchor": "center"}
        for entry in picture.legend:
            figure.add_trace(entry_trace(entry) | {"legend": "legend"})
    figure.update_layout(layout)
    return figure


def save_html(picture: Sheet, target: str | FilePath) -> None:
    """Write a picture as one HTML file that works without a network.

    Raises:
        InputError: plotly is not installed, or the file cannot be written.
    """
    config = {"displaylogo": False, "responsive": True, "toImageButtonOptions": {"format": "svg"}}
    options: dict[str, Any] = {"include_plotlyjs": True, "full_html": True, "config": config}
    # With a fixed name of the element the same picture gives the same file.
    text = interactive_of(picture).to_html(div_id="notchflex", default_width="100%", **options)
    narrowest = round(NARROWEST * INCH * picture.width)
    head = f"<head><title>{escape(picture.title)}</title>"
    head += f"<style>#notchflex {{min-width: {narrowest}px}}</style>"
    write_text(target, text.replace("<head>", head, 1))


def _add_axes(
    panel: Panel, axes: Any, number: int, layout: Layout, shared: dict[str, str]
) -> Layout:
    """Add the axes of a panel where matplotlib has them; return where its traces belong."""
    box = axes.get_position()
    suffix = "" if number == 1 else str(number)
    if panel.title:
        layout["annotations"].append(
            {"text": for_browser(panel.title), "x": box.x0, "xref": "paper", "xanchor": "left",
             "y": box.y1, "yref": "paper", "yanchor": "bottom", "showarrow": False}
        )  # fmt: skip
    domain = {"x": [box.x0, box.x1], "y": [box.y0, box.y1]}
    scales: dict[str, Layout] = {}
    for name in "xyz" if panel.in_space else "xy":
        label = for_browser(getattr(panel, f"{name}_label"))
        scales[name] = {
            "title": {"text": label, "standoff": 6, "font": {"size": 9.0 * POINT}},
            "gridcolor": "#e6e6e6", "zeroline": False,
            "range": list(getattr(axes, f"get_{name}lim")()),
        }  # fmt: skip
        if name in panel.whole:
            scales[name] |= {"tickformat": "d", "nticks": 8}
    if panel.in_space:
        for axis in scales.values():
            axis["title"].pop("standoff")
            axis |= {"nticks": 5, "backgroundcolor": "white"}
        span = {name: float(np.ptp(axis["range"])) for name, axis in scales.items()}
        layout[f"scene{suffix}"] = {
            "domain": domain, "aspectmode": "manual",
            "aspectratio": {name: one / max(span.values()) for name, one in span.items()},
            "camera": {"eye": {"x": 0.8, "y": -1.7, "z": 0.55}},
            **{f"{name}axis": axis for name, axis in scales.items()},
        }  # fmt: skip
        return {"scene": f"scene{suffix}"}
    for name, other in ("xy", "yx"):
        scales[name] |= {
            "domain": domain[name], "anchor": other + suffix, "showline": True,
            "linecolor": "#444", "ticks": "outside", "ticklen": 4,
        }  # fmt: skip
        axis = name + suffix
        if name in panel.shared and shared.setdefault(name, axis) != axis:
            scales[name]["matches"] = shared[name]
        layout[f"{name}axis{suffix}"] = scales[name]
    if panel.most_x is not None:
        scales["x"]["nticks"] = panel.most_x
    if axes.get_aspect() == 1.0:
        scales["y"]["scaleanchor"] = f"x{suffix}"
        if axes.get_adjustable() == "box":
            scales["x"]["constrain"] = scales["y"]["constrain"] = "domain"
    return {"xaxis": f"x{suffix}", "yaxis": f"y{suffix}"}


def _add_legend(legend: Any, name: str, layout: Layout) -> Layout:
    """Add a legend where matplotlib has it; return what its traces have for it."""
    if legend is None:
        return {"showlegend": False}
    figure = legend.get_figure()
    box = legend.get_window_extent().transformed(figure.transFigure.inverted())
    layout[name] = {
        "x": box.x0, "xanchor": "left", "y": box.y1, "yanchor": "top", "indentation": -4,
        "font": {"size": 7.5 * POINT}, "bgcolor": "rgba(255,255,255,0.7)", "tracegroupgap": 0,
    }  # fmt: skip
    return {"legend": name}
