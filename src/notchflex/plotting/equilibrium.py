"""The picture of one state: the robot, the angle of every notch, the tension along the tendons."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from notchflex.plotting.output import Picture
from notchflex.plotting.shapes.panel import plane_of, shape_panel
from notchflex.plotting.sheet import BESIDE, Line, Mark, Note, Panel, dots, stack
from notchflex.plotting.style import BLUE, VERMILLION, sequence_colours
from notchflex.plotting.tendon_profiles import SLACK, span_line
from notchflex.results.quantities.registry import QUANTITIES
from notchflex.robot import Robot

if TYPE_CHECKING:
    from notchflex.results import EquilibriumPath

MOST_TENDONS = 8
"""Tendons of one state whose tension is drawn."""


def state_picture(path: EquilibriumPath, step: int, *, title: str | None = None) -> Picture:
    """Describe the picture of one state of a path.

    The robot to scale with its loads, the angle of every notch with closed notches marked, and the
    tension of every pulled tendon from span to span.

    Args:
        path: Solved path.
        step: Index of the step, from 0.
        title: Heading; the name of the robot if None.

    Returns:
        The picture; its `save` writes it as PNG, SVG, PDF or HTML.
    """
    curves = [notch_angles(path, step), tension_along(path, step)]
    cells = [*stack([state_shape(path, step)], height=2), *stack(curves, 1)]
    return Picture(path.robot.name if title is None else title, 9.6, 6.4, cells)


def robot_picture(robot: Robot, *, title: str | None = None) -> Picture:
    """Describe the picture of a robot without loads.

    Args:
        robot: The robot.
        title: Heading; the name of the robot if None.

    Returns:
        The picture; its `save` writes it as PNG, SVG, PDF or HTML.
    """
    cells = stack([robot_shape(robot)])
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


def notch_angles(path: EquilibriumPath, step: int) -> Panel:
    """Return the angle of every notch in one state, base to tip."""
    quantity = QUANTITIES["notch_angle"]
    labels = "notch [number], 1 at the base", quantity.label
    if not path.converged[step]:
        return Panel([Note("not converged")], *labels)
    angle = path.notch_angle[step] * quantity.scale
    points = np.stack([np.arange(1, len(angle) + 1), angle], axis=1)
    items: list[Mark] = [Line(points, BLUE, marker="o", size=4.0, hover=True)]
    closed = np.asarray(path.closed[step])
    if closed.any():
        name = "closed notch"
        items.append(dots(points[closed], VERMILLION, 5.0, name=name, group=name, layer=3))
    legend = BESIDE if closed.any() else ""
    return Panel(items, *labels, legend=legend, x_range=(0.5, len(angle) + 0.5), whole="x")


def tension_along(path: EquilibriumPath, step: int) -> Panel:
    """Return the tension of every pulled tendon from span to span in one state."""
    labels = "span of tendon [number], 0 at the base", QUANTITIES["span_tension"].label
    pulled = [int(i) for i in np.flatnonzero(path.tension[step] > SLACK)][:MOST_TENDONS]
    if not path.converged[step] or not pulled:
        note = "all tendons are slack" if path.converged[step] else "not converged"
        return Panel([Note(note)], *labels)
    several = path.tension.shape[1] > 1
    items: list[Mark] = []
    for tendon, colour in zip(pulled, sequence_colours(len(pulled)), strict=True):
        name = f"tendon {tendon + 1}" if several else ""
        items.append(span_line(path, step, tendon, colour, size=2.2, name=name, group=name))
    legend = BESIDE if several else ""
    return Panel(items, *labels, legend=legend, y_range=(0.0, None), whole="x")
