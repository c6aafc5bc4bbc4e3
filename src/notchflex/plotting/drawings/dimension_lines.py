"""Dimension lines, centre lines and broken ends of a technical drawing, on matplotlib's axes.

The axes are in inches of paper, so that a letter has the same size as the drawing around it.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from matplotlib.axes import Axes

TEXT = 8.0
"""Size of the letters, in points."""
LETTER = 0.064
"""Width of a letter, in inches, on average and a little more."""
LEVEL = 0.25
"""Distance of one dimension line from the next, in inches."""
SHORTEST = 0.3
"""A shorter dimension has its arrows outside, in inches."""

INK, FINE = "#222222", "#555555"


def label(axes: Axes, x: float, y: float, text: str, **options: Any) -> None:
    """Write a text on a white background."""
    settings: dict[str, Any] = {
        "ha": "center",
        "va": "center",
        "fontsize": TEXT,
        "color": INK,
        "zorder": 20,
        "linespacing": 1.05,
        "bbox": {"facecolor": "white", "edgecolor": "none", "pad": 0.6},
    }
    axes.text(x, y, text, **(settings | options))


def line(axes: Axes, x: Sequence[float], y: Sequence[float], **options: Any) -> None:
    """Draw a fine line."""
    style: dict[str, Any] = {"color": FINE, "lw": 0.5, "zorder": 8}
    axes.plot(x, y, **(style | options))


def centre_line(axes: Axes, x: Sequence[float], y: Sequence[float]) -> None:
    """Draw an axis of symmetry or the trace of a section, dash-dotted."""
    line(axes, x, y, dashes=(9, 2, 1.5, 2), zorder=7)


def arrow(axes: Axes, start: tuple[float, float], end: tuple[float, float], **style: Any) -> None:
    """Draw an arrow that points at its end."""
    settings = {"arrowstyle": "-|>", "lw": 0.7, "color": FINE, "mutation_scale": 6.0}
    properties = {"shrinkA": 0.0, "shrinkB": 0.0} | settings | style
    axes.annotate("", end, start, arrowprops=properties, zorder=12)


def _arrows(axes: Axes, start: tuple[float, float], end: tuple[float, float]) -> None:
    """Draw the line of a dimension with arrows at both ends, outside if there is no room."""
    first, last = np.asarray(start), np.asarray(end)
    size = float(np.hypot(*(last - first)))
    if size >= SHORTEST:
        arrow(axes, start, end, arrowstyle="<|-|>")
        return
    way = (last - first) / size
    for tip, out in ((first, -way), (last, way)):
        arrow(axes, tuple(tip + 0.17 * out), tuple(tip))
    line(axes, [start[0], end[0]], [start[1], end[1]], lw=0.7)


def horizontal(axes: Axes, start: float, end: float, at: float, edge: float, text: str) -> None:
    """Draw a dimension along the tube from `start` to `end` at a height, with a text above it.

    Its extension lines start at the height `edge`.
    """
    for x in (start, end):
        line(axes, [x, x], [edge, at + (0.05 if at > edge else -0.05)])
    _arrows(axes, (start, at), (end, at))
    label(axes, 0.5 * (start + end), at + 0.035, text, va="bottom")


def vertical(axes: Axes, start: float, end: float, at: float, edge: float) -> None:
    """Draw a dimension across the tube from `start` to `end` at `at`, without its text.

    Its extension lines start at `edge`.
    """
    for y in (start, end):
        line(axes, [edge, at + (0.05 if at > edge else -0.05)], [y, y])
    _arrows(axes, (at, start), (at, end))


def levels(intervals: Sequence[tuple[float, float, str]]) -> list[int]:
    """Return levels of dimensions (left end, right end [in], text) at which no texts overlap.

    Example:
        >>> levels([(0.0, 2.0, "height 1"), (2.0, 4.0, "length 2"), (4.0, 4.1, "thickness 3")])
        [0, 0, 1]
    """
    occupied: list[list[tuple[float, float]]] = [[]]
    numbers: list[int] = []
    for start, end, text in intervals:
        middle, half = 0.5 * (start + end), 0.5 * LETTER * len(text) + 0.04
        # Arrows outside of a short dimension need room too.
        out = 0.2 if end - start < SHORTEST else 0.0
        low, high = min(start - out, middle - half), max(end + out, middle + half)
        number = 0
        while not all(high <= a + 1e-9 or low >= b - 1e-9 for a, b in occupied[number]):
            number += 1
            if number == len(occupied):
                occupied.append([])
        occupied[number].append((low, high))
        numbers.append(number)
    return numbers


def broken(axes: Axes, x: float, low: float, high: float) -> None:
    """Draw the mark of an omitted part: a white band between two zigzag lines."""
    y = np.linspace(low - 0.06, high + 0.06, 13)
    aside = 0.035 * np.where(np.arange(13) % 2 == 0, -1.0, 1.0)
    left, right = x - 0.035 + aside, x + 0.035 + aside
    axes.fill(
        np.concatenate([left, right[::-1]]),
        np.concatenate([y, y[::-1]]),
        facecolor="white",
        edgecolor="none",
        zorder=9,
    )
    for edge in (left, right):
        line(axes, list(edge), list(y), zorder=10, color=INK)


def angular(axes: Axes, centre: tuple[float, float], radius: float, half: float, up: bool) -> None:
    """Draw the dimension of an angle 2 `half` [rad], symmetric above or below its centre."""
    sign = 1.0 if up else -1.0
    angles = np.linspace(-half, half, 61)
    x, y = centre[0] + radius * np.sin(angles), centre[1] + sign * radius * np.cos(angles)
    line(axes, list(x), list(y), lw=0.7)
    for tip, before in ((0, 4), (-1, -5)):
        arrow(axes, (x[before], y[before]), (x[tip], y[tip]))
    for angle in (-half, half):
        way = np.array([np.sin(angle), sign * np.cos(angle)])
        ends = np.asarray(centre) + np.outer([radius - 0.1, radius + 0.05], way)
        line(axes, list(ends[:, 0]), list(ends[:, 1]))
