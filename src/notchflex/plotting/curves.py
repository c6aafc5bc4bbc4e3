"""Angles, strains and tension over the load: loops, and what every notch does."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from notchflex.plotting.drive import LOADING, UNLOADING, abscissa, branches, drive
from notchflex.plotting.sheet import (
    BESIDE,
    DASHED,
    INSIDE,
    SOLID,
    Colour,
    Item,
    Level,
    Line,
    Panel,
    Upright,
)
from notchflex.plotting.style import BLUE, VERMILLION, sequence_colours
from notchflex.results.quantities.registry import QUANTITIES

if TYPE_CHECKING:
    from notchflex.results import EquilibriumPath

COLOUR = {LOADING: BLUE, UNLOADING: VERMILLION}
LINE = {LOADING: SOLID, UNLOADING: DASHED}
MOST_NAMES = 12
"""More notches than this are not all named in a legend."""


def total_panel(path: EquilibriumPath) -> Panel:
    """Return the total angle against tension or stroke, loading and unloading apart."""
    quantity = QUANTITIES["total_angle"]
    x, label = abscissa(path)
    y = solved_only(path, path.total_angle * quantity.scale)
    items = list(_ways(path, np.stack([x, y], axis=1)))
    items += failures(path, x)
    told = len(items) > 1 or not np.all(path.converged)
    return Panel(items, label, quantity.label, legend=INSIDE if told else "")


def notches_panel(path: EquilibriumPath) -> Panel:
    """Return the angle of every notch; dots mark where a notch is closed."""
    quantity = QUANTITIES["notch_angle"]
    x, label = abscissa(path)
    angles = solved_only(path, path.notch_angle * quantity.scale)
    closed = np.asarray(path.closed) & np.asarray(path.converged)[:, None]
    items: list[Item] = []
    for notch, colour in enumerate(sequence_colours(angles.shape[1])):
        items += _of_notch(path, x, angles, notch, colour)
        there = closed[:, notch]
        if there.any():
            dots = np.stack([x[there], angles[there, notch]], axis=1)
            group = _notch_name(notch)
            items.append(Line(dots, colour, None, marker="o", group=group, layer=3))
    if closed.any():
        items.append(Line([], "#4c4c4c", None, marker="o", name="closed"))
    items += failures(path, x)
    return Panel(items, label, quantity.label, legend=BESIDE)


def strain_panel(path: EquilibriumPath) -> Panel:
    """Return the peak strain of every notch, with what the material is allowed."""
    x, label = abscissa(path)
    strain = solved_only(path, 100.0 * np.abs(path.peak_strain))
    items: list[Item] = []
    for notch, colour in enumerate(sequence_colours(strain.shape[1])):
        items += _of_notch(path, x, strain, notch, colour, named=False)
    allowed = path.robot.material.allowed_strain
    if allowed is not None:
        name = f"allowed {100.0 * allowed:.3g} %"
        items.append(Level(100.0 * allowed, VERMILLION, DASHED, 1.2, name=name))
    items += failures(path, x)
    return Panel(
        items,
        label,
        f"{QUANTITIES['peak_strain'].title} of every notch [%]",
        legend="" if allowed is None else INSIDE,
        y_range=(0.0, None),
    )


def stroke_panel(path: EquilibriumPath, tendon: int) -> Panel:
    """Return the tension of a tendon (from 0) over its stroke: the loop that friction makes."""
    points = np.stack([path.stroke[:, tendon], solved_only(path, path.tension)[:, tendon]], axis=1)
    items = list(_ways(path, points))
    several = path.tension.shape[1] > 1
    labels = [
        QUANTITIES[name].label.replace(
            QUANTITIES[name].title, f"{name} of tendon {tendon + 1}" if several
            else QUANTITIES[name].title, 1,
        )
        for name in ("stroke", "tension")
    ]  # fmt: skip
    items += failures(path, path.commanded_stroke[:, tendon])
    return Panel(items, labels[0], labels[1], legend=INSIDE, y_range=(0.0, None))


def _ways(path: EquilibriumPath, points: NDArray[np.float64]) -> Iterator[Item]:
    """The branches of a loop, loading and unloading apart, each named once."""
    named: set[str] = set()
    for part, growing in branches(drive(path)):
        way = LOADING if growing else UNLOADING
        name = "" if way in named else way
        marker = _marker(part)
        yield Line(
            points[part], COLOUR[way], LINE[way], marker=marker, name=name, group=way, told=True
        )
        named.add(way)


def _of_notch(
    path: EquilibriumPath,
    x: NDArray[np.float64],
    values: NDArray[np.float64],
    notch: int,
    colour: Colour,
    *,
    named: bool = True,
) -> Iterator[Item]:
    """The branches of what a notch has, in its colour."""
    count = values.shape[1]
    chosen: Any = range(count)
    if count > MOST_NAMES:  # a few, the first and the last among them
        chosen = np.unique(np.linspace(0, count - 1, MOST_NAMES // 2).round().astype(int))
    group = _notch_name(notch)
    for order, (part, growing) in enumerate(branches(drive(path))):
        yield Line(
            np.stack([x[part], values[part, notch]], axis=1),
            colour,
            LINE[LOADING if growing else UNLOADING],
            marker=_marker(part),
            name=group if named and order == 0 and notch in chosen else "",
            group=group,
            told=True,
        )


def _notch_name(notch: int) -> str:
    return f"notch {notch + 1}"


def failures(path: EquilibriumPath, x: NDArray[np.float64]) -> Iterator[Item]:
    """Mark the steps that were not solved by dotted lines."""
    places = x[~np.asarray(path.converged)]
    for order, place in enumerate(places[np.isfinite(places)]):
        yield Upright(float(place), name="" if order else "not converged")


def solved_only(path: EquilibriumPath, values: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return values with NaN in the steps that did not converge."""
    values = np.array(values, dtype=float)
    values[~np.asarray(path.converged)] = np.nan
    return values


def _marker(part: slice) -> str:
    return "o" if part.stop - part.start == 1 else ""
