"""A picture drawn by plotly, for a browser: one file that holds all it needs.

Its panels are drawn by `plotly_axes.py` and `plotly_marks.py`, in space by `plotly_space.py`.
"""

from __future__ import annotations

from html import escape
from pathlib import Path as FilePath
from typing import Any

from notchflex._extras import need
from notchflex.plotting.plotly_axes import FONT, Place, axes_of, legend_of, ranges_of
from notchflex.plotting.plotly_marks import area_trace, draw_item, html, line_trace
from notchflex.plotting.plotly_space import draw_in_space, scene_of
from notchflex.plotting.sheet import BELOW, BESIDE, Area, Bars, Correlations, Panel, Picture
from notchflex.results.files import write_text

INCH = 72.0
"""Pixels of a browser for an inch of the paper."""

_ABOVE, _BELOW, _LEFT, _RIGHT = 70.0, 64.0, 76.0, 20.0
_LEGEND = 150.0
_BETWEEN = 78.0
_LETTER = 7.0


def interactive_of(picture: Picture) -> Any:
    """Return a picture as a figure of plotly.

    Raises:
        InputError: plotly is not installed.
    """
    need("plotly", "plot", "an interactive picture")
    import plotly.graph_objects as go

    figure = go.Figure()
    layout: dict[str, Any] = {
        "font": {"size": FONT, "family": "DejaVu Sans, Verdana, sans-serif", "color": "#222"},
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
    ranges = ranges_of(picture)
    shared: dict[str, str] = {}
    flat = space = 0
    for number, (cell, place) in enumerate(zip(picture.cells, places, strict=True), 1):
        panel = cell.panel
        if panel.in_space:
            space += 1
            layout[_numbered("scene", space)] = scene_of(panel, place)
            where = {"scene": _numbered("scene", space)}
        else:
            flat += 1
            x, y = _numbered("x", flat), _numbered("y", flat)
            across, upward = axes_of(panel, place, x, y, ranges[number - 1])
            for own, axis, sharing in (
                (x, across, panel.shared_x),
                (y, upward, panel.shared_y),
            ):
                if sharing and shared.setdefault(own[0], own) != own:
                    axis["matches"] = shared[own[0]]
            layout[_numbered("xaxis", flat)] = across
            layout[_numbered("yaxis", flat)] = upward
            where = {"xaxis": x, "yaxis": y}
        legend = _numbered("legend", number + 1)
        if panel.legend:
            layout[legend] = legend_of(panel, place)
        if panel.title:
            layout["annotations"].append(
                {
                    "text": html(panel.title), "x": place.left, "xref": "paper", "xanchor": "left",
                    "y": place.top, "yref": "paper", "yanchor": "bottom", "showarrow": False,
                    "font": {"size": FONT + 0.5},
                }
            )  # fmt: skip
        for item in sorted(panel.items, key=_layer):
            drawn = (
                draw_in_space(item, panel)
                if panel.in_space
                else draw_item(item, panel, where, layout)
            )
            for trace in drawn:
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
            trace = area_trace(entry) if isinstance(entry, Area) else line_trace(entry, None)
            figure.add_trace(trace | {"showlegend": True, "legend": "legend"})
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


def _places(picture: Picture) -> tuple[list[Place], float, float]:
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
    before = [
        max((_names_before(c.panel) for c in picture.cells if c.columns[0] == column), default=0.0)
        for column in range(columns)
    ]
    starts = [
        _LEFT + column * (width + _BETWEEN) + sum(beside[:column]) + sum(before[: column + 1])
        for column in range(columns)
    ]
    whole = starts[-1] + width + beside[-1] + _RIGHT
    tall = _ABOVE + rows * height + (rows - 1) * _BETWEEN + _BELOW
    tall += 40.0 if picture.legend else 0.0
    places: list[Place] = []
    for cell in picture.cells:
        top = tall - _ABOVE - cell.rows[0] * (height + _BETWEEN)
        bottom = tall - _ABOVE - cell.rows[1] * (height + _BETWEEN) + _BETWEEN
        left, right = starts[cell.columns[0]], starts[cell.columns[1] - 1] + width
        places.append(Place(left / whole, right / whole, bottom / tall, top / tall))
    return places, whole, tall


def _names_before(panel: Panel) -> float:
    """What names at the vertical axis of a panel need more than numbers do, in pixels."""
    names: list[str] = []
    for item in panel.items:
        if isinstance(item, (Bars, Correlations)):
            names += item.names if isinstance(item, Bars) else item.rows
    longest = max((len(line) for name in names for line in name.split("\n")), default=0)
    return max(0.0, _LETTER * longest - (_LEFT - 10.0))


def _numbered(name: str, number: int) -> str:
    return name if number == 1 else f"{name}{number}"


def _layer(item: Any) -> int:
    return getattr(item, "layer", 0)
