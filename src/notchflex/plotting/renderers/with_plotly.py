"""A picture drawn by plotly, for a browser: one file that holds all it needs.

Its panels are drawn by `plotly_axes.py` and `plotly_marks.py`, in space by `plotly_space.py`.
"""

from __future__ import annotations

from html import escape
from pathlib import Path as FilePath
from typing import Any

from notchflex._extras import need
from notchflex.plotting.output import Picture
from notchflex.plotting.renderers.labels import for_browser, heading_lines, translated
from notchflex.plotting.renderers.plotly_axes import (
    FONT,
    LABELS,
    Place,
    axes_of,
    legend_height,
    legend_of,
    ranges_of,
)
from notchflex.plotting.renderers.plotly_marks import area_trace, draw_item, line_trace
from notchflex.plotting.renderers.plotly_space import draw_in_space, scene_of
from notchflex.plotting.sheet import BELOW, BESIDE, Area, Bars, Correlations, Panel
from notchflex.results.files.writing import write_text

INCH = 64.0
"""Pixels of a browser for an inch of the paper, where the window is as wide as the picture."""

NARROWEST = 0.75
"""A picture follows the width of its window down to this part of its own; then it is scrolled."""

# notation: room in pixels round the panels, beside and between them, and a line of text.
_ABOVE, _BELOW, _LEFT, _RIGHT = 70.0, 64.0, 76.0, 20.0
_BESIDE, _BETWEEN = 150.0, 78.0
_LETTER, _HEADING_LINE = 7.0, 22.0


def interactive_of(picture: Picture) -> Any:
    """Return a picture as a figure of plotly.

    Raises:
        InputError: plotly is not installed.
    """
    need("plotly", "plot", "an interactive picture")
    import plotly.graph_objects as go

    places, width, height = _places(picture)
    heading = heading_lines(picture.title, width / INCH)
    picture = translated(picture, for_browser)
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
    # The width is that of the window; `meta` tells the one that the places are made for.
    layout |= {"autosize": True, "height": height, "meta": {"width": width}}
    layout["title"] = {
        "text": "<br>".join(map(for_browser, heading)), "x": 0.5, "font": {"size": 17},
        "yref": "container", "y": 1.0 - 12.0 / height, "yanchor": "top",
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
                    "text": panel.title, "x": place.left, "xref": "paper", "xanchor": "left",
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
            "y": 4.0 / height, "yref": "container",
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
    figure = interactive_of(picture)
    text = figure.to_html(
        include_plotlyjs=True,
        full_html=True,
        default_width="100%",
        div_id="notchflex",  # the same picture gives the same file
        config={
            "displaylogo": False,
            "responsive": True,
            "toImageButtonOptions": {"format": "svg"},
        },
    )
    narrowest = round(NARROWEST * figure.layout.meta["width"])
    head = f"<head><title>{escape(picture.title)}</title>"
    head += f"<style>#notchflex {{min-width: {narrowest}px}}</style>"
    write_text(target, text.replace("<head>", head, 1))


def _places(picture: Picture) -> tuple[list[Place], float, float]:
    """Where every panel stands, and width and height of the whole in pixels."""
    rows, columns = picture.shape
    beside = [
        _BESIDE
        if any(c.panel.legend == BESIDE and c.columns[1] == column + 1 for c in picture.cells)
        else 0.0
        for column in range(columns)
    ]
    width = INCH * picture.width / columns
    # A column may divide its height into other rows than its neighbour.
    lines = max(sum(c.columns[0] == column for c in picture.cells) for column in range(columns))
    body = INCH * picture.height + (lines - 1) * _BETWEEN
    height = (body - (rows - 1) * _BETWEEN) / rows
    before = [
        max((_names_before(c.panel) for c in picture.cells if c.columns[0] == column), default=0.0)
        for column in range(columns)
    ]
    starts = [
        _LEFT + column * (width + _BETWEEN) + sum(beside[:column]) + sum(before[: column + 1])
        for column in range(columns)
    ]
    whole = starts[-1] + width + beside[-1] + _RIGHT
    above = _ABOVE + _HEADING_LINE * (len(heading_lines(picture.title, whole / INCH)) - 1)
    tall = above + rows * height + (rows - 1) * _BETWEEN + _BELOW
    tall += 40.0 if picture.legend else 0.0
    places: list[Place] = []
    for cell in picture.cells:
        top = tall - above - cell.rows[0] * (height + _BETWEEN)
        bottom = tall - above - cell.rows[1] * (height + _BETWEEN) + _BETWEEN
        if cell.panel.legend == BELOW:
            bottom += legend_height(cell.panel)
        left, right = starts[cell.columns[0]], starts[cell.columns[1] - 1] + width
        foot = bottom - LABELS
        places.append(Place(left / whole, right / whole, bottom / tall, top / tall, foot / tall))
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
