"""A path as a moving picture: the robot, and where it is on its loop."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path as FilePath
from typing import TYPE_CHECKING, Any

import numpy as np

from notchflex.errors import InputError
from notchflex.plotting.curves import notches_panel, total_panel
from notchflex.plotting.drive import abscissa
from notchflex.plotting.output import Picture
from notchflex.plotting.path import plane_of, shape_panel
from notchflex.plotting.renderers.with_matplotlib import draw_panel, figure_of
from notchflex.plotting.shapes.wrist import telling_steps
from notchflex.plotting.sheet import Area, Cell, Faces, Panel
from notchflex.plotting.style import BLACK, BLUE, house_style
from notchflex.results.files.writing import MOVING, check_picture, replacing
from notchflex.results.quantities.registry import QUANTITIES

if TYPE_CHECKING:
    from notchflex.results import EquilibriumPath

MOST_FRAMES = 48
"""Steps of a long path that are shown."""

DOTS_PER_INCH = 80

SECONDS, STANDING_SECONDS = 4.2, 0.9
"""How long it takes at least, and how long its first and its last picture stay at least [s]."""

_SHORTEST, _LONGEST = 0.1, 0.4
"""Seconds that a frame stays: the longer the fewer there are."""


def save_animation(
    path: EquilibriumPath,
    target: str | FilePath,
    *,
    title: str | None = None,
    progress: Callable[[int, int], None] | None = None,
) -> None:
    """Write a path as a GIF: the robot moves, and a dot goes along its loop.

    It takes four seconds or more: its first and its last picture stay for a while.

    Args:
        path: Solved path; of a long one some steps are shown, spread evenly.
        target: EquilibriumPath that ends in .gif; the file is whole or not there.
        title: Heading; the name of the robot if None.
        progress: Called with the frames done and all frames.

    Raises:
        InputError: Another suffix, nothing to show, or the file cannot be written.

    Example:
        >>> import tempfile
        >>> import notchflex as nf
        >>> path = nf.simulate(nf.load_robot("pacheco2021-a"), nf.pull(0.0, 2.0, steps=3).release())
        >>> with tempfile.TemporaryDirectory() as folder:
        ...     save_animation(path, f"{folder}/loop.gif")
    """
    from matplotlib.animation import PillowWriter

    check_picture(str(target), "the animation", kinds=MOVING)
    steps = frames_of(path)
    if len(steps) < 2:
        raise InputError.TOO_FEW_DATA(
            f"an animation needs two steps that were solved; this path has {len(steps)}. "
            "Draw a picture instead."
        )
    figure = figure_of(_stage(path, title))
    figure.draw_without_rendering()  # arranges the axes, once for all frames
    figure.set_layout_engine("none")
    robot, *curves = figure.axes
    limits = _limits(robot)
    view = plane_of(path)
    dots = [
        axes.plot(x, y, "o", color=colour, markersize=5.0, zorder=9)[0]
        for axes, (x, y, colour) in zip(curves, _dots(path, steps[0]), strict=True)
    ]
    frame = min(max(_SHORTEST, SECONDS / 1.5 / len(steps)), _LONGEST)
    rest = SECONDS - (len(steps) - 2) * frame
    standing = math.ceil(max(STANDING_SECONDS, rest / 2.0) / frame)
    writer = PillowWriter(fps=1.0 / frame)  # pyright: ignore[reportArgumentType]
    with (
        replacing(target) as temporary,
        house_style(),
        writer.saving(figure, str(temporary), DOTS_PER_INCH),
    ):
        for number, step in enumerate(steps):
            robot.clear()
            draw_panel(robot, _robot(path, step, view))
            _limit(robot, limits)
            for dot, (x, y, _) in zip(dots, _dots(path, step), strict=True):
                dot.set_data(x, y)
            for _ in range(standing if number in (0, len(steps) - 1) else 1):
                writer.grab_frame()
            if progress is not None:
                progress(number + 1, len(steps))


def frames_of(path: EquilibriumPath) -> list[int]:
    """Return the steps to show: converged ones, spread evenly, with the first and the last."""
    good = np.flatnonzero(np.asarray(path.converged))
    if len(good) <= MOST_FRAMES:
        return [int(step) for step in good]
    spread = np.linspace(0, len(good) - 1, MOST_FRAMES).round().astype(int)
    return [int(step) for step in good[spread]]


def _stage(path: EquilibriumPath, title: str | None) -> Picture:
    """What stands still: the curves, and axes in which every shape has room."""
    widest = shape_panel(path, telling_steps(path), plane_of(path))
    # Legends change from frame to frame and would jump.
    cells = [Cell(replace(widest, legend="", title=" "), (0, 2), (0, 1))]
    curves = [total_panel(path), notches_panel(path)]
    cells += [Cell(panel, (row, row + 1), (1, 2)) for row, panel in enumerate(curves)]
    return Picture(path.robot.name if title is None else title, 9.6, 5.4, cells)


def _robot(path: EquilibriumPath, step: int, view: float | None) -> Panel:
    panel = shape_panel(path, [step], view, colours=[BLUE])
    label = next(one.name for one in panel.items if isinstance(one, (Area, Faces)) and one.name)
    return replace(panel, legend="", title=label)


def _dots(path: EquilibriumPath, step: int) -> list[tuple[list[float], list[float], str]]:
    """Where a step stands on the loop, and on the curves of the notches."""
    x = float(abscissa(path)[0][step])
    total = float(path.total_angle[step]) * QUANTITIES["total_angle"].scale
    notches = [float(one) for one in path.notch_angle[step] * QUANTITIES["notch_angle"].scale]
    return [([x], [total], BLACK), ([x] * len(notches), notches, BLACK)]


def _limits(axes: Any) -> dict[str, Any]:
    names = "xyz" if axes.name == "3d" else "xy"
    return {name: getattr(axes, f"get_{name}lim")() for name in names}


def _limit(axes: Any, limits: dict[str, Any]) -> None:
    if axes.name != "3d":
        axes.set_aspect("equal", adjustable="box", anchor="C")
    for name, given in limits.items():
        getattr(axes, f"set_{name}lim")(*given)
    if axes.name == "3d":
        axes.set_box_aspect([np.ptp(given) for given in limits.values()], zoom=0.92)
