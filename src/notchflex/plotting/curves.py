"""Angles against tension or stroke: the total as a loop, the notches with where they are closed."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from notchflex.plotting.drive import LETTING_GO, PULLING, abscissa, branches, drive
from notchflex.plotting.sheet import BESIDE, DASHED, INSIDE, SOLID, Item, Line, Panel, Upright
from notchflex.plotting.style import BLUE, VERMILLION, sequence_colours
from notchflex.results.quantities import QUANTITIES

if TYPE_CHECKING:
    from notchflex.statics import Path

COLOUR = {PULLING: BLUE, LETTING_GO: VERMILLION}
LINE = {PULLING: SOLID, LETTING_GO: DASHED}
MOST_NAMES = 12
"""More notches than this are not all named in a legend."""


def total_panel(path: Path) -> Panel:
    """Return the total angle against tension or stroke, pulling and letting go apart."""
    quantity = QUANTITIES["total_angle"]
    x, label = abscissa(path)
    y = solved_only(path, path.total_angle * quantity.scale)
    items: list[Item] = []
    named: set[str] = set()
    for part, growing in branches(drive(path)):
        way = PULLING if growing else LETTING_GO
        items.append(
            Line(
                np.stack([x[part], y[part]], axis=1),
                COLOUR[way],
                LINE[way],
                marker=_marker(part),
                name="" if way in named else way,
                group=way,
                told=True,
            )
        )
        named.add(way)
    items += failures(path, x)
    told = len(named) > 1 or not np.all(path.converged)
    return Panel(items, label, quantity.label, legend=INSIDE if told else "")


def notches_panel(path: Path) -> Panel:
    """Return the angle of every notch; dots mark where a notch is closed."""
    quantity = QUANTITIES["notch_angle"]
    x, label = abscissa(path)
    angles = solved_only(path, path.notch_angle * quantity.scale)
    closed = np.asarray(path.closed) & np.asarray(path.converged)[:, None]
    count = angles.shape[1]
    named: Any = range(count)
    if count > MOST_NAMES:  # a few, the first and the last among them
        named = np.unique(np.linspace(0, count - 1, MOST_NAMES // 2).round().astype(int))
    items: list[Item] = []
    for notch, colour in enumerate(sequence_colours(count)):
        group = f"notch {notch + 1}"
        for order, (part, growing) in enumerate(branches(drive(path))):
            items.append(
                Line(
                    np.stack([x[part], angles[part, notch]], axis=1),
                    colour,
                    LINE[PULLING if growing else LETTING_GO],
                    marker=_marker(part),
                    name=group if order == 0 and notch in named else "",
                    group=group,
                    told=True,
                )
            )
        there = closed[:, notch]
        if there.any():
            dots = np.stack([x[there], angles[there, notch]], axis=1)
            items.append(Line(dots, colour, None, marker="o", group=group, layer=3))
    if closed.any():
        items.append(Line([], "#4c4c4c", None, marker="o", name="closed"))
    items += failures(path, x)
    return Panel(items, label, quantity.label, legend=BESIDE)


def failures(path: Path, x: NDArray[np.float64]) -> Iterator[Item]:
    """Mark the steps that were not solved by dotted lines."""
    places = x[~np.asarray(path.converged)]
    for order, place in enumerate(places[np.isfinite(places)]):
        yield Upright(float(place), name="" if order else "not converged")


def solved_only(path: Path, values: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return values with NaN in the steps that did not converge."""
    values = np.array(values, dtype=float)
    values[~np.asarray(path.converged)] = np.nan
    return values


def _marker(part: slice) -> str:
    return "o" if part.stop - part.start == 1 else ""
