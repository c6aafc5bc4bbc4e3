"""Panels of curves over the load: total angle, notches, strains, tension over stroke."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from notchflex.plotting.branches import LOADING, UNLOADING, abscissa, branches, load_parameter
from notchflex.plotting.sheet import (
    BESIDE,
    DASHED,
    DOTTED,
    INSIDE,
    SOLID,
    Colour,
    Curve,
    Mark,
    Panel,
    Span,
    dots,
)
from notchflex.plotting.style import BLUE, VERMILLION, sequence_colours
from notchflex.results.quantities.registry import QUANTITIES

if TYPE_CHECKING:
    from notchflex.results import EquilibriumPath

COLOUR = {LOADING: BLUE, UNLOADING: VERMILLION}
LINE = {LOADING: SOLID, UNLOADING: DASHED}
NEUTRAL = "#4c4c4c"
"""Colour of legend entries that stand for marks of several colours."""
MOST_NAMES = 12
"""If a robot has more notches than this, a legend names some of them."""


def branch_lines(
    path: EquilibriumPath,
    points: NDArray[np.float64],
    colour: Colour | None = None,
    name: str | None = None,
    **look: Any,
) -> Iterator[Curve]:
    """Yield the branches of a curve (S, 2): loading solid, unloading dashed; converged steps only.

    Without a colour, loading and unloading have one each; without a name, each has its own. `look`
    are further options of `Curve`; `group` is the name if not given.
    """
    points = converged_only(path, points)
    named: set[str] = set()
    for part, way in branches(load_parameter(path)):
        label = way if name is None else name
        options: dict[str, Any] = {"group": label, "hover": True}
        options["marker"] = "o" if part.stop - part.start == 1 else ""
        shown = "" if label in named else label
        shade = COLOUR[way] if colour is None else colour
        yield Curve(points[part], shade, LINE[way], name=shown, **(options | look))
        named.add(label)


def total_panel(path: EquilibriumPath) -> Panel:
    """Return the total angle against tension or stroke."""
    quantity = QUANTITIES["total_angle"]
    x, label = abscissa(path)
    items: list[Mark] = [
        *branch_lines(path, np.stack([x, path.total_angle * quantity.scale], axis=1)),
        *failures(path, x),
    ]
    named = len(items) > 1 or not np.all(path.converged)
    return Panel(items, label, quantity.label, legend=INSIDE if named else "")


def notches_panel(path: EquilibriumPath) -> Panel:
    """Return the angle of every notch; dots mark closed notches."""
    quantity = QUANTITIES["notch_angle"]
    x, label = abscissa(path)
    angles = path.notch_angle * quantity.scale
    items = list(_notch_lines(path, x, angles))
    closed = np.asarray(path.closed) & np.asarray(path.converged)[:, None]
    for notch, colour in enumerate(sequence_colours(angles.shape[1])):
        there = closed[:, notch]
        if there.any():
            points = np.stack([x[there], angles[there, notch]], axis=1)
            items.append(dots(points, colour, group=f"notch {notch + 1}", layer=3))
    if closed.any():
        items.append(dots([], NEUTRAL, name="closed"))
    return Panel([*items, *failures(path, x)], label, quantity.label, legend=BESIDE)


def strain_panel(path: EquilibriumPath) -> Panel:
    """Return the peak strain of every notch, with the allowed strain of the material."""
    x, label = abscissa(path)
    items = list(_notch_lines(path, x, 100.0 * np.abs(path.peak_strain), named=False))
    allowed = path.robot.material.allowed_strain
    if allowed is not None:
        name = f"allowed {100.0 * allowed:.3g} %"
        at = 100.0 * allowed
        items.append(Span("y", at, at, VERMILLION, DASHED, 1.2, name=name))
    return Panel(
        [*items, *failures(path, x)],
        label,
        f"{QUANTITIES['peak_strain'].title} of every notch [%]",
        legend="" if allowed is None else INSIDE,
        y_range=(0.0, None),
    )


def stroke_panel(path: EquilibriumPath, tendon: int) -> Panel:
    """Return the tension of a tendon (from 0) over its stroke: the hysteresis of friction."""
    points = np.stack([path.stroke[:, tendon], path.tension[:, tendon]], axis=1)
    labels: list[str] = []
    for name in ("stroke", "tension"):
        quantity = QUANTITIES[name]
        title = f"{name} of tendon {tendon + 1}" if path.tension.shape[1] > 1 else quantity.title
        labels.append(quantity.label.replace(quantity.title, title, 1))
    items = [*branch_lines(path, points), *failures(path, path.commanded_stroke[:, tendon])]
    return Panel(items, labels[0], labels[1], legend=INSIDE, y_range=(0.0, None))


def _notch_lines(
    path: EquilibriumPath,
    x: NDArray[np.float64],
    values: NDArray[np.float64],
    *,
    named: bool = True,
) -> Iterator[Mark]:
    """Yield a curve for every notch, in its colour."""
    count = values.shape[1]
    chosen: Any = range(count)
    if count > MOST_NAMES:  # some, with the first and the last
        chosen = np.unique(np.linspace(0, count - 1, MOST_NAMES // 2).round().astype(int))
    for notch, colour in enumerate(sequence_colours(count)):
        group = f"notch {notch + 1}"
        name = group if named and notch in chosen else ""
        points = np.stack([x, values[:, notch]], axis=1)
        yield from branch_lines(path, points, colour, name, group=group)


def failures(path: EquilibriumPath, x: NDArray[np.float64]) -> Iterator[Span]:
    """Mark the steps that did not converge by dotted vertical lines."""
    places = x[~np.asarray(path.converged)]
    for order, at in enumerate(places[np.isfinite(places)].tolist()):
        yield Span("x", at, at, "#666666", DOTTED, name="" if order else "not converged")


def converged_only(path: EquilibriumPath, values: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return values with NaN in the steps that did not converge."""
    values = np.array(values, dtype=float)
    values[~np.asarray(path.converged)] = np.nan
    return values
