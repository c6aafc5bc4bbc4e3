"""The picture of a tolerance analysis: histograms with limits, and bars of sensitivity."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from jaxtyping import Float

from notchflex.plotting.output import Picture
from notchflex.plotting.sheet import DASHED, Area, Bars, Curve, Mark, Note, Panel, Span, grid
from notchflex.plotting.style import BLUE, GREEN, GREY, ORANGE, PURPLE, SKY, VERMILLION

if TYPE_CHECKING:
    from notchflex.tolerancing import ToleranceAnalysis

MAX_LIMITS, MAX_BARS = 4, 12
_BINS = 60


def tolerance_picture(found: ToleranceAnalysis) -> Picture:
    """Describe what tolerances do to a robot.

    For every limit, of many those that reject most, the histogram of drawn robots with the limits,
    the value of the drawing and the worst case; bars of the parts of the variance, and of the yield
    if one dimension were exact.

    Args:
        found: The analysis.
    """
    outside = found.below + found.above
    shown = np.sort(np.argsort(-outside, kind="stable")[:MAX_LIMITS])
    panels = [_histogram(found, int(index)) for index in shown]
    order = [int(one) for one in found.order[:MAX_BARS]]
    worst = int(np.argmax(outside))
    panels += [_sensitivity(found, worst, order), _yields(found, order)]
    columns = min(len(panels), 3)
    rows = -(-len(panels) // columns)
    low, high = (100.0 * end for end in found.interval)
    title = (
        f"{found.robot.name}: yield {100.0 * found.accepted_fraction:.1f} % "
        f"({low:.1f} to {high:.1f} %) of {found.draws} robots"
    )
    cells, size = grid(panels, columns), (0.8 + 4.2 * columns, 1.0 + 3.0 * rows)
    return Picture(title, *size, cells, _legend(found))


def _legend(analysis: ToleranceAnalysis) -> list[Curve | Area]:
    """Return what the colours of all panels mean."""
    nothing = np.zeros((0, 2))
    entries: list[Curve | Area] = [
        Area([], BLUE, BLUE, name="within the limits"),
        Area([], ORANGE, ORANGE, name="outside"),
        Curve(nothing, VERMILLION, name="limit"),
        Curve(nothing, GREEN, name="drawing; yield as it is"),
        Curve(nothing, GREY, DASHED, name="worst case"),
    ]
    if analysis.wanted_yield is not None:
        entries.append(Curve(nothing, PURPLE, name="wanted yield"))
    return entries


def _histogram(analysis: ToleranceAnalysis, index: int) -> Panel:
    one = analysis.criteria[index]
    scale = one.quantity.scale
    unit = f" [{one.quantity.unit}]" if one.quantity.unit else ""
    edges, count = analysis.drawn.histogram(index, _BINS)
    edges = edges * scale
    label = f"{one.name.replace('_', ' ')}{unit}"
    if not len(count):
        return Panel([Note("no robot has a result")], label, "robots [%]")
    tops = 100.0 * count / analysis.draws
    lower, upper = one.lower * scale, one.upper * scale
    inside = (edges[:-1] >= lower) & (edges[1:] <= upper)
    items: list[Mark] = []
    for name, part, colour in (("within", inside, BLUE), ("outside", ~inside, ORANGE)):
        if (part & (count > 0)).any():
            items.append(Area(_steps(edges, tops, part), colour, colour, width=0.0, name=name))
    for end in (lower, upper):
        if np.isfinite(end):
            items.append(Span("x", end, end, VERMILLION, width=1.4, layer=4, name="limit"))
    nominal = analysis.linear.nominal[index] * scale
    items.append(Span("x", nominal, nominal, GREEN, width=1.4, layer=4, name="drawing"))
    for end in analysis.linear.worst_case[index] * scale:
        items.append(
            Span("x", end, end, GREY, dash=DASHED, layer=3, name="worst case", group="worst case")
        )
    return Panel(items, label, "robots [%]", y_range=(0.0, None))


def _steps(
    edges: Float[np.ndarray, " bins"], tops: Float[np.ndarray, " b"], part: np.ndarray
) -> list[Float[np.ndarray, "4 2"]]:
    """Return the rectangles of some bins."""
    return [
        np.array([[low, 0.0], [low, top], [high, top], [high, 0.0]])
        for low, high, top in zip(edges[:-1][part], edges[1:][part], tops[part], strict=True)
        if top > 0.0
    ]


def _sensitivity(analysis: ToleranceAnalysis, index: int, order: list[int]) -> Panel:
    total = np.nan_to_num(analysis.sobol.total[index])
    names = [analysis.sources[one] for one in order]
    bars = Bars(list(total[order]), names, [SKY] * len(order))
    label = f"part of the variance of {analysis.criteria[index].name.replace('_', ' ')} [-]"
    return Panel([bars], label, "", x_range=(0.0, None), title="total Sobol index")


def _yields(analysis: ToleranceAnalysis, order: list[int]) -> Panel:
    names = [analysis.sources[one] for one in order]
    now = 100.0 * analysis.accepted_fraction
    bars = Bars([100.0 * analysis.control.exact[one] for one in order], names, [SKY] * len(order))
    items: list[Mark] = [bars, Span("x", now, now, GREEN, width=1.4, layer=4, name="as it is")]
    if analysis.wanted_yield is not None:
        target = 100.0 * analysis.wanted_yield
        items.append(Span("x", target, target, PURPLE, width=1.4, layer=4, name="wanted"))
    return Panel(items, "yield [%]", "", title="yield if one dimension were exact")
