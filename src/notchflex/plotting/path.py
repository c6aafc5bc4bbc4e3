"""The picture of a path: the robot at several loads, and what the path holds as curves."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

from notchflex.plotting.along import (
    front_panel,
    profile_panel,
    pulled_tendons,
    reverses_step_by_step,
)
from notchflex.plotting.curves import notches_panel, strain_panel, stroke_panel, total_panel
from notchflex.plotting.drive import LOADING, UNLOADING, driven_by_stroke, way_of
from notchflex.plotting.output import Picture
from notchflex.plotting.shapes.acting import out_of_plane
from notchflex.plotting.shapes.bent import bent_at
from notchflex.plotting.shapes.outline import bending_plane
from notchflex.plotting.shapes.space import space_panel
from notchflex.plotting.shapes.wrist import telling_steps, wrist_panel
from notchflex.plotting.sheet import BESIDE, Cell, Colour, Panel

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from notchflex.results import EquilibriumPath

MOST_PROFILES = 2
"""Tendons whose tension is drawn over the stroke, and from span to span."""

_TWO_ROWS = 4
"""More curves than this are drawn three to a column."""


def path_figure(path: EquilibriumPath, *, title: str | None = None) -> Figure:
    """Draw a solved path with matplotlib; for what it shows see `path_picture`.

    Args:
        path: Solved path.
        title: Heading; the name of the robot if None.

    Returns:
        The figure; `notchflex.plotting.save` writes it.

    Example:
        >>> import notchflex as nf
        >>> from notchflex.plotting import path_figure
        >>> path = nf.simulate(nf.load_robot("pacheco2021-a"), nf.pull(0.0, 2.0, steps=5).release())
        >>> len(path_figure(path).axes)
        6
    """
    return path_picture(path, title=title).figure()


def path_picture(path: EquilibriumPath, *, title: str | None = None) -> Picture:
    """Describe the picture of a solved path, for paper and for a browser.

    First the robot to scale at up to five loads: in its plane of bending, or in space where it
    bends in several planes or a load leaves the plane. Arrows are external loads. One state
    has nothing else. More steps have curves: the total angle, the angle and the peak strain of
    every notch with the allowed strain, and where strokes drive, the tension over the stroke. A
    path with loading and unloading shows the shapes of both, the tension along the tendon, and,
    where it takes several steps, how far the friction has reversed.

    Args:
        path: Solved path.
        title: Heading; the name of the robot if None.

    Returns:
        The picture; its `save` writes it as PNG, SVG, PDF or HTML.
    """
    ways = way_of(path)
    view = plane_of(path)
    shapes = [shape_panel(path, steps, view, name) for name, steps in _shapes(path, ways).items()]
    panels = _panels(path, ways)
    # The shapes one above the other in the first column, the curves in two or three rows.
    rows = 3 if len(panels) > _TWO_ROWS else 2
    high = 2 * rows // len(shapes)
    cells = [
        Cell(panel, (high * index, high * (index + 1)), (0, 1))
        for index, panel in enumerate(shapes)
    ]
    for index, panel in enumerate(panels):
        row, column = 2 * (index % rows), 1 + index // rows
        cells.append(Cell(panel, (row, row + 2), (column, column + 1)))
    columns = 1 + -(-len(panels) // rows)
    heading = path.robot.name if title is None else title
    return Picture(heading, 2.6 + 4.0 * columns, 0.8 + 2.9 * rows, cells)


def shape_panel(
    path: EquilibriumPath,
    steps: Sequence[int],
    view: float | None,
    title: str = "",
    colours: Sequence[Colour] | None = None,
    legend: str = BESIDE,
) -> Panel:
    """Return a robot at several steps: across its plane where it has one, otherwise in space."""
    look: dict[str, Any] = {"title": title, "colours": colours, "legend": legend}
    if view is None and steps:
        return space_panel(path, steps, **look)
    return wrist_panel(path, steps, view or 0.0, **look)


def plane_of(path: EquilibriumPath) -> float | None:
    """Return the direction across the base [rad] of the plane that holds a path, if one does."""
    view = bending_plane(path.robot)
    if view is None:
        return None
    steps = telling_steps(path)
    leaves = [out_of_plane(path, step, bent_at(path, step), view) for step in steps]
    return None if max(leaves, default=0.0) > 1e-6 else view


def _shapes(path: EquilibriumPath, ways: dict[str, list[int]]) -> dict[str, list[int]]:
    """Return the steps to draw: of loading and of unloading apart, where there are both."""
    if len(ways) < 2:
        return {"": telling_steps(path)}
    return {way: telling_steps(path, among=ways[way]) for way in (LOADING, UNLOADING)}


def _panels(path: EquilibriumPath, ways: dict[str, list[int]]) -> list[Panel]:
    """Return the curves."""
    if len(path) == 1:
        return []
    panels = [total_panel(path), notches_panel(path)]
    panels += [stroke_panel(path, tendon) for tendon in driven_by_stroke(path)[:MOST_PROFILES]]
    panels.append(strain_panel(path))
    if len(ways) > 1 and pulled_tendons(path):
        panels += [profile_panel(path, tendon) for tendon in pulled_tendons(path)[:MOST_PROFILES]]
        if reverses_step_by_step(path):
            panels.append(front_panel(path))
    return panels
