"""The pictures of a path, of one of its states, and of a robot without loads."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from notchflex import Robot
from notchflex.plotting.curves import (
    LOADING,
    NOTCH_LABEL,
    SLACK,
    UNLOADING,
    driven_by_stroke,
    front_panel,
    notches_panel,
    profile_panel,
    pulled_tendons,
    reverses_step_by_step,
    shaded,
    span_line,
    steps_by_branch,
    strain_panel,
    stroke_panel,
    total_panel,
)
from notchflex.plotting.output import Picture
from notchflex.plotting.shapes.panel import plane_of, representative_steps, shape_panel
from notchflex.plotting.sheet import BESIDE, Curve, Mark, Note, Panel, dots, stack
from notchflex.plotting.style import BLUE, VERMILLION, sequence_colours
from notchflex.support import QUANTITIES

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from notchflex import Band, EquilibriumPath

MAX_PROFILES = 2
"""Tendons whose tension is drawn over the stroke, and from span to span."""

MAX_TENDONS = 8
"""Tendons of one state whose tension is drawn."""

_TWO_ROWS = 4
"""More curves than this are drawn three to a column."""


def path_figure(path: EquilibriumPath, *, title: str | None = None) -> Figure:
    """Draw a solved path with matplotlib; see `path_picture` for the arguments.

    Example:
        >>> import notchflex as nf
        >>> from notchflex.plotting import path_figure
        >>> path = nf.simulate(nf.load_robot("pacheco2021-a"), nf.pull(0.0, 2.0, steps=5).release())
        >>> len(path_figure(path).axes)
        6
    """
    return path_picture(path, title=title).figure()


def path_picture(
    path: EquilibriumPath, *, title: str | None = None, bands: Mapping[str, Band] | None = None
) -> Picture:
    """Describe the picture of a solved path, for paper and for a browser.

    The robot to scale at up to five loads: in its plane of bending, or in space if it bends in
    several planes or a load leaves the plane. Arrows are external loads. A path of more than one
    step has curves: the total angle, the angle and the peak strain of every notch with the allowed
    strain, and the tension over the stroke where strokes are prescribed. A path with loading and
    unloading shows the shapes of both, the tension along the tendon, and the contacts with
    reversed friction if the reversal takes several steps.

    Args:
        path: Solved path.
        title: Heading; the name of the robot if None.
        bands: Bands of tolerances by quantity, shaded behind angles and strains.
    """
    ways = steps_by_branch(path)
    steps = {"": representative_steps(path)}
    if len(ways) > 1:
        steps = {way: representative_steps(path, among=ways[way]) for way in (LOADING, UNLOADING)}
    view = plane_of(path)
    shapes = [shape_panel(path, some, view, title=name) for name, some in steps.items()]
    panels = _curves(path, ways, bands)
    # The shapes one above the other in the first column, the curves column by column beside them.
    rows = 3 if len(panels) > _TWO_ROWS else 2
    cells = stack(shapes, height=2 * rows // len(shapes))
    for start in range(0, len(panels), rows):
        cells += stack(panels[start : start + rows], 1 + start // rows, 2)
    columns = cells[-1].column + 1
    heading = path.robot.name if title is None else title
    return Picture(heading, 2.6 + 4.0 * columns, 0.8 + 2.9 * rows, cells)


def _curves(
    path: EquilibriumPath, ways: dict[str, list[int]], bands: Mapping[str, Band] | None
) -> list[Panel]:
    if len(path) == 1:
        return []
    panels = [
        shaded(total_panel(path), path, bands, "total_angle"),
        shaded(notches_panel(path), path, bands, "notch_angle"),
    ]
    panels += [stroke_panel(path, tendon) for tendon in driven_by_stroke(path)[:MAX_PROFILES]]
    panels.append(shaded(strain_panel(path), path, bands, "peak_strain"))
    if len(ways) > 1 and pulled_tendons(path):
        panels += [profile_panel(path, tendon) for tendon in pulled_tendons(path)[:MAX_PROFILES]]
        if reverses_step_by_step(path):
            panels.append(front_panel(path))
    return panels


def state_picture(path: EquilibriumPath, step: int, *, title: str | None = None) -> Picture:
    """Describe the picture of one state of a path.

    The robot to scale with its loads, the angle of every notch with closed notches marked, and the
    tension of every pulled tendon from span to span.

    Args:
        path: Solved path.
        step: Index of the step, from 0.
        title: Heading; the name of the robot if None.
    """
    curves = [notch_angles(path, step), tension_along(path, step)]
    cells = [*stack([state_shape(path, step)], height=2), *stack(curves, 1)]
    return Picture(path.robot.name if title is None else title, 9.6, 6.4, cells)


def robot_picture(robot: Robot) -> Picture:
    """Describe the picture of a robot without loads."""
    return Picture(robot.name, 5.6, 6.4, stack([robot_shape(robot)]))


def robot_shape(robot: Robot) -> Panel:
    """Return the shape of a robot without loads."""
    from notchflex import Load, solve

    free = solve(robot, Load())
    return replace(state_shape(free.path, free.step), legend="")


def state_shape(path: EquilibriumPath, step: int) -> Panel:
    """Return the shape of one state, to scale, with its loads."""
    return shape_panel(path, [step] if path.converged[step] else [], plane_of(path))


def notch_angles(path: EquilibriumPath, step: int) -> Panel:
    """Return the angle of every notch in one state, base to tip."""
    quantity = QUANTITIES["notch_angle"]
    labels = NOTCH_LABEL, quantity.label
    if not path.converged[step]:
        return Panel([Note("not converged")], *labels)
    angle = path.notch_angle[step] * quantity.scale
    points = np.stack([np.arange(1, len(angle) + 1), angle], axis=1)
    items: list[Mark] = [Curve(points, BLUE, marker="o", size=4.0, hover=True)]
    closed = np.asarray(path.closed[step])
    if closed.any():
        name = "closed notch"
        items.append(dots(points[closed], VERMILLION, 5.0, name=name, group=name, layer=3))
    legend = BESIDE if closed.any() else ""
    return Panel(items, *labels, legend=legend, x_range=(0.5, len(angle) + 0.5), whole="x")


def tension_along(path: EquilibriumPath, step: int) -> Panel:
    """Return the tension of every pulled tendon from span to span in one state."""
    labels = "span of tendon [number], 0 at the base", QUANTITIES["span_tension"].label
    pulled = [int(i) for i in np.flatnonzero(path.tension[step] > SLACK)][:MAX_TENDONS]
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
