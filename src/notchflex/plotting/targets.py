"""The pictures of what was aimed at and sensed: designs, fronts, followed targets, forces."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np

from notchflex import EquilibriumPath
from notchflex.plotting.marks import (
    BELOW,
    DASHED,
    Array,
    Cell,
    Colour,
    Curve,
    Mark,
    Panel,
    Span,
    Text,
    band,
    bar_panel,
    dots,
    grid,
    line,
    stack,
)
from notchflex.plotting.outline import project
from notchflex.plotting.output import Picture
from notchflex.plotting.shapes import plane_of, shape_panel
from notchflex.plotting.style import (
    BLACK,
    BLUE,
    GREEN,
    GREY,
    ORANGE,
    SKY,
    VERMILLION,
    sequence_colours,
)
from notchflex.support import AXES, QUANTITIES

if TYPE_CHECKING:
    from notchflex.control import Following
    from notchflex.designing import Design, DesignFront, WishResult
    from notchflex.sensing import SensedForce


_BEFORE, _AFTER = GREY, BLUE
MAX_VALUES = 12
"""Variables of a design that are drawn."""


def design_picture(design: Design, *, title: str = "") -> Picture:
    """Describe a design: the robot at up to three states, before and after, and its variables.

    Args:
        design: The design.
        title: Heading.
    """
    shapes: list[Panel] = []
    steps = list(design.state_steps.values())[-3:]
    for label, path, colour in (
        ("before", design.path_before, _BEFORE),
        ("designed", design.path, _AFTER),
    ):
        if path is not None and path.converged.any():
            solved = [step for step in steps if path.converged[step]]
            panel = shape_panel(path, solved, title=label, colours=[colour] * 3, legend=BELOW)
            shapes.append(replace(panel, items=[*panel.items, *_target_curves(design, path)]))
    numbers = [_numbers(wish) for wish in design.wishes if len(wish.achieved) > 1][:1]
    cells = [Cell(panel, 0, column, 2) for column, panel in enumerate(shapes)]
    cells += stack([_variables(design), *numbers], len(shapes), 1 if numbers else 2)
    return Picture(title or f"{design.spec.name}: {design.before.name}", cells)


def _target_curves(design: Design, path: EquilibriumPath) -> list[Mark]:
    """Return the points of the curves that the robot was designed for."""
    from notchflex.designing.model.quantities import target_points

    marks: list[Mark] = []
    view = plane_of(path)
    for curve in design.spec.curve:
        points = target_points(curve)
        points = points if view is None else project(points, view)
        marks.append(dots(points, VERMILLION, 2.5, name=f"curve {curve.name}", layer=40))
    return marks


def _variables(design: Design) -> Panel:
    """Position of each variable between its limits."""
    chosen = design.variables[:MAX_VALUES]
    if not chosen:
        return Panel([Text("no variables")], "", "", title="variables")
    after, before = (
        [(value - v.lower) / (v.upper - v.lower) for value, v in zip(values, chosen, strict=True)]
        for values in ([v.value for v in chosen], [v.before for v in chosen])
    )
    names = [f"{v.name}\n{v.value:.4g} {v.unit}".rstrip() for v in chosen]
    # The values before stand below the bars, clear of the numbers at their ends.
    points = np.stack([before[::-1], np.arange(len(chosen)) - 0.38], axis=1)
    extra = [Span("x", 1.0, BLACK), dots(points, BLACK, 4.0, hollow=True, layer=4)]
    label = "from least (0) to greatest (1) value; circle: before"
    colours, limits = [SKY] * len(chosen), (0.0, 1.15)
    return bar_panel(after, names, colours, label, extra, title="variables", x_range=limits)


def _numbers(wish: WishResult) -> Panel:
    """The numbers of a wish that has several, before and after."""
    number = np.arange(1.0, len(wish.achieved) + 1.0)
    items: list[Mark] = [
        line(number, values, colour, marker="o", name=name)
        for values, colour, name in (
            (wish.before, _BEFORE, "before"),
            (wish.achieved, _AFTER, "designed"),
        )
        if len(values) == len(number)
    ]
    label = wish.title + (f" [{wish.unit}]" if wish.unit else "")
    return Panel(items, "number", label, title=wish.asked, whole="x")


def front_picture(front: DesignFront, *, title: str = "") -> Picture:
    """Describe a front: every objective over the first, points numbered by the first.

    Args:
        front: The front.
        title: Heading.
    """
    values, titles = front.objectives, front.titles
    pairs = [(0, upward) for upward in range(1, values.shape[1])]
    pairs += [(1, 2)] if values.shape[1] > 2 else []
    dash = None if values.shape[1] > 2 else ()
    panels = [
        Panel([Curve(values[:, [x, y]], BLUE, dash, marker="o")], titles[x], titles[y])
        for x, y in pairs
    ]
    name = title or f"{front.spec.name}: {len(front.points)} robots"
    return Picture(name, grid(panels, len(panels)), row_height=3.8)


_NUMBER, _READING = "target [number]", "reading [number]"


def following_picture(found: Following, *, title: str = "") -> Picture:
    """Describe targets that were followed.

    Left the path of the tip with the target positions; right the tension of every tendon over the
    targets, and how far each target was missed.

    Args:
        found: The result of `notchflex.follow`.
        title: Heading; the name of the robot where not given.

    Example:
        >>> import notchflex as nf
        >>> found = nf.follow(nf.load_robot("pacheco2021-a"), [(2.1, 0, 9.5), (2.4, 0, 9.3)])
        >>> [cell.panel.y_label for cell in following_picture(found).cells][1]
        'tendon tension $T$ [N]'
    """
    number = np.arange(1.0, len(found) + 1.0)
    tension = _tendon_curves(number, found.tension, sequence_colours(found.tension.shape[1]))
    drives = Panel(tension, _NUMBER, QUANTITIES["tension"].label, shared="x")
    cells = [Cell(_tips(found), 0, 0, 2), *stack([drives, _errors(found, number)], 1)]
    return Picture(title or f"Targets followed by {found.robot.name}", cells, row_height=2.3)


def _tendon_curves(
    x: Array, tension: Array, colours: Sequence[Colour], marker: str = ""
) -> list[Mark]:
    names = [f"tendon {tendon + 1}" * (len(colours) > 1) for tendon in range(len(colours))]
    return [
        line(x, values, colour, name=name, marker=marker)
        for values, colour, name in zip(tension.T, colours, names, strict=True)
    ]


def _tips(following: Following) -> Panel:
    """Positions of the tip and targets, in a plane if they lie in one."""
    every, goals = following.path.tip_position, following.targets.values.get("tip_position")
    spread = np.ptp(every, axis=0)[:2]
    axes = [axis for axis in range(3) if axis != np.argmin(spread) or spread.min() >= 1e-6]
    via = np.setdiff1d(np.arange(len(every)), following.step)
    missed = following.tip_position[~following.reached]
    items: list[Mark] = [Curve(every[:, axes], BLUE, name="tip")]
    if goals is not None:
        items.append(dots(goals[:, axes], GREY, 4.0, hollow=True, name="target", layer=1))
    if len(via):
        items.append(dots(every[via][:, axes], ORANGE, name="overshoot", layer=3))
    if len(missed):
        items.append(dots(missed[:, axes], VERMILLION, 4.0, name="nearest", layer=4))
    if len(axes) == 2:
        x_label, y_label = (f"tip position {AXES[axis]} [mm]" for axis in axes)
        return Panel(items, x_label, y_label, equal=True, legend=BELOW)
    # In space the labels stand close to each other, and the upright one needs room beside it.
    return Panel(items, "x [mm]", "y [mm]", "z [mm]")


def _errors(following: Following, number: Array) -> Panel:
    items: list[Mark] = []
    for unit, error, tolerance, colour in (
        ("mm", following.error_mm, following.tolerance, BLUE),
        ("deg", following.error_deg, np.degrees(following.angle_tolerance), ORANGE),
    ):
        if unit in following.units:  # zero has no place on a logarithmic axis
            error, level = np.log10(np.maximum(error, 1e-16)), np.log10(max(tolerance, 1e-16))
            name = f"error, {unit}"
            items.append(line(number, error, colour, marker="o", size=2.0, name=name))
            items.append(Span("y", float(level), GREY, name=f"tolerance, {unit}"))
    return Panel(items, _NUMBER, "log10 of the error [mm, deg]", shared="x")


def sensed_picture(sensed: SensedForce, *, truth: Any = None) -> Picture:
    """Describe a sensed force along its readings, with the readings below.

    A panel for every component: the force, the interval that noise and stuck friction leave, the
    part of it by noise alone, and readings that show contact; below tensions and strokes.

    Args:
        sensed: The force.
        truth: The true components, N, (s, d), of a simulated history.

    Example:
        >>> import notchflex as nf
        >>> wrist = nf.load_robot("pacheco2021-a")
        >>> touched = nf.simulate(wrist, nf.pull(0.1, 0.4, steps=3).loaded(tip_force=(0.02, 0, 0)))
        >>> picture = sensed_picture(nf.sense(wrist, touched.tension, touched.stroke))
        >>> picture.cells[0].panel.y_label
        'force along x [N]'
    """
    x = np.arange(1.0, len(sensed) + 1.0)
    panels = [
        Panel(
            _component(sensed, which, x, None if truth is None else np.asarray(truth)[:, which]),
            _READING,
            f"force along {name} [N]",
            whole="x",
        )
        for which, name in enumerate(sensed.components)
    ]
    if sensed.path is not None:  # the best history
        tension = sensed.path.tension[sensed.group[sensed.converged]]
        colours = [(GREY, GREEN, ORANGE, BLUE)[tendon % 4] for tendon in range(tension.shape[1])]
        items = _tendon_curves(x[: len(tension)], tension, colours, "o")
        panels.append(Panel(items, _READING, QUANTITIES["tension"].label, whole="x"))
    where = "the tip" if sensed.place is None else f"body {sensed.place}"
    title = f"Force on {where} of {sensed.robot.name}"
    return Picture(title, stack(panels), column_width=6.4, row_height=2.5)


def _component(sensed: SensedForce, which: int, x: Array, truth: Any) -> list[Mark]:
    force, low, high = sensed.force[:, which], sensed.low[:, which], sensed.high[:, which]
    spread = np.minimum(1.96 * sensed.deviation[:, which], sensed.largest)
    ends = force - spread, force + spread
    items: list[Mark] = [
        band(x, low, high, ORANGE, 0.3, name="noise and stuck friction"),
        band(x, *ends, BLUE, 0.25, name="noise alone, to first order"),
        line(x, force, BLUE, name="sensed", marker="o"),
    ]
    if truth is not None:
        items.append(line(x, truth, BLACK, DASHED, name="true"))
    if sensed.contact.any():
        points = np.stack([x, force], axis=1)[sensed.contact]
        items.append(dots(points, GREEN, 5.0, name="contact shown", layer=5))
    return items
