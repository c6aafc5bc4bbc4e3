"""The two live charts: the loop of the whole robot, and the tension along one tendon.

They are SVG text, because viser's plots are slower: two charts renewed 10 times a second left 55
frames a second as SVG and 18 as plotly figures, in a browser without a graphics card; uPlot cannot
draw a loop.
"""

from __future__ import annotations

from collections.abc import Sequence
from html import escape

import numpy as np
from numpy.typing import NDArray

from notchflex.plotting import COLOUR, Curve, Mark, Panel, branches, dots
from notchflex.support import QUANTITIES
from notchflex.viewer.scene.marks import TENDON, contact_colours, css
from notchflex.viewer.session import Session

WIDTH, HEIGHT = 290, 190
LEFT, RIGHT, TOP, BOTTOM = 46, 12, 8, 36
MAX_POINTS = 1500
"""Lines with more points are thinned, except for their ends."""

INK, GRID, BEFORE = "#444444", "#dddddd", "#b5b5b5"


def axis(name: str) -> str:
    """Return the label of a quantity without its symbol."""
    quantity = QUANTITIES[name]
    return f"{quantity.title} [{quantity.unit}]"


def loop(session: Session, tendon: int) -> Panel:
    """Return the total angle against tension or stroke of a tendon (from 0), since rest.

    It is against what is prescribed now. Loading and unloading have their colours; the loop of the
    robot before its last change is grey.
    """
    by = session.controls.by[tendon]
    units = [1.0, QUANTITIES["total_angle"].scale]
    items: list[Mark] = []
    if session.before is not None:
        points = session.before.loop(tendon, by) * units
        items.append(Curve(points, BEFORE, width=2.0, name="before the change"))
    points = session.history.loop(tendon, by) * units
    for part, way in branches(points[:, 0]) if len(points) > 1 else ():
        items.append(Curve(points[part], COLOUR[way], width=2.0, name=way))
    items.append(dots(points[-1:], "#111111", 9.0, name="now"))
    x_label = axis(by)
    if session.robot.number_of_tendons > 1:
        x_label = x_label.replace(f"tendon {by}", f"{by} of tendon {tendon + 1}")
    return Panel(items, x_label, axis("total_angle"), legend="")


def loop_chart(session: Session, tendon: int) -> str:
    """Draw `loop` as an SVG element."""
    return chart(loop(session, tendon), f"total angle against {session.controls.by[tendon]}")


def tendon_chart(session: Session, tendon: int) -> str:
    """Draw the tension along a tendon (from 0), with a dot for each contact by its state."""
    spans = np.asarray(session.state.span_tension, float)[tendon]
    spans = spans[np.isfinite(spans)]
    # The tension is constant in a span; the contact at its end changes it.
    edges = np.arange(len(spans) + 1.0)
    steps = np.stack([np.repeat(edges, 2)[1:-1], np.repeat(spans, 2)], axis=1)
    items: list[Mark] = [Curve(steps, css(TENDON), width=2.0, name="tension")]
    colours = np.array(contact_colours(session.state, tendon))
    contacts = np.stack([edges[1:-1], spans[1:]], axis=1)
    for colour in dict.fromkeys(colours.tolist()):
        items.append(dots(contacts[colours == colour], colour, 6.4))
    of = f" {tendon + 1}" if session.robot.number_of_tendons > 1 else ""
    label = f"contact of tendon{of}, from 1 at the base"
    return chart(Panel(items, label, axis("span_tension")), "tension along the tendon")


def chart(panel: Panel, name: str) -> str:
    """Draw the lines of a panel over axes that include 0 as an SVG element with a name.

    Example:
        >>> rise = Curve([[0.0, 0.0], [2.0, 90.0]], "#0072B2")
        >>> chart(Panel([rise], "tension [N]", "angle [deg]"), "loop")[:4]
        '<svg'
    """
    lines = [item for item in panel.items if isinstance(item, Curve)]
    points = np.concatenate([line.rows for line in lines])
    x_ticks, y_ticks = ticks(points[:, 0]), ticks(points[:, 1])
    low, end = HEIGHT - BOTTOM, WIDTH - RIGHT
    first = np.array([x_ticks[0], y_ticks[0]])
    scale = np.array([end - LEFT, TOP - low]) / ([x_ticks[-1], y_ticks[-1]] - first)

    def pixels(rows: NDArray[np.float64]) -> list[list[float]]:
        return ([LEFT, low] + (rows - first) * scale).tolist()

    parts = [
        f'<svg viewBox="0 0 {WIDTH} {HEIGHT}" width="100%" role="img" '
        f'aria-label="{escape(name)}" font-family="sans-serif" font-size="11" fill="{INK}">'
    ]
    for value in x_ticks:
        ((x, _),) = pixels(np.array([[value, 0.0]]))
        parts.append(f'<path d="M{x:.1f} {TOP}V{low}" stroke="{GRID}"/>')
        parts.append(f'<text x="{x:.1f}" y="{low + 14}" text-anchor="middle">{value:g}</text>')
    for value in y_ticks:
        ((_, y),) = pixels(np.array([[0.0, value]]))
        parts.append(f'<path d="M{LEFT} {y:.1f}H{end}" stroke="{GRID}"/>')
        parts.append(f'<text x="{LEFT - 5}" y="{y + 4:.1f}" text-anchor="end">{value:g}</text>')
    for line in lines:
        rows = line.rows
        if len(rows) > MAX_POINTS:
            rows = rows[np.linspace(0, len(rows) - 1, MAX_POINTS).round().astype(int)]
        parts.append(_drawn(line, pixels(rows)))
    parts.append(
        f'<text x="{0.5 * (LEFT + end)}" y="{HEIGHT - 8}" text-anchor="middle" font-size="12">'
        f"{escape(panel.x_label)}</text>"
        f'<text transform="translate(13 {0.5 * (TOP + low)}) rotate(-90)" text-anchor="middle" '
        f'font-size="12">{escape(panel.y_label)}</text></svg>'
    )
    return "".join(parts)


def ticks(values: Sequence[float] | NDArray[np.float64]) -> list[float]:
    """Return round numbers at equal distances that include 0 and all values.

    Example:
        >>> ticks([0.3, 2.7])
        [0.0, 0.5, 1.0, 1.5, 2.0, 2.5, 3.0]
    """
    from matplotlib.ticker import MaxNLocator

    low, high = float(np.min(values, initial=0.0)), float(np.max(values, initial=0.0))
    high = low + 1.0 if high - low < 1e-9 else high
    round_numbers = MaxNLocator(6, steps=[1, 2, 5, 10]).tick_values(low, high)
    return [float(f"{value:.10g}") for value in round_numbers]


def _drawn(line: Curve, points: list[list[float]]) -> str:
    """Return a line, and its markers as circles, at points [pixels]."""
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
