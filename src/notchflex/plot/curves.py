"""Angles against tension or stroke: the total as a loop, the notches with where they are closed."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
from matplotlib.axes import Axes
from numpy.typing import NDArray

from notchflex.plot.drive import LETTING_GO, PULLING, abscissa, branches, drive
from notchflex.plot.style import BLUE, VERMILLION, legend_beside, sequence_colours
from notchflex.results.quantities import QUANTITIES

if TYPE_CHECKING:
    from notchflex.statics import Path

COLOUR = {PULLING: BLUE, LETTING_GO: VERMILLION}
LINE: dict[str, Any] = {PULLING: "-", LETTING_GO: (0, (4, 2))}
MOST_NAMES = 12
"""More notches than this are not all named in a legend."""


def draw_total(axes: Axes, path: Path) -> None:
    """Draw the total angle against tension or stroke, pulling and letting go apart."""
    quantity = QUANTITIES["total_angle"]
    x, label = abscissa(path)
    y = _converged(path, path.total_angle * quantity.scale)
    named: set[str] = set()
    for part, growing in branches(drive(path)):
        way = PULLING if growing else LETTING_GO
        axes.plot(
            x[part],
            y[part],
            color=COLOUR[way],
            linestyle=LINE[way],
            marker=_marker(part),
            label=None if way in named else way,
        )
        named.add(way)
    axes.set_xlabel(label)
    axes.set_ylabel(quantity.label)
    mark_failures(axes, path, x)
    if len(named) > 1 or not np.all(path.converged):
        axes.legend(loc="best")


def draw_notches(axes: Axes, path: Path) -> None:
    """Draw the angle of every notch; dots mark where a notch is closed."""
    quantity = QUANTITIES["notch_angle"]
    x, label = abscissa(path)
    angles = _converged(path, path.notch_angle * quantity.scale)
    closed = np.asarray(path.closed) & np.asarray(path.converged)[:, None]
    count = angles.shape[1]
    named = range(count)
    if count > MOST_NAMES:  # a few, the first and the last among them
        named = np.unique(np.linspace(0, count - 1, MOST_NAMES // 2).round().astype(int))
    for notch, colour in enumerate(sequence_colours(count)):
        for order, (part, growing) in enumerate(branches(drive(path))):
            axes.plot(
                x[part],
                angles[part, notch],
                color=colour,
                linestyle=LINE[PULLING if growing else LETTING_GO],
                marker=_marker(part),
                label=f"notch {notch + 1}" if order == 0 and notch in named else None,
            )
        there = closed[:, notch]
        axes.plot(x[there], angles[there, notch], "o", color=colour, markersize=3.0)
    if closed.any():
        axes.plot([], [], "o", color="0.3", markersize=3.0, label="closed")
    axes.set_xlabel(label)
    axes.set_ylabel(quantity.label)
    legend_beside(axes)
    mark_failures(axes, path, x)


def mark_failures(axes: Axes, path: Path, x: NDArray[np.float64]) -> None:
    """Mark the steps that were not solved by dotted lines."""
    failed = ~np.asarray(path.converged)
    places = x[failed]
    places = places[np.isfinite(places)]
    for order, place in enumerate(places):
        label = None if order else "not converged"
        axes.axvline(place, color="0.4", linewidth=0.8, linestyle=":", label=label)


def _converged(path: Path, values: NDArray[np.float64]) -> NDArray[np.float64]:
    values = np.array(values, dtype=float)
    values[~np.asarray(path.converged)] = np.nan
    return values


def _marker(part: slice) -> str | None:
    return "o" if part.stop - part.start == 1 else None
