"""Draws one quantity of a path over another, or a shape, on axes of matplotlib."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np
from matplotlib.axes import Axes
from numpy.typing import NDArray

from notchflex import InputError, Robot
from notchflex.plotting.curves import (
    LINE,
    LOADING,
    NEUTRAL,
    UNLOADING,
    branch_lines,
    branches,
    failures,
    load_parameter,
)
from notchflex.plotting.path import robot_shape, state_shape
from notchflex.plotting.renderers.with_matplotlib import draw_panel
from notchflex.plotting.sheet import BESIDE, INSIDE, Curve, Mark, Panel
from notchflex.plotting.style import house_style, sequence_colours
from notchflex.support import QUANTITIES, Quantity, entries_of, is_listed, nearest

if TYPE_CHECKING:
    from notchflex import EquilibriumPath

STEP = "step"
"""Name of the number of the step, from 1."""


@dataclass(frozen=True)
class Series:
    """Values of one quantity with k entries along a path of S steps, in the units of pictures."""

    label: str  # of the axis, with symbol and unit
    names: Sequence[str]  # legend entries; "" for a quantity with one number
    headers: Sequence[str]  # CSV columns; "" for none
    values: NDArray[np.float64]  # (S, k)
    per: tuple[str, ...] = ()  # meaning of the entries, such as ("notch",)


def plot_on_axes(thing: Any, x: str | None, y: str | None, ax: Axes | None) -> Axes:
    """Draw one quantity y of a path over another x, or the shape of a state or a robot.

    Without axes to draw into it makes new ones of pyplot.

    Raises:
        InputError: It can't be drawn on one pair of axes, or the quantity is unknown.
    """
    from notchflex import Equilibrium, EquilibriumPath

    if isinstance(thing, EquilibriumPath):
        if x is None or y is None:
            raise InputError.MISSING_VALUE(
                "a path is drawn on axes as one quantity over another; give both, such as "
                "plot('stroke', 'tension')"
            )
        panel = quantities_panel(thing, x, y)
    elif x is not None or y is not None:
        raise InputError.WRONG_TYPE(
            "one quantity is drawn over another for a path; "
            f"got a {type(thing).__name__}, which is drawn by plot(it)"
        )
    elif isinstance(thing, Equilibrium):
        panel = state_shape(thing.path, thing.step)
    elif isinstance(thing, Robot):
        panel = robot_shape(thing)
    else:
        raise InputError.WRONG_TYPE(
            "axes can be given for a path, a state or a robot; the picture of a "
            f"{type(thing).__name__} has axes of its own: plot(it)"
        )
    figure = _new_figure(panel) if ax is None else None
    with house_style():
        projection = "3d" if panel.in_space else None
        axes: Any = ax if figure is None else figure.add_subplot(projection=projection)
        if panel.in_space and axes.name != "3d":
            raise InputError.UNSUPPORTED(
                "this robot bends out of one plane; give axes made with projection='3d'"
            )
        draw_panel(axes, panel)
    return axes


def quantities_panel(path: EquilibriumPath, x: str, y: str) -> Panel:
    """Return one quantity of a path over another; loading and unloading have their own lines."""
    both = len({way for _, way in branches(load_parameter(path))}) > 1
    across, upward = series_of(path, x), series_of(path, y)
    pairs = _pairs(x, across, upward)
    several = len(pairs) > 1
    items: list[Mark] = []
    for (column, row), shade in zip(pairs, sequence_colours(len(pairs)), strict=True):
        points = np.stack([across.values[:, column], upward.values[:, row]], axis=1)
        if several:
            items += branch_lines(path, points, shade, upward.names[row])
        else:
            items += branch_lines(path, points, name=None if both else "")
    if several and both:
        items += [Curve([], NEUTRAL, LINE[way], name=way) for way in (LOADING, UNLOADING)]
    if len({column for column, _ in pairs}) == 1:
        items += failures(path, across.values[:, pairs[0][0]])
    named = both or not np.all(path.converged)
    legend = BESIDE if several else INSIDE if named else ""
    return Panel(items, across.label, upward.label, legend=legend, whole="x" * (x == STEP))


def series_of(path: EquilibriumPath, name: str) -> Series:
    """Return a quantity of a path by its name, or one of its entries by its CSV column."""
    if name == STEP:
        return Series(STEP, [""], [""], np.arange(1.0, len(path) + 1.0)[:, None])
    known = [one for one in QUANTITIES.values() if is_listed(one) and one.kind is not str]
    for quantity in known:
        if quantity.name == name:
            entries = list(entries_of(path, quantity))
            values = np.stack([np.asarray(one.values, float) for one in entries], axis=1)
            names, headers = [one.name for one in entries], [one.header for one in entries]
            return Series(quantity.label, names, headers, values, quantity.per)
    headers = {one.header: (one, of) for of in known for one in entries_of(path, of) if one.header}
    if name in headers:
        entry, quantity = headers[name]
        label = entry_label(quantity, entry.name)
        return Series(label, [""], [name], np.asarray(entry.values, float)[:, None])
    if name in QUANTITIES:
        raise InputError.UNSUPPORTED(
            f"{name} can't be drawn as lines; draw a quantity such as total_angle"
        )
    choice = [*(one.name for one in known), *headers, STEP]
    meant = nearest(str(name), choice, 3) or f"; there are {', '.join(choice)}"
    raise InputError.UNKNOWN_NAME(f"there is no quantity {name!r} to draw{meant}")


def entry_label(quantity: Quantity, name: str) -> str:
    """Return the label of one entry: "angle of notch 3", "tip position x".

    Args:
        quantity: The quantity.
        name: Name of the entry, such as "notch 3" or "x"; "" for a single value.
    """
    if not name:
        return quantity.label
    if quantity.per == ("axis",):
        title, symbol = f"{quantity.title} {name}", f"{quantity.symbol}_{name}"
    else:
        title = f"{quantity.title.removeprefix(f'{quantity.per[0]} ')} of {name}"
        number = name.removeprefix("notch ")
        index = number if len(number) == 1 else f"{{{number}}}"
        symbol = quantity.symbol.replace("_j", f"_{index}")
    return replace(quantity, title=title, symbol=symbol).label


def _pairs(x: str, across: Series, upward: Series) -> list[tuple[int, int]]:
    """Return pairs of entries of x and y: the same tendons or notches, or all over one."""
    count = across.values.shape[1]
    if count > 1 and across.per == upward.per:
        return [(index, index) for index in range(count)]
    used = range(count)
    if count > 1 and across.per == ("tendon",):  # only tendons that are pulled
        used = np.flatnonzero(np.ptp(across.values, axis=0) > 0.0).tolist()
    if len(used) != 1:
        columns = ", ".join(header for header in across.headers if header) or "tension, stroke"
        raise InputError.WRONG_SHAPE(
            f"{x} has {count} entries; take one of them for the horizontal axis: {columns}"
        )
    return [(used[0], row) for row in range(upward.values.shape[1])]


def _new_figure(panel: Panel) -> Any:
    """Return a new figure of pyplot, so that a notebook or `pyplot.show()` shows it.

    It is made outside our style: pyplot chooses its backend, and with it whether figures show
    themselves, when it makes the first figure, and leaving the style would undo that.
    """
    from matplotlib import pyplot

    size = (5.6, 5.6) if panel.equal or panel.in_space else (6.0, 4.0)
    return pyplot.figure(figsize=size, layout="constrained")
