"""The pictures of a design and of a front between objectives."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from notchflex.plotting.output import Picture
from notchflex.plotting.shapes.panel import plane_of, shape_panel
from notchflex.plotting.sheet import (
    BELOW,
    Bars,
    Cell,
    Curve,
    Mark,
    Note,
    Panel,
    Span,
    dots,
    grid,
    stack,
)
from notchflex.plotting.style import BLACK, BLUE, GREY, SKY, VERMILLION

if TYPE_CHECKING:
    from notchflex import EquilibriumPath
    from notchflex.designing import Design, DesignFront, WishResult


BEFORE, AFTER = GREY, BLUE
_STATES, _VALUES = 3, 12
# The values before stand below the bars, clear of the numbers at their ends.
_BELOW = 0.38


def design_picture(design: Design, *, title: str = "") -> Picture:
    """Describe a design: the robot at up to three states, before and after, and its variables.

    Args:
        design: The design.
        title: Heading.
    """
    cells: list[Cell] = []
    path, before = design.path, design.path_before
    states = list(design.state_steps.items())[-_STATES:]
    column = 0
    for label, one, colour in (("before", before, BEFORE), ("designed", path, AFTER)):
        if one is None or not one.converged.any():
            continue
        steps = [step for _, step in states if one.converged[step]]
        shades = [colour] * len(steps)
        panel = shape_panel(one, steps, plane_of(one), title=label, colours=shades, legend=BELOW)
        cells.append(Cell(_with_curves(panel, design, one), 0, column, 2))
        column += 1
    several = [one for one in design.wishes if len(one.achieved) > 1]
    beside = [_variables(design), *(_numbers(one) for one in several[:1])]
    cells += stack(beside, column, 1 if several else 2)
    name = title or f"{design.spec.name}: {design.before.name}"
    return Picture(name, 1.2 + 3.6 * (column + 1), 6.8, cells, [])


def _with_curves(panel: Panel, design: Design, path: EquilibriumPath) -> Panel:
    """Add the points of target curves."""
    from dataclasses import replace

    from notchflex.designing.model.quantities import target_points

    marks: list[Mark] = list(panel.items)
    view = plane_of(path)
    for curve in design.spec.curve:
        points = target_points(curve)
        if view is not None:
            across = points[:, 0] * np.cos(view) + points[:, 1] * np.sin(view)
            points = np.stack([across, points[:, 2]], axis=1)
        marks.append(dots(points, VERMILLION, 2.5, name=f"curve {curve.name}", layer=40))
    return replace(panel, items=marks)


def _variables(design: Design) -> Panel:
    """Position of each variable between its limits."""
    chosen = design.variables[:_VALUES]
    if not chosen:
        return Panel([Note("no variables")], "", "", title="variables")
    after = [(v.value - v.lower) / (v.upper - v.lower) for v in chosen]
    was = [(v.before - v.lower) / (v.upper - v.lower) for v in chosen]
    names = [f"{v.name}\n{v.value:.4g} {v.unit}".rstrip() for v in chosen]
    points = np.stack([was, np.arange(len(chosen)) + _BELOW], axis=1)
    items: list[Mark] = [
        Bars(after, names, [SKY] * len(chosen)),
        Span("x", 1.0, 1.0, BLACK),
        dots(points, BLACK, 4.0, hollow=True, layer=4),
    ]
    label = "from least (0) to greatest (1) value; circle: before"
    return Panel(items, label, "", title="variables", x_range=(0.0, 1.15))


def _numbers(one: WishResult) -> Panel:
    """The numbers of a wish that has several, before and after."""
    at = np.arange(1, len(one.achieved) + 1, dtype=float)
    items: list[Mark] = []
    for values, colour, name in ((one.before, BEFORE, "before"), (one.achieved, AFTER, "designed")):
        if len(values) == len(at):
            points = np.stack([at, np.array(values)], axis=1)
            items.append(Curve(points, colour, marker="o", name=name))
    unit = f" [{one.unit}]" if one.unit else ""
    return Panel(items, "number", f"{one.title}{unit}", title=one.asked, whole="x")


def front_picture(front: DesignFront, *, title: str = "") -> Picture:
    """Describe a front: every objective over the first, points numbered by the first.

    Args:
        front: The front.
        title: Heading.
    """
    values, titles = front.objectives, front.titles
    panels: list[Panel] = []
    for other in range(1, values.shape[1]):
        points = np.stack([values[:, 0], values[:, other]], axis=1)
        line = Curve(points, BLUE, None if values.shape[1] > 2 else (), marker="o", hover=True)
        panels.append(Panel([line], titles[0], titles[other]))
    if values.shape[1] > 2:
        points = values[:, [1, 2]]
        panels.append(Panel([Curve(points, BLUE, None, marker="o")], titles[1], titles[2]))
    name = title or f"{front.spec.name}: {len(front.points)} robots"
    return Picture(name, 1.0 + 4.4 * len(panels), 4.4, grid(panels, len(panels)), [])
