"""Draws the marks of a panel as traces, shapes and annotations of plotly."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np

from notchflex.plotting.labels import for_browser
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
    Span,
)
from notchflex.plotting.style import diverging_colours, rgb

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
