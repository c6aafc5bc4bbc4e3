"""What a panel in the plane shows, as traces, shapes and annotations of plotly.

Its texts are HTML already (`labels.py`).
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np

from notchflex.plotting.sheet import (
    Area,
    Arrow,
    Bars,
    Correlations,
    Level,
    Line,
    Note,
    Panel,
    Stripe,
    Upright,
)
from notchflex.plotting.style import diverging_colours, rgb

POINT = 1.3
"""Pixels of a browser for a point of a line or letter of the paper."""

_SYMBOLS = {
    "o": "circle", "s": "square", "^": "triangle-up", "D": "diamond", "v": "triangle-down",
    "P": "cross", "*": "star", "X": "x",
}  # fmt: skip
_IN_SPACE = {"circle", "square", "diamond", "cross", "x"}


def draw_item(
    item: Any, panel: Panel, where: dict[str, str], layout: dict[str, Any]
) -> Iterator[dict[str, Any]]:
    """Yield the traces of an item; what plotly draws as a shape or annotation joins `layout`."""
    match item:
        case Line():
            yield line_trace(item, panel)
        case Area():
            yield area_trace(item)
        case Arrow():
            yield from _arrow(item)
        case Upright() | Level() | Stripe():
            layout["shapes"].append(_shape(item, where))
            if item.name:
                yield _entry(item)
        case Bars():
            yield {
                "type": "bar", "orientation": "h", "x": list(item.values),
                "y": list(item.names),
                "marker": {"color": [css(colour) for colour in item.colours]},
                "text": [format(value, item.form) for value in item.values],
                "textposition": "outside", "cliponaxis": False, "showlegend": False,
                "hoverinfo": "x+y",
            }  # fmt: skip
        case Correlations():
            yield _correlations(item)
        case Note():
            place = {"x": 0.5, "y": 0.5}
            if item.corner:
                place = {"x": 0.03, "y": 0.95, "xanchor": "left", "yanchor": "top"}
            layout["annotations"].append(
                {
                    "text": item.text, "showarrow": False, **place,
                    "font": {"color": css(item.colour)},
                    "xref": f"{where['xaxis']} domain", "yref": f"{where['yaxis']} domain",
                }
            )  # fmt: skip
        case _:
            raise NotImplementedError(f"plotly draws no {type(item).__name__}")


def line_trace(item: Line, panel: Panel | None) -> dict[str, Any]:
    """Return a line as a trace; one of a panel in space is a trace in space."""
    points = item.rows
    in_space = panel is not None and panel.in_space
    if not len(points):  # only the entry of a legend
        points = np.full((1, 3 if in_space else 2), np.nan)
    symbol = _SYMBOLS.get(item.marker, "circle")
    mark: dict[str, Any] = {"size": POINT * item.size, "color": css(item.colour)}
    if in_space:
        symbol = symbol if symbol in _IN_SPACE else "circle"
    if item.hollow:
        symbol = f"{symbol}-open"
    trace: dict[str, Any] = {
        "type": "scatter3d" if in_space else "scatter",
        "mode": "+".join(
            ["lines"] * (item.dash is not None) + ["markers"] * bool(item.marker)
        ),
        "line": {"color": css(item.colour), "width": POINT * item.width * (2 if in_space else 1)},
        "marker": mark | {"symbol": symbol},
        **named(item),
        "hoverinfo": "skip",
    }  # fmt: skip
    for axis, values in zip("xyz", points.T, strict=False):
        trace[axis] = plain(values)
    if item.dash and not in_space:
        trace["line"]["dash"] = _dashes(item.dash, item.width)
    give_or_take = ""
    if item.half is not None:
        trace["error_y"] = {
            "type": "data", "array": plain(item.half), "width": 0, "thickness": POINT * 0.7,
            "color": css(item.colour),
        }  # fmt: skip
        trace["text"] = [f" ± {one:.2g}" if np.isfinite(one) else "" for one in item.half]
        give_or_take = "%{text}"
    if item.told and panel is not None:
        trace["hoverinfo"] = "all"
        trace["hovertemplate"] = (
            f"{item.name or item.group}<br>{panel.x_label}: %{{x:.4g}}"
            f"<br>{panel.y_label}: %{{y:.4g}}{give_or_take}<extra></extra>"
        )
    return trace


def area_trace(item: Area) -> dict[str, Any]:
    """Return polygons as a trace; none at all are the entry of a legend."""
    x: list[float | None] = []
    y: list[float | None] = []
    for polygon in item.polygons or [np.full((1, 2), np.nan)]:  # closed, and apart from the next
        for values, into in ((polygon[:, 0], x), (polygon[:, 1], y)):
            numbers = plain(values)
            into += [*numbers, numbers[0], None]
    return {
        "type": "scatter", "mode": "lines", "fill": "toself", "x": x, "y": y,
        "fillcolor": css(item.face, item.opacity),
        "line": {"color": css(item.edge), "width": POINT * item.width},
        "hoverinfo": "skip", **named(item),
    }  # fmt: skip


def _arrow(item: Arrow) -> Iterator[dict[str, Any]]:
    start, end = np.asarray(item.start, float), np.asarray(item.end, float)
    middle = 0.5 * (start + end)
    step = end - start
    # As matplotlib's arc3: a parabola whose control point lies aside by `bend` of the length.
    control = middle + item.bend * np.array([step[1], -step[0]])
    part = np.linspace(0.0, 1.0, 21)[:, None]
    curve = (1 - part) ** 2 * start + 2 * part * (1 - part) * control + part**2 * end
    yield {
        "type": "scatter", "mode": "lines+markers",
        "x": plain(curve[:, 0]), "y": plain(curve[:, 1]),
        "line": {"color": css(item.colour), "width": POINT * item.width},
        "marker": {
            "symbol": "arrow", "angleref": "previous", "color": css(item.colour),
            "size": [0.0] * 20 + [11.0],
        },
        "hoverinfo": "skip", **named(item),
    }  # fmt: skip
    if item.reach is not None:  # seen by nobody, but the axes make room for it
        yield {
            "type": "scatter", "mode": "markers", "x": plain(item.reach[:, 0]),
            "y": plain(item.reach[:, 1]), "marker": {"opacity": 0.0}, "hoverinfo": "skip",
            "showlegend": False,
        }  # fmt: skip


def _shape(item: Upright | Level | Stripe, where: dict[str, str]) -> dict[str, Any]:
    """What goes through the whole panel; hidden and shown with the traces of its group."""
    x, y = where["xaxis"], where["yaxis"]
    group = item.group or item.name
    shape: dict[str, Any] = {"legendgroup": group} if group else {}
    if isinstance(item, Stripe):
        shape |= {"type": "rect", "line": {"width": 0}, "layer": "below"}
        shape |= {"fillcolor": css(item.colour, item.opacity)}
    else:
        line: dict[str, Any] = {"color": css(item.colour), "width": POINT * item.width}
        if item.dash:
            line["dash"] = _dashes(item.dash, item.width)
        shape |= {"type": "line", "line": line}
    if isinstance(item, Upright):
        low, high = item.at, item.at
        return shape | {"x0": low, "x1": high, "xref": x, "y0": 0, "y1": 1, "yref": f"{y} domain"}
    low, high = (item.low, item.high) if isinstance(item, Stripe) else (item.at, item.at)
    return shape | {"y0": low, "y1": high, "yref": y, "x0": 0, "x1": 1, "xref": f"{x} domain"}


def _entry(item: Upright | Level | Stripe) -> dict[str, Any]:
    """The entry of a legend for what is no trace."""
    name, group = item.name, item.group or item.name
    if isinstance(item, Stripe):
        entry = Area([], item.colour, item.colour, item.opacity, 0.0, name, group)
        return area_trace(entry)
    return line_trace(Line([], item.colour, item.dash, item.width, name=name, group=group), None)


def _correlations(item: Correlations) -> dict[str, Any]:
    colours = diverging_colours(21)
    return {
        "type": "heatmap", "z": [plain(row) for row in item.values], "zmin": -1.0, "zmax": 1.0,
        "colorscale": [[i / 20, css(colour)] for i, colour in enumerate(colours)],
        "showscale": False, "text": item.texts, "texttemplate": "%{text}",
        "textfont": {"size": POINT * item.letters},
        "customdata": [[f"{one}<br>{other}" for other in item.names]
                       for one in item.names],
        "hovertemplate": "%{customdata}<br>%{text}<extra></extra>",
    }  # fmt: skip


def named(item: Any) -> dict[str, Any]:
    """Return what a legend calls an item, and with what it is shown and hidden."""
    group = getattr(item, "group", "")
    named = {"name": item.name or group, "showlegend": bool(item.name)}
    return named | ({"legendgroup": group} if group else {})


def plain(values: Any) -> list[float | None]:
    """Return numbers as JSON knows them: a gap where there is none."""
    return [float(f"{value:.6g}") if np.isfinite(value) else None for value in values]


def _dashes(dash: tuple[float, ...], width: float) -> str:
    return ",".join(f"{POINT * width * one:.1f}px" for one in dash)


def css(colour: Any, opacity: float = 1.0) -> str:
    """Return a colour as a browser takes it."""
    red, green, blue = (round(255 * part) for part in rgb(colour))
    return f"rgba({red},{green},{blue},{opacity:g})"
