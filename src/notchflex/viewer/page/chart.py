"""Draws a panel of lines as SVG text, which any browser can redraw many times a second.

viser's plots are slower. Two charts renewed 10 times a second left 55 frames a second as SVG and 18
as plotly figures, in a browser without a graphics card; uPlot cannot draw a loop.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from html import escape

import numpy as np

from notchflex.plotting.sheet import Line, Panel

WIDTH, HEIGHT = 290, 190
LEFT, RIGHT, TOP, BOTTOM = 46, 12, 8, 36
MOST_POINTS = 1500
"""Lines with more points are thinned, except for their ends."""

INK, GRID = "#444444", "#dddddd"

Place = Callable[[float], float]


def chart(panel: Panel, name: str) -> str:
    """Draw the lines of a panel over axes that include 0.

    Args:
        panel: A panel of lines; the last one is in front.
        name: Accessible name of the chart.

    Returns:
        An SVG element.

    Example:
        >>> rise = Line([[0.0, 0.0], [2.0, 90.0]], "#0072B2")
        >>> chart(Panel([rise], "tension [N]", "angle [deg]"), "loop")[:4]
        '<svg'
    """
    lines = [item for item in panel.items if isinstance(item, Line)]
    points = np.concatenate([line.rows for line in lines])
    x_ticks, y_ticks = ticks(points[:, 0]), ticks(points[:, 1])
    low, end = HEIGHT - BOTTOM, WIDTH - RIGHT

    def right(value: float) -> float:
        return LEFT + (value - x_ticks[0]) / (x_ticks[-1] - x_ticks[0]) * (end - LEFT)

    def down(value: float) -> float:
        return low - (value - y_ticks[0]) / (y_ticks[-1] - y_ticks[0]) * (low - TOP)

    parts = [
        f'<svg viewBox="0 0 {WIDTH} {HEIGHT}" width="100%" role="img" '
        f'aria-label="{escape(name)}" font-family="sans-serif" font-size="11" fill="{INK}">'
    ]
    for value in x_ticks:
        at = f"{right(value):.1f}"
        parts.append(f'<path d="M{at} {TOP}V{low}" stroke="{GRID}"/>')
        parts.append(f'<text x="{at}" y="{low + 14}" text-anchor="middle">{value:g}</text>')
    for value in y_ticks:
        at = down(value)
        parts.append(f'<path d="M{LEFT} {at:.1f}H{end}" stroke="{GRID}"/>')
        parts.append(f'<text x="{LEFT - 5}" y="{at + 4:.1f}" text-anchor="end">{value:g}</text>')
    parts += [_drawn(line, right, down) for line in lines]
    parts.append(
        f'<text x="{0.5 * (LEFT + end)}" y="{HEIGHT - 8}" text-anchor="middle" font-size="12">'
        f"{escape(panel.x_label)}</text>"
        f'<text transform="translate(13 {0.5 * (TOP + low)}) rotate(-90)" text-anchor="middle" '
        f'font-size="12">{escape(panel.y_label)}</text></svg>'
    )
    return "".join(parts)


def ticks(values: Sequence[float] | np.ndarray) -> list[float]:
    """Return round numbers at equal distances that include 0 and all values.

    Example:
        >>> ticks([0.3, 2.7])
        [0.0, 0.5, 1.0, 1.5, 2.0, 2.5, 3.0]
    """
    from matplotlib.ticker import MaxNLocator

    low, high = float(np.min(values, initial=0.0)), float(np.max(values, initial=0.0))
    high = low + 1.0 if high - low < 1e-9 else high
    found = MaxNLocator(6, steps=[1, 2, 5, 10]).tick_values(low, high)
    return [float(f"{value:.10g}") for value in found]


def _drawn(line: Line, right: Place, down: Place) -> str:
    rows = line.rows
    if len(rows) > MOST_POINTS:
        rows = rows[np.linspace(0, len(rows) - 1, MOST_POINTS).round().astype(int)]
    points = [(right(x), down(y)) for x, y in rows.tolist()]
    text = ""
    if line.dash is not None and len(points) > 1:
        named = f"<title>{escape(line.name)}</title>" if line.name else ""
        way = "L".join(f"{x:.1f} {y:.1f}" for x, y in points)
        text = (
            f'<path d="M{way}" fill="none" stroke="{line.colour}" stroke-width="{line.width}" '
            f'stroke-linejoin="round">{named}</path>'
        )
    if line.marker:
        ball = f'r="{0.5 * line.size}" fill="{line.colour}"/>'
        text += "".join(f'<circle cx="{x:.1f}" cy="{y:.1f}" {ball}' for x, y in points)
    return text
