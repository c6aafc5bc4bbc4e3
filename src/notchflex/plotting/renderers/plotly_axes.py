"""The axes of a panel in the plane for plotly: place, range, look; and where its legend stands."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from notchflex.plotting.output import Picture
from notchflex.plotting.renderers.plotly_marks import POINT
from notchflex.plotting.sheet import (
    BELOW,
    INSIDE,
    Area,
    Arrow,
    Bars,
    Correlations,
    Level,
    Line,
    Panel,
    Stripe,
    Upright,
)

FONT = 12.5
"""Height of letters in pixels."""

LABELS = 46.0
"""Pixels that the numbers and the name of a horizontal axis take."""

_ENTRY = 18.0

Ranges = tuple[list[float] | None, list[float] | None]
"""From where to where the axes of a panel go, across and upward; None is left to plotly."""


class Place:
    """Where a panel stands, in parts of the whole; its foot is below its labels."""

    def __init__(
        self, left: float, right: float, bottom: float, top: float, foot: float = 0.0
    ) -> None:
        self.left, self.right, self.bottom, self.top = left, right, bottom, top
        self.foot = foot


def legend_of(panel: Panel, place: Place) -> dict[str, Any]:
    """Return where the legend of a panel stands: beside or below it, or in its emptiest corner."""
    look: dict[str, Any] = {
        "font": {"size": FONT - 2.0}, "bgcolor": "rgba(255,255,255,0.7)",
        "tracegroupgap": 0, "indentation": -4,
    }  # fmt: skip
    if panel.legend == BELOW:
        return look | {"x": place.left, "xanchor": "left", "y": place.foot, "yanchor": "top"}
    if panel.legend != INSIDE:
        return look | {"x": place.right, "xanchor": "left", "y": place.top, "yanchor": "top"}
    right, top = _emptiest_corner(panel)
    return look | {
        "x": place.right if right else place.left,
        "xanchor": "right" if right else "left",
        "y": place.top if top else place.bottom,
        "yanchor": "top" if top else "bottom",
    }


def legend_height(panel: Panel) -> float:
    """Return what a legend below a panel takes of the height, in pixels."""
    names = dict.fromkeys(name for item in panel.items if (name := getattr(item, "name", "")))
    return _ENTRY * len(names) + 8.0


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


def _range(panels: Sequence[Panel], axis: int) -> list[float] | None:
    """From where to where an axis of some panels goes, with room at both ends as on paper."""
    through = [end for panel in panels for item in panel.items for end in _ends(item, axis)]
    values = np.concatenate([_drawn(panels)[:, axis], through])
    if not len(values):
        return None
    low, high = float(values.min()), float(values.max())
    room = 0.05 * (high - low) or 0.05 * abs(high) or 1.0
    return [low - room, high + room]


def ranges_of(picture: Picture) -> list[Ranges]:
    """Return what part of the plane every panel shows.

    Panels of one scale show the same part, and panels that share an axis the same of that axis.
    """
    every = [cell.panel for cell in picture.cells]
    found: list[Ranges] = []
    for panel in every:
        alike = [one for one in every if panel.scale and one.scale == panel.scale] or [panel]
        across = [one for one in every if one.shared_x] if panel.shared_x else alike
        upward = [one for one in every if one.shared_y] if panel.shared_y else alike
        flat = not panel.in_space
        found.append((_range(across, 0), _range(upward, 1)) if flat else (None, None))
    return found


def _points(item: Any) -> Iterator[Any]:
    match item:
        case Area():
            yield from item.polygons
        case Line() if len(item.rows):
            yield item.rows
            if item.half is not None:
                bars = np.stack([np.zeros(len(item.rows)), np.nan_to_num(item.half)], axis=1)
                yield item.rows - bars
                yield item.rows + bars
        case Arrow():
            yield np.stack([item.start, item.end]) if item.reach is None else item.reach
        case _:
            pass


def _ends(item: Any, axis: int) -> list[float]:
    """What an axis shows of an item that goes through the whole panel along the other axis."""
    match item:
        case Upright() if axis == 0:
            return [item.at]
        case Level() if axis == 1:
            return [item.at]
        case Stripe() if axis == 1:
            return [item.low, item.high]
        case _:
            return []


def axes_of(
    panel: Panel, place: Place, x: str, y: str, ranges: Ranges
) -> tuple[dict[str, Any], dict[str, Any]]:
    """Return the axes of a panel, across and upward, whose names for plotly are `x` and `y`."""
    look = {
        "showline": True, "linecolor": "#444", "ticks": "outside", "ticklen": 4,
        "gridcolor": "#e6e6e6", "zeroline": False,
    }  # fmt: skip
    across: dict[str, Any] = {
        **look, "domain": [place.left, place.right], "anchor": y,
        "title": axis_title(panel.x_label) | {"standoff": 6},
    }  # fmt: skip
    upward: dict[str, Any] = {
        **look, "domain": [place.bottom, place.top], "anchor": x,
        "title": axis_title(panel.y_label) | {"standoff": 6},
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
    if panel.most_x is not None:
        across["nticks"] = panel.most_x
    if panel.equal:
        upward |= {"scaleanchor": x, "scaleratio": 1}
    if any(isinstance(item, Bars) for item in panel.items):
        upward |= {"autorange": "reversed", "showgrid": False, "ticks": ""}
        across["range"] = list(panel.x_range or (0.0, None))
    for item in panel.items:
        if isinstance(item, Correlations):
            count = len(item.names)
            square: dict[str, Any] = {
                "showgrid": False, "constrain": "domain", "tickvals": list(range(count)),
                "tickfont": {"size": POINT * item.outer_letters},
            }  # fmt: skip
            across |= square | {"range": [-0.5, count - 0.5]}
            across["ticktext"] = [str(number + 1) for number in range(count)]
            upward |= square | {"range": [count - 0.5, -0.5], "scaleanchor": x}
            upward["ticktext"] = list(item.rows)
    return across, upward


def axis_title(label: str) -> dict[str, Any]:
    """Return what stands at an axis."""
    return {"text": label, "font": {"size": FONT}}
