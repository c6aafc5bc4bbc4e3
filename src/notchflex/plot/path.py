"""The picture of a path: the robot at several loads, and its angles against tension."""

from __future__ import annotations

from typing import TYPE_CHECKING

from matplotlib.figure import Figure

from notchflex.plot.curves import draw_notches, draw_total
from notchflex.plot.outline import bending_planes
from notchflex.plot.style import house_style, new_figure
from notchflex.plot.wrist import draw_wrist, telling_steps

if TYPE_CHECKING:
    from notchflex.statics import Path


def path_figure(path: Path, *, title: str | None = None) -> Figure:
    """Draw a solved path.

    Left the robot to scale at up to five loads, in its bending plane (or in two planes at right
    angles where its notches have several directions); right the total angle and the angle of every
    notch against tension, solid while pulling and dashed while letting go, closed notches dotted.

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
        3
    """
    with house_style():
        views = bending_planes(path.robot)
        figure = new_figure(
            10.0 + 3.6 * (len(views) - 1), 5.6, path.robot.name if title is None else title
        )
        grid = figure.add_gridspec(2, 1 + len(views), width_ratios=[1.0] * len(views) + [1.05])
        steps = telling_steps(path)
        for column, view in enumerate(views):
            axes = figure.add_subplot(grid[:, column])
            draw_wrist(axes, path, steps, view)
            if not steps:
                axes.text(0.5, 0.5, "no step was solved", transform=axes.transAxes, ha="center")
            elif column == 0:
                axes.legend(loc="best")
        draw_total(figure.add_subplot(grid[0, -1]), path)
        draw_notches(figure.add_subplot(grid[1, -1]), path)
    return figure
