"""A picture drawn by plotly, for a browser: one file that holds all it needs."""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence
from html import escape
from pathlib import Path as FilePath
from typing import Any

import numpy as np
from numpy.typing import NDArray

from notchflex._extras import need
from notchflex.plot.sheet import (
    BELOW,
    BESIDE,
    INSIDE,
    Area,
    Arrow,
    Bars,
    Faces,
    Line,
    Note,
    Panel,
    Picture,
    Upright,
)
from notchflex.plot.style import rgb
from notchflex.results.files import write_text

# Pixels of a browser for an inch, and for a point of a line or letter, of the paper.
INCH, POINT = 72.0, 1.3
_FONT = 12.5
_ABOVE, _BELOW, _LEFT, _RIGHT = 70.0, 64.0, 76.0, 20.0
_LEGEND = 150.0
_BETWEEN = 78.0
_SYMBOLS = {
    "o": "circle", "s": "square", "^": "triangle-up", "D": "diamond", "v": "triangle-down",
    "P": "cross", "*": "star", "X": "x",
}  # fmt: skip
_IN_SPACE = {"circle", "square", "diamond", "cross", "x"}


def interactive_of(picture: Picture) -> Any:
    """Return a picture as a figure of plotly.

    Raises:
        InputError: plotly is not installed.
    """
    need("plotly", "plot", "an interactive picture")
    import plotly.graph_objects as go

    figure = go.Figure()
    layout: dict[str, Any] = {
        "font": {"size": _FONT, "family": "DejaVu Sans, Verdana, sans-serif", "color": "#222"},
        "template": None,
        "paper_bgcolor": "white",
        "plot_bgcolor": "white",
        "hovermode": "closest",
        "margin": {"t": 0, "b": 0, "l": 0, "r": 0},
        "annotations": [],
        "shapes": [],
    }
    places, layout["width"], layout["height"] = _places(picture)
    layout["title"] = {
        "text": html(picture.title), "x": 0.5, "font": {"size": 17}, "yref": "container",
        "y": 1.0 - 24.0 / layout["height"], "yanchor": "middle",
    }  # fmt: skip
    ranges = _ranges(picture)
    flat = space = 0
    for number, (cell, place) in enumerate(zip(picture.cells, places, strict=True), 1):
        panel = cell.panel
        if panel.in_space:
            space += 1
            layout[_numbered("scene", space)] = _scene(panel, place)
            where: dict[str, Any] = {"scene": _numbered("scene", space)}
        else:
            flat += 1
            x, y = _numbered("x", flat), _numbered("y", flat)
            layout[_numbered("xaxis", flat)], layout[_numbered("yaxis", flat)] = _axes(
                panel, place, x, y, ranges[number - 1]
            )
            where = {"xaxis": x, "yaxis": y}
        legend = _numbered("legend", number + 1)
        if panel.legend:
            layout[legend] = _legend(panel, place)
        if panel.title:
            layout["annotations"].append(
                {
                    "text": html(panel.title), "x": place.left, "xref": "paper", "xanchor": "left",
                    "y": place.top, "yref": "paper", "yanchor": "bottom", "showarrow": False,
                    "font": {"size": _FONT + 0.5},
                }
            )  # fmt: skip
        for item in sorted(panel.items, key=_layer):
            for trace in _traces(item, panel, where, layout):
                options: dict[str, Any] = (
                    {"legend": legend} if panel.legend else {"showlegend": False}
                )
                figure.add_trace(trace | where | options)
    if picture.legend:
        layout["legend"] = {
            "orientation": "h", "x": 0.5, "xanchor": "center", "yanchor": "bottom",
            "y": 4.0 / layout["height"], "yref": "container",
        }  # fmt: skip
        for entry in picture.legend:
            figure.add_trace(_line(entry, None) | {"showlegend": True, "legend": "legend"})
    figure.update_layout(layout)
    return figure


def save_html(picture: Picture, target: str | FilePath) -> None:
    """Write a picture as one HTML file that works without a network.

    Raises:
        InputError: plotly is not installed, or the file cannot be written.
    """
    text = interactive_of(picture).to_html(
        include_plotlyjs=True,
        full_html=True,
        div_id="notchflex",  # the same picture gives the same file
        config={"displaylogo": False, "toImageButtonOptions": {"format": "svg"}},
    )
    head = f"<head><title>{escape(picture.title)}</title>"
    write_text(target, text.replace("<head>", head, 1))


def html(label: str) -> str:
    r"""Return a label with mathtext in it as HTML.

    Example:
        >>> html(r"notch angle $\theta_j$ [deg]")
        'notch angle θ<sub><i>j</i></sub> [deg]'
    """
    plain = escape(label, quote=False)
    return re.sub(r"\$([^$]*)\$", lambda found: _symbol(found[1]), plain)


def css(colour: Any, opacity: float = 1.0) -> str:
    """Return a colour as a browser takes it."""
    red, green, blue = (round(255 * part) for part in rgb(colour))
    return f"rgba({red},{green},{blue},{opacity:g})"


_GREEK = {
    "theta": "θ", "psi": "ψ", "varepsilon": "ε", "eta": "η", "beta": "β", "lambda": "λ",
}  # fmt: skip


def _symbol(text: str) -> str:
    text = re.sub(r"\\mathrm\{(\w+)\}", r"\1", text)
    text = re.sub(r"\\([a-z]+)", lambda found: _GREEK[found[1]], text)
    text = re.sub(r"_\{?(\w+)\}?", r"<sub>\1</sub>", text)
    text = re.sub(r"(?<![<\w/])([A-Za-z])(?![\w>])", r"<i>\1</i>", text)
    return text.replace(" - ", " − ")


class _Place:
    """Where a panel stands, in parts of the whole; and what a legend beside it takes."""

    def __init__(self, left: float, right: float, bottom: float, top: float) -> None:
        self.left, self.right, self.bottom, self.top = left, right, bottom, top


def _places(picture: Picture) -> tuple[list[_Place], float, float]:
    """Where every panel stands, and width and height of the whole in pixels."""
    rows, columns = picture.shape
    beside = [
        _LEGEND
        if any(
            c.panel.legend in (BESIDE, BELOW) and c.columns[1] == column + 1 for c in picture.cells
        )
        else 0.0
        for column in range(columns)
    ]
    width = INCH * picture.width / columns
    height = INCH * picture.height / rows
    starts = [
        _LEFT + column * (width + _BETWEEN) + sum(beside[:column]) for column in range(columns)
    ]
    whole = starts[-1] + width + beside[-1] + _RIGHT
    tall = _ABOVE + rows * height + (rows - 1) * _BETWEEN + _BELOW
    tall += 40.0 if picture.legend else 0.0
    places: list[_Place] = []
    for cell in picture.cells:
        top = tall - _ABOVE - cell.rows[0] * (height + _BETWEEN)
        bottom = tall - _ABOVE - cell.rows[1] * (height + _BETWEEN) + _BETWEEN
        left, right = starts[cell.columns[0]], starts[cell.columns[1] - 1] + width
        places.append(_Place(left / whole, right / whole, bottom / tall, top / tall))
    return places, whole, tall


def _numbered(name: str, number: int) -> str:
    return name if number == 1 else f"{name}{number}"


def _layer(item: Any) -> int:
    return getattr(item, "layer", 0)


def _legend(panel: Panel, place: _Place) -> dict[str, Any]:
    """Where the legend of a panel stands: beside it, or in its emptiest corner."""
    look: dict[str, Any] = {
        "font": {"size": _FONT - 2.0}, "bgcolor": "rgba(255,255,255,0.7)",
        "tracegroupgap": 0, "indentation": -4,
    }  # fmt: skip
    if panel.legend != INSIDE:
        return look | {"x": place.right, "xanchor": "left", "y": place.top, "yanchor": "top"}
    right, top = _emptiest_corner(panel)
    return look | {
        "x": place.right if right else place.left,
        "xanchor": "right" if right else "left",
        "y": place.top if top else place.bottom,
        "yanchor": "top" if top else "bottom",
    }


def _emptiest_corner(panel: Panel) -> tuple[bool, bool]:
    """The corner, right or left and top or bottom, with the fewest points; right and top first."""
    points = _drawn([panel])
    if not len(points):
        return True, True
    low, high = np.nanmin(points, axis=0), np.nanmax(points, axis=0)
    place = (points - low) / np.where(high > low, high - low, 1.0)
    corners = [(True, True), (False, True), (False, False), (True, False)]

    def crowd(corner: tuple[bool, bool]) -> int:
        away = np.abs(place - np.array(corner, float))
        return int(((away[:, 0] < 0.45) & (away[:, 1] < 0.4)).sum())

    return min(corners, key=crowd)


def _drawn(panels: Sequence[Panel]) -> NDArray[np.float64]:
    """All points of some panels, lines filled up between them; without gaps."""
    parts = [_filled(part) for panel in panels for item in panel.items for part in _points(item)]
    together = np.concatenate([np.zeros((0, 2)), *parts])
    return together[np.isfinite(together).all(axis=1)]


def _filled(points: NDArray[np.float64]) -> NDArray[np.float64]:
    part = np.linspace(0.0, 1.0, 9)[:, None, None]
    between = points[:-1] + part * (points[1:] - points[:-1])
    return np.concatenate([points, between.reshape(-1, 2)])


def _range(points: NDArray[np.float64], axis: int) -> list[float] | None:
    """From where to where an axis goes, with some room at both ends as on paper."""
    if not len(points):
        return None
    low, high = float(points[:, axis].min()), float(points[:, axis].max())
    room = 0.05 * (high - low) or 0.05 * abs(high) or 1.0
    return [low - room, high + room]


def _ranges(picture: Picture) -> list[tuple[list[float] | None, list[float] | None]]:
    """What part of the plane every panel shows; panels of one scale show the same."""
    found: list[tuple[list[float] | None, list[float] | None]] = []
    every = [cell.panel for cell in picture.cells]
    for panel in every:
        alike = [one for one in every if panel.scale and one.scale == panel.scale] or [panel]
        points = np.zeros((0, 2)) if panel.in_space else _drawn(alike)
        found.append((_range(points, 0), _range(points, 1)))
    return found


def _points(item: Any) -> Iterator[Any]:
    match item:
        case Area():
            yield from item.polygons
        case Line() if len(item.rows):
            yield item.rows
        case Arrow():
            yield np.stack([item.start, item.end]) if item.reach is None else item.reach
        case _:
            pass


def _axes(
    panel: Panel,
    place: _Place,
    x: str,
    y: str,
    ranges: tuple[list[float] | None, list[float] | None],
) -> tuple[dict[str, Any], dict[str, Any]]:
    look = {
        "showline": True, "linecolor": "#444", "ticks": "outside", "ticklen": 4,
        "gridcolor": "#e6e6e6", "zeroline": False,
    }  # fmt: skip
    across: dict[str, Any] = {
        **look, "domain": [place.left, place.right], "anchor": y,
        "title": _axis_title(panel.x_label) | {"standoff": 6},
    }  # fmt: skip
    upward: dict[str, Any] = {
        **look, "domain": [place.bottom, place.top], "anchor": x,
        "title": _axis_title(panel.y_label) | {"standoff": 6},
    }  # fmt: skip
    for axis, drawn, wanted, whole in (
        (across, ranges[0], panel.x_range, panel.whole_x),
        (upward, ranges[1], panel.y_range, panel.whole_y),
    ):
        if drawn is not None:
            given = wanted or (None, None)
            axis["range"] = [
                end if one is None else one for one, end in zip(given, drawn, strict=True)
            ]
        if whole:
            axis["tickformat"] = "d"
            axis["nticks"] = 8
    if panel.equal:
        upward |= {"scaleanchor": x, "scaleratio": 1}
    if any(isinstance(item, Bars) for item in panel.items):
        upward |= {"autorange": "reversed", "showgrid": False, "ticks": ""}
        across["range"] = list(panel.x_range or (0.0, None))
    return across, upward


def _axis_title(label: str) -> dict[str, Any]:
    return {"text": html(label), "font": {"size": _FONT}}


def _scene(panel: Panel, place: _Place) -> dict[str, Any]:
    def axis(label: str) -> dict[str, Any]:
        return {
            "title": _axis_title(label), "gridcolor": "#dddddd", "backgroundcolor": "white",
            "zeroline": False, "nticks": 5,
        }  # fmt: skip

    return {
        "domain": {"x": [place.left, place.right], "y": [place.bottom, place.top]},
        "aspectmode": "manual",
        "aspectratio": _proportions(panel),
        "xaxis": axis(panel.x_label),
        "yaxis": axis(panel.y_label),
        "zaxis": axis(panel.z_label),
        "camera": {"eye": {"x": 0.7, "y": -1.5, "z": 0.5}},
    }


def _proportions(panel: Panel) -> dict[str, float]:
    """Lengths of the three axes for one scale on all, the longest being 1."""
    corners = [
        np.reshape(part, (-1, 3))
        for item in panel.items
        for part in ([item.corners] if isinstance(item, Faces) else [])
        + ([item.start, item.end] if isinstance(item, Arrow) else [])
    ]
    span = np.ptp(np.concatenate(corners), axis=0)
    return dict(zip("xyz", (span / span.max()).tolist(), strict=True))


def _traces(
    item: Any, panel: Panel, where: dict[str, Any], layout: dict[str, Any]
) -> Iterator[dict[str, Any]]:
    match item:
        case Line():
            yield _line(item, panel)
        case Area():
            yield _area(item)
        case Faces():
            yield _mesh(item)
        case Arrow() if len(item.start) == 3:
            yield from _arrow_in_space(item)
        case Arrow():
            yield from _arrow(item)
        case Upright():
            layout["shapes"].append(
                {
                    "type": "line", "x0": item.at, "x1": item.at, "y0": 0, "y1": 1,
                    "xref": where["xaxis"], "yref": f"{where['yaxis']} domain",
                    "line": {"color": css(item.colour), "width": 1, "dash": "dot"},
                }
            )  # fmt: skip
            if item.name:
                entry = Line([], item.colour, dash=(1.0, 1.6), name=item.name)
                yield _line(entry, panel)
        case Bars():
            yield {
                "type": "bar", "orientation": "h", "x": list(item.values),
                "y": [html(name) for name in item.names],
                "marker": {"color": [css(colour) for colour in item.colours]},
                "text": [format(value, item.form) for value in item.values],
                "textposition": "outside", "cliponaxis": False, "showlegend": False,
                "hoverinfo": "x+y",
            }  # fmt: skip
        case Note():
            layout["annotations"].append(
                {
                    "text": item.text, "showarrow": False, "x": 0.5, "y": 0.5,
                    "xref": f"{where['xaxis']} domain", "yref": f"{where['yaxis']} domain",
                }
            )  # fmt: skip
        case _:
            raise NotImplementedError(f"plotly draws no {type(item).__name__}")


def _line(item: Line, panel: Panel | None) -> dict[str, Any]:
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
        **_named(item),
        "hoverinfo": "skip",
    }  # fmt: skip
    for axis, values in zip("xyz", points.T, strict=False):
        trace[axis] = _plain(values)
    if item.dash and not in_space:
        trace["line"]["dash"] = ",".join(f"{POINT * item.width * one:.1f}px" for one in item.dash)
    if item.told and panel is not None:
        trace["hoverinfo"] = "all"
        trace["hovertemplate"] = (
            f"{html(item.name or item.group)}<br>{html(panel.x_label)}: %{{x:.4g}}"
            f"<br>{html(panel.y_label)}: %{{y:.4g}}<extra></extra>"
        )
    return trace


def _area(item: Area) -> dict[str, Any]:
    x: list[float | None] = []
    y: list[float | None] = []
    for polygon in item.polygons:  # closed, and apart from the next
        for values, into in ((polygon[:, 0], x), (polygon[:, 1], y)):
            into += [*_plain(values), float(values[0]), None]
    return {
        "type": "scatter", "mode": "lines", "fill": "toself", "x": x, "y": y,
        "fillcolor": css(item.face, item.opacity),
        "line": {"color": css(item.edge), "width": POINT * item.width},
        "hoverinfo": "skip", **_named(item),
    }  # fmt: skip


def _mesh(item: Faces) -> dict[str, Any]:
    corners = item.corners.reshape(-1, 3)
    first = 4 * np.arange(len(item.corners))
    triangles = np.concatenate(
        [np.stack([first, first + 1, first + 2]), np.stack([first, first + 2, first + 3])], axis=1
    )
    colours = [css(colour) for colour in item.colours]
    return {
        "type": "mesh3d", **dict(zip("xyz", map(_plain, corners.T), strict=True)),
        **dict(zip("ijk", (row.tolist() for row in triangles), strict=True)),
        "facecolor": colours * 2, "flatshading": True, "hoverinfo": "skip",
        "lighting": {"ambient": 1.0, "diffuse": 0.0, "specular": 0.0},
        # The faces have colours of their own; this one is that of the legend.
        "color": css(item.colour), **_named(item),
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
        "x": _plain(curve[:, 0]), "y": _plain(curve[:, 1]),
        "line": {"color": css(item.colour), "width": POINT * item.width},
        "marker": {
            "symbol": "arrow", "angleref": "previous", "color": css(item.colour),
            "size": [0.0] * 20 + [11.0],
        },
        "hoverinfo": "skip", **_named(item),
    }  # fmt: skip
    if item.reach is not None:  # seen by nobody, but the axes make room for it
        yield {
            "type": "scatter", "mode": "markers", "x": _plain(item.reach[:, 0]),
            "y": _plain(item.reach[:, 1]), "marker": {"opacity": 0.0}, "hoverinfo": "skip",
            "showlegend": False,
        }  # fmt: skip


def _arrow_in_space(item: Arrow) -> Iterator[dict[str, Any]]:
    ends = np.stack([item.start, item.end])
    step = ends[1] - ends[0]
    yield {
        "type": "scatter3d", "mode": "lines", "hoverinfo": "skip",
        **dict(zip("xyz", map(_plain, ends.T), strict=True)),
        "line": {"color": css(item.colour), "width": 3.0 * item.width}, **_named(item),
    }  # fmt: skip
    yield {
        "type": "cone", "anchor": "tip", "showscale": False, "hoverinfo": "skip",
        "colorscale": [[0, css(item.colour)], [1, css(item.colour)]],
        **dict(zip("xyz", ([float(value)] for value in ends[1]), strict=True)),
        **dict(zip("uvw", ([0.3 * float(value)] for value in step), strict=True)),
        "sizemode": "raw", "showlegend": False,
    }  # fmt: skip


def _named(item: Any) -> dict[str, Any]:
    group = getattr(item, "group", "")
    named = {"name": html(item.name or group), "showlegend": bool(item.name)}
    return named | ({"legendgroup": group} if group else {})


def _plain(values: Any) -> list[float | None]:
    """Numbers as JSON knows them: a gap where there is none."""
    return [float(f"{value:.6g}") if np.isfinite(value) else None for value in values]
