"""A panel in space as plotly draws it: its scene, robots as flat pieces, arrows with cones."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np

from notchflex.plotting.renderers.plotly_axes import Place, axis_title
from notchflex.plotting.renderers.plotly_marks import css, line_trace, named, plain
from notchflex.plotting.sheet import Arrow, Faces, Line, Panel


def draw_in_space(item: Any, panel: Panel) -> Iterator[dict[str, Any]]:
    """Yield the traces of an item."""
    match item:
        case Line():
            yield line_trace(item, panel)
        case Faces():
            yield _mesh(item)
        case Arrow():
            yield from _arrow(item)
        case _:
            raise NotImplementedError(f"plotly draws no {type(item).__name__} in space")


def scene_of(panel: Panel, place: Place) -> dict[str, Any]:
    """Return the three axes of a panel, one scale on all, and from where they are seen."""

    def axis(label: str) -> dict[str, Any]:
        return {
            "title": axis_title(label), "gridcolor": "#dddddd", "backgroundcolor": "white",
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


def _mesh(item: Faces) -> dict[str, Any]:
    corners = item.corners.reshape(-1, 3)
    first = 4 * np.arange(len(item.corners))
    triangles = np.concatenate(
        [np.stack([first, first + 1, first + 2]), np.stack([first, first + 2, first + 3])], axis=1
    )
    colours = [css(colour) for colour in item.colours]
    return {
        "type": "mesh3d", **dict(zip("xyz", map(plain, corners.T), strict=True)),
        **dict(zip("ijk", (row.tolist() for row in triangles), strict=True)),
        "facecolor": colours * 2, "flatshading": True, "hoverinfo": "skip",
        "lighting": {"ambient": 1.0, "diffuse": 0.0, "specular": 0.0},
        # The faces have colours of their own; this one is that of the legend.
        "color": css(item.colour), **named(item),
    }  # fmt: skip


def _arrow(item: Arrow) -> Iterator[dict[str, Any]]:
    ends = np.stack([item.start, item.end])
    step = ends[1] - ends[0]
    yield {
        "type": "scatter3d", "mode": "lines", "hoverinfo": "skip",
        **dict(zip("xyz", map(plain, ends.T), strict=True)),
        "line": {"color": css(item.colour), "width": 3.0 * item.width}, **named(item),
    }  # fmt: skip
    yield {
        "type": "cone", "anchor": "tip", "showscale": False, "hoverinfo": "skip",
        "colorscale": [[0, css(item.colour)], [1, css(item.colour)]],
        **dict(zip("xyz", ([float(value)] for value in ends[1]), strict=True)),
        **dict(zip("uvw", ([0.3 * float(value)] for value in step), strict=True)),
        "sizemode": "raw", "showlegend": False,
    }  # fmt: skip
