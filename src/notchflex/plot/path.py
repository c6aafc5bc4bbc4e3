"""The picture of a path: the robot at several loads, and what the path holds as curves."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import TYPE_CHECKING, Any

from matplotlib.axes import Axes
from matplotlib.figure import Figure

from notchflex.plot.acting import out_of_plane
from notchflex.plot.along import draw_front, draw_profile, has_friction, pulled_tendons
from notchflex.plot.bent import bent_at
from notchflex.plot.curves import draw_notches, draw_total
from notchflex.plot.drive import LETTING_GO, PULLING, way_of
from notchflex.plot.outline import bending_plane
from notchflex.plot.space import draw_space
from notchflex.plot.style import house_style, new_figure
from notchflex.plot.wrist import draw_wrist, telling_steps

if TYPE_CHECKING:
    from notchflex.statics import Path

MOST_PROFILES = 2
"""Tendons whose tension is drawn from span to span."""


def path_figure(path: Path, *, title: str | None = None) -> Figure:
    """Draw a solved path.

    First the robot to scale at up to five loads: in its plane of bending, or in space where it
    bends in several planes or a load leaves the plane. Arrows are loads from outside. One state
    has nothing else. More steps have curves: the total angle, as a loop where the tendons are let
    go again, and every notch. A path with pulling and letting go shows the shapes of both, the
    tension along the tendon, and how far the friction has turned.

    Args:
        path: Solved path.
        title: Heading; the name of the robot if None.

    Returns:
        The figure; `notchflex.plot.save` writes it.

    Example:
        >>> import notchflex as nf
        >>> from notchflex.plot import path_figure
        >>> path = nf.simulate(nf.load_robot("pacheco2021-a"), nf.pull(0.0, 2.0, steps=5).release())
        >>> len(path_figure(path).axes)
        6
    """
    ways = way_of(path)
    view = plane_of(path)
    # What is drawn in a column of its own, beside the curves two to a column.
    shapes = _shapes(path, ways)
    panels = _panels(path, ways)
    columns = len(shapes) + -(-len(panels) // 2)
    with house_style():
        figure = new_figure(1.6 + 4.0 * columns, 6.4, path.robot.name if title is None else title)
        grid = figure.add_gridspec(2, columns)
        drawn: list[Any] = []
        for column, (name, steps) in enumerate(shapes.items()):
            place = grid[:, column]
            if view is None:
                axes: Any = figure.add_subplot(place, projection="3d")
                draw_space(axes, path, steps)
            else:
                axes = figure.add_subplot(place)
                draw_wrist(axes, path, steps, view)
                drawn.append(axes)
            if name:
                axes.set_title(name, loc="left")
            if steps:
                _legend(axes, below=view is None)
            else:
                axes.text(0.5, 0.5, "no step was solved", transform=axes.transAxes, ha="center")
        # Pulling and letting go to one scale (matplotlib shares no axes of equal scale).
        for axes in drawn:
            for other in drawn:
                axes.update_datalim(other.dataLim.get_points())
            axes.autoscale_view()
        for index, draw in enumerate(panels):
            draw(figure.add_subplot(grid[index % 2, len(shapes) + index // 2]))
    return figure


def _legend(axes: Any, *, below: bool) -> None:
    if below:  # axes of three dimensions have no empty corner
        axes.legend(loc="upper center", bbox_to_anchor=(0.5, -0.06), ncols=2)
    else:
        axes.legend(loc="best")


def plane_of(path: Path) -> float | None:
    """Return the direction across the base [rad] of the plane that holds a path, if one does."""
    view = bending_plane(path.robot)
    if view is None:
        return None
    steps = telling_steps(path)
    leaves = [out_of_plane(path, step, bent_at(path, step), view) for step in steps]
    return None if max(leaves, default=0.0) > 1e-6 else view


def _shapes(path: Path, ways: dict[str, list[int]]) -> dict[str, list[int]]:
    """Return the steps to draw: of pulling and of letting go apart, where there are both."""
    if len(ways) < 2:
        return {"": telling_steps(path)}
    return {way: telling_steps(path, among=ways[way]) for way in (PULLING, LETTING_GO)}


def _panels(path: Path, ways: dict[str, list[int]]) -> list[Callable[[Axes], None]]:
    """Return what draws each curve."""
    if len(path) == 1:
        return []
    panels: list[Callable[[Axes], None]] = [
        partial(draw_total, path=path),
        partial(draw_notches, path=path),
    ]
    if len(ways) > 1 and pulled_tendons(path):
        for tendon in pulled_tendons(path)[:MOST_PROFILES]:
            panels.append(partial(draw_profile, path=path, tendon=tendon))
        if has_friction(path):
            panels.append(partial(draw_front, path=path))
    return panels
