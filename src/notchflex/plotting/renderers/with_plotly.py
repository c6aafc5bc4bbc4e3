"""Draws a picture with plotly: one HTML file that needs no network.

matplotlib arranges the panels, limits and legends; `plotly_marks.py` draws the marks there.
"""

from __future__ import annotations

from html import escape
from pathlib import Path as FilePath
from typing import Any

import numpy as np

from notchflex._extras import need
from notchflex.plotting.labels import for_browser, heading_lines
from notchflex.plotting.renderers.plotly_marks import INCH, POINT, Layout, entry_trace, traces
from notchflex.plotting.renderers.with_matplotlib import figure_of
from notchflex.plotting.sheet import Panel, Sheet
from notchflex.results.files.writing import write_text

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
