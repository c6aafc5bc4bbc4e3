"""Small charts as SVG text: light enough to be drawn anew many times a second, by any browser."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from html import escape

import numpy as np
from numpy.typing import NDArray

WIDTH, HEIGHT = 290, 190
LEFT, RIGHT, TOP, BOTTOM = 46, 12, 8, 36
MOST_POINTS = 1500
"""More points of a line are thinned, but for its ends."""

INK, GRID = "#444444", "#dddddd"


@dataclass(frozen=True)
class Line:
    """Points that are joined, or stand alone.

    Attributes:
        x: Their places, (k,).
        y: Their heights, (k,).
        colour: Colour of the line, as a page writes it.
        width: Width of the line, pixels; 0 joins nothing.
        dots: Colours of dots at the points, one each, or a single one for all; none if empty.
        size: Radius of the dots, pixels.
        name: What it is called by who reads the page.
    """

    x: NDArray[np.float64]
    y: NDArray[np.float64]
    colour: str
    width: float = 2.0
    dots: Sequence[str] = ()
    size: float = 3.0
    name: str = ""


def chart(lines: Sequence[Line], x_label: str, y_label: str, name: str) -> str:
    """Draw lines over common axes that begin at 0.

    Args:
        lines: What to draw, the last one above the others.
        x_label: Text of the horizontal axis, with its unit.
        y_label: Text of the vertical axis, with its unit.
        name: What the chart shows, for who reads the page and does not see it.

    Returns:
        An SVG element.

    Example:
        >>> rise = Line(np.array([0.0, 2.0]), np.array([0.0, 90.0]), "#0072B2")
        >>> chart([rise], "tension [N]", "angle [deg]", "loop")[:4]
        '<svg'
    """
    x_ticks = ticks([value for line in lines for value in (line.x.min(), line.x.max())])
    y_ticks = ticks([value for line in lines for value in (line.y.min(), line.y.max())])

    def right(value: float) -> float:
        part = (value - x_ticks[0]) / (x_ticks[-1] - x_ticks[0])
        return LEFT + part * (WIDTH - LEFT - RIGHT)

    def down(value: float) -> float:
        part = (value - y_ticks[0]) / (y_ticks[-1] - y_ticks[0])
        return HEIGHT - BOTTOM - part * (HEIGHT - TOP - BOTTOM)

    top, low = TOP, HEIGHT - BOTTOM
    parts = [
        f'<svg viewBox="0 0 {WIDTH} {HEIGHT}" width="100%" role="img" '
        f'aria-label="{escape(name)}" font-family="sans-serif" font-size="11" fill="{INK}">'
    ]
    for value in x_ticks:
        at = f"{right(value):.1f}"
        parts.append(f'<path d="M{at} {top}V{low}" stroke="{GRID}"/>')
        parts.append(f'<text x="{at}" y="{low + 14}" text-anchor="middle">{value:g}</text>')
    for value in y_ticks:
        at = down(value)
        parts.append(f'<path d="M{LEFT} {at:.1f}H{WIDTH - RIGHT}" stroke="{GRID}"/>')
        parts.append(f'<text x="{LEFT - 5}" y="{at + 4:.1f}" text-anchor="end">{value:g}</text>')
    parts += [_drawn(line, right, down) for line in lines]
    middle_x, middle_y = 0.5 * (LEFT + WIDTH - RIGHT), 0.5 * (top + low)
    parts.append(
        f'<text x="{middle_x}" y="{HEIGHT - 8}" text-anchor="middle" font-size="12">'
        f"{escape(x_label)}</text>"
        f'<text transform="translate(13 {middle_y}) rotate(-90)" text-anchor="middle" '
        f'font-size="12">{escape(y_label)}</text></svg>'
    )
    return "".join(parts)


def ticks(values: Sequence[float], most: int = 6) -> list[float]:
    """Return round numbers, evenly spread, that take in 0 and all values.

    Example:
        >>> ticks([0.3, 2.7])
        [0.0, 0.5, 1.0, 1.5, 2.0, 2.5, 3.0]
    """
    low, high = min(0.0, *values), max(0.0, *values)
    if high - low < 1e-9:
        high = low + 1.0
    rough = (high - low) / most
    power = 10.0 ** math.floor(math.log10(rough))
    step = next(f * power for f in (1.0, 2.0, 5.0, 10.0) if f * power >= rough * (1.0 - 1e-9))
    first, last = math.floor(low / step + 1e-9), math.ceil(high / step - 1e-9)
    return [float(f"{number * step:.10g}") for number in range(first, last + 1)]


def _drawn(line: Line, right: object, down: object) -> str:
    assert callable(right)
    assert callable(down)
    kept = list(range(len(line.x)))
    if len(kept) > MOST_POINTS:
        kept = [round(at) for at in np.linspace(0, len(kept) - 1, MOST_POINTS).tolist()]
    points = [(right(line.x[i]), down(line.y[i])) for i in kept]
    text = ""
    if line.width > 0.0 and len(points) > 1:
        way = "L".join(f"{x:.1f} {y:.1f}" for x, y in points)
        named = f"<title>{escape(line.name)}</title>" if line.name else ""
        text += (
            f'<path d="M{way}" fill="none" stroke="{line.colour}" stroke-width="{line.width}" '
            f'stroke-linejoin="round">{named}</path>'
        )
    if line.dots:
        colours = [line.dots[i % len(line.dots)] for i in kept]
        text += "".join(
            f'<circle cx="{x:.1f}" cy="{y:.1f}" r="{line.size}" fill="{colour}"/>'
            for (x, y), colour in zip(points, colours, strict=True)
        )
    return text


__all__ = ["Line", "chart", "ticks"]
