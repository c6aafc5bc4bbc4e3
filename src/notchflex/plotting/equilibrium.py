"""The picture of one state: the robot, the angle of every notch, the tension along the tendons."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np

from notchflex.plotting.along import MOST_TENDONS, SLACK
from notchflex.plotting.output import Picture
from notchflex.plotting.path import plane_of, shape_panel
from notchflex.plotting.sheet import BESIDE, SOLID, Cell, Item, Line, Note, Panel
from notchflex.plotting.style import BLUE, VERMILLION, sequence_colours
from notchflex.results.quantities.registry import QUANTITIES
from notchflex.results.quantities.spans import spans_of
from notchflex.robot import Robot

if TYPE_CHECKING:
    from notchflex.results import EquilibriumPath


def state_picture(path: EquilibriumPath, step: int, *, title: str | None = None) -> Picture:
    """Describe the picture of one state of a path.

    The robot to scale with its loads, the angle of every notch with where it is closed, and the
    tension of every pulled tendon from span to span.

    Args:
        path: Solved path.
        step: Which of its steps, counted from 0.
        title: Heading; the name of the robot if None.

    Returns:
        The picture; its `save` writes it as PNG, SVG, PDF or HTML.
    """
    panels = [notch_bars(path, step), tension_along(path, step)]
    cells = [Cell(state_shape(path, step), (0, 2), (0, 1))]
    cells += [Cell(panel, (row, row + 1), (1, 2)) for row, panel in enumerate(panels)]
    return Picture(path.robot.name if title is None else title, 9.6, 6.4, cells)


def robot_picture(robot: Robot, *, title: str | None = None) -> Picture:
    """Describe the picture of a robot without loads.

    Args:
        robot: The robot.
        title: Heading; the name of the robot if None.

    Returns:
        The picture; its `save` writes it as PNG, SVG, PDF or HTML.
    """
    cells = [Cell(robot_shape(robot), (0, 1), (0, 1))]
    return Picture(robot.name if title is None else title, 5.6, 6.4, cells)


def robot_shape(robot: Robot) -> Panel:
    """Return the shape of a robot without loads."""
    from notchflex.analysis import solve
    from notchflex.loads import Load

    free = solve(robot, Load())
    return replace(state_shape(free.path, free.step), legend="")


def state_shape(path: EquilibriumPath, step: int) -> Panel:
    """Return the shape of one state, to scale, with its loads."""
    return shape_panel(path, [step] if path.converged[step] else [], plane_of(path))


def notch_bars(path: EquilibriumPath, step: int) -> Panel:
    """Return the angle of every notch in one state, base to tip."""
    quantity = QUANTITIES["notch_angle"]
    if not path.converged[step]:
        return Panel([Note("not converged")], "notch [number], 1 at the base", quantity.label)
    angle = path.notch_angle[step] * quantity.scale
    number = np.arange(1, len(angle) + 1)
    points = np.stack([number, angle], axis=1)
    items: list[Item] = [Line(points, BLUE, SOLID, marker="o", size=4.0, told=True)]
    closed = np.asarray(path.closed[step])
    if closed.any():
        mark: dict[str, Any] = {
            "dash": None,
            "marker": "o",
            "size": 5.0,
            "layer": 3,
            "group": "closed notch",
        }
        items.append(Line(points[closed], VERMILLION, name="closed notch", **mark))
    return Panel(
        items,
        "notch [number], 1 at the base",
        quantity.label,
        legend=BESIDE if closed.any() else "",
        x_range=(0.5, len(angle) + 0.5),
        whole_x=True,
    )


def tension_along(path: EquilibriumPath, step: int) -> Panel:
    """Return the tension of every pulled tendon from span to span in one state."""
    quantity = QUANTITIES["span_tension"]
    x_label = "span of tendon [number], 0 at the base"
    if not path.converged[step]:
        return Panel([Note("not converged")], x_label, quantity.label)
    pulled = [int(i) for i in np.flatnonzero(path.tension[step] > SLACK)][:MOST_TENDONS]
    if not pulled:
        return Panel([Note("all tendons are slack")], x_label, quantity.label)
    items: list[Item] = []
    for tendon, colour in zip(pulled, sequence_colours(len(pulled)), strict=True):
        number = np.arange(spans_of(path, tendon))
        points = np.stack([number, path.span_tension[step, tendon, : len(number)]], axis=1)
        name = f"tendon {tendon + 1}" if path.tension.shape[1] > 1 else ""
        options: dict[str, Any] = {"marker": "o", "size": 2.2, "told": True}
        items.append(Line(points, colour, name=name, group=name, **options))
    return Panel(
        items,
        x_label,
        quantity.label,
        legend=BESIDE if path.tension.shape[1] > 1 else "",
        y_range=(0.0, None),
        whole_x=True,
    )
