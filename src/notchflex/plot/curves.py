"""Angles against tension: the total as a loop, the notches with where they are closed."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING

import numpy as np
from matplotlib.axes import Axes
from numpy.typing import NDArray

from notchflex.plot.style import BLUE, VERMILLION, legend_beside, sequence_colours
from notchflex.results.quantities import QUANTITIES

if TYPE_CHECKING:
    from notchflex.statics import Path

LOADING, UNLOADING = "-", (0, (4, 2))


def abscissa(path: Path) -> tuple[NDArray[np.float64], str]:
    """Return what a path is drawn against: the one tension that changes, or the step.

    Returns:
        Values (S,) and the label of the axis.
    """
    tension = path.tension
    good = np.asarray(path.converged)
    spread = np.ptp(tension[good], axis=0) if good.any() else np.zeros(tension.shape[1])
    changing = np.flatnonzero(spread > 1e-12)
    if len(changing) == 1 or len(path) == 1:
        index = int(changing[0]) if len(changing) else 0
        quantity = QUANTITIES["tension"]
        which = f" {index + 1}" if tension.shape[1] > 1 else ""
        label = quantity.label.replace("tendon tension", f"tension of tendon{which}".rstrip())
        return tension[:, index], label if which else quantity.label
    return np.arange(1.0, len(path) + 1.0), "step"


def branches(x: NDArray[np.float64]) -> Iterator[tuple[slice, bool]]:
    """Split a path where its abscissa turns.

    Args:
        x: Abscissa of each step, (S,).

    Yields:
        The steps of each branch, first and last included, and whether x grows on it.

    Example:
        >>> [(part.start, part.stop, up) for part, up in branches(np.array([0.0, 1.0, 2.0, 1.0]))]
        [(0, 3, True), (2, 4, False)]
    """
    change = np.sign(np.diff(x))
    start, direction = 0, 0.0
    for index, sign in enumerate(change):
        if sign and direction and sign != direction:
            yield slice(start, index + 1), bool(direction > 0)
            start = index
        direction = sign or direction
    yield slice(start, len(x)), bool(direction >= 0)


def draw_total(axes: Axes, path: Path) -> None:
    """Draw the total angle against tension, loading and unloading apart."""
    quantity = QUANTITIES["total_angle"]
    x, label = abscissa(path)
    y = _converged(path, path.total_angle * quantity.scale)
    named: set[bool] = set()
    for part, growing in branches(x):
        axes.plot(
            x[part],
            y[part],
            color=BLUE if growing else VERMILLION,
            linestyle=LOADING if growing else UNLOADING,
            marker=_marker(part),
            label=None if growing in named else ("pulling" if growing else "letting go"),
        )
        named.add(growing)
    axes.set_xlabel(label)
    axes.set_ylabel(quantity.label)
    if len(named) > 1:
        axes.legend(loc="lower right")
    _mark_failures(axes, path, x)


def draw_notches(axes: Axes, path: Path) -> None:
    """Draw the angle of every notch against tension; dots mark where a notch is closed."""
    quantity = QUANTITIES["notch_angle"]
    x, label = abscissa(path)
    angles = _converged(path, path.notch_angle * quantity.scale)
    closed = np.asarray(path.closed) & np.asarray(path.converged)[:, None]
    colours = sequence_colours(angles.shape[1])
    for notch, colour in enumerate(colours):
        for order, (part, growing) in enumerate(branches(x)):
            axes.plot(
                x[part],
                angles[part, notch],
                color=colour,
                linestyle=LOADING if growing else UNLOADING,
                marker=_marker(part),
                label=f"notch {notch + 1}" if order == 0 else None,
            )
        there = closed[:, notch]
        axes.plot(x[there], angles[there, notch], "o", color=colour, markersize=3.0)
    if closed.any():
        axes.plot([], [], "o", color="0.3", markersize=3.0, label="closed")
    axes.set_xlabel(label)
    axes.set_ylabel(quantity.label)
    legend_beside(axes, ncols=1 + len(colours) // 12)
    _mark_failures(axes, path, x)


def _converged(path: Path, values: NDArray[np.float64]) -> NDArray[np.float64]:
    values = np.array(values, dtype=float)
    values[~np.asarray(path.converged)] = np.nan
    return values


def _mark_failures(axes: Axes, path: Path, x: NDArray[np.float64]) -> None:
    failed = ~np.asarray(path.converged)
    places = x[failed]
    places = places[np.isfinite(places)]
    for order, place in enumerate(places):
        label = None if order else "not converged"
        axes.axvline(place, color="0.4", linewidth=0.8, linestyle=":", label=label)


def _marker(part: slice) -> str | None:
    return "o" if part.stop - part.start == 1 else None
