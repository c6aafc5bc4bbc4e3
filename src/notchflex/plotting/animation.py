"""Animates a path: the robot moves while dots run along its curves."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path as FilePath
from typing import TYPE_CHECKING, Any

import numpy as np

from notchflex import InputError
from notchflex.plotting.curves import abscissa, notches_panel, total_panel
from notchflex.plotting.output import Picture
from notchflex.plotting.renderers.with_matplotlib import draw_panel, figure_of
from notchflex.plotting.shapes.panel import plane_of, representative_steps, shape_panel
from notchflex.plotting.sheet import Area, Faces, Panel, stack
from notchflex.plotting.style import BLACK, BLUE, house_style
from notchflex.support import MOVING, QUANTITIES, check_picture, replacing

if TYPE_CHECKING:
    from notchflex import EquilibriumPath

MAX_FRAMES = 48
"""Steps of a long path that are shown."""

DOTS_PER_INCH = 80

SECONDS, STANDING_SECONDS = 4.2, 0.9
"""Shortest duration of the whole, and of the first and the last frame [s]."""

_SHORTEST, _LONGEST = 0.1, 0.4
"""Limits of the duration of a frame [s]: longer if there are fewer."""


def save_animation(
    path: EquilibriumPath,
    target: str | FilePath,
    *,
    title: str | None = None,
    progress: Callable[[int, int], None] | None = None,
) -> None:
    """Write a path as a GIF: the robot moves, and dots run along its curves.

    It takes four seconds or more; the first and the last frame are shown longer.

    Args:
        path: Solved path; of a long one an even selection of steps is shown.
        target: Name of a file that ends in .gif; it is written completely or not at all.
        title: Heading; the name of the robot if None.
        progress: Called with the number of finished frames and of all frames.

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
    figure = figure_of(_background(path, title))
    figure.draw_without_rendering()  # arranges the axes, once for all frames
    figure.set_layout_engine("none")
    robot, *curves = figure.axes
    view, names = plane_of(path), "xyz"[: 3 if robot.name == "3d" else 2]
    limits = {name: getattr(robot, f"get_{name}lim")() for name in names}
    dots = [axes.plot([], [], "o", color=BLACK, markersize=5.0, zorder=9)[0] for axes in curves]
    frame, standing = _durations(len(steps))
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
            for dot, points in zip(dots, _dots(path, step), strict=True):
                dot.set_data(*points)
            for _ in range(standing if number in (0, len(steps) - 1) else 1):
                writer.grab_frame()
            if progress:
                progress(number + 1, len(steps))


def _durations(count: int) -> tuple[float, int]:
    """Return the duration of a frame [s], and how many frames the first and the last one last."""
    frame = min(max(_SHORTEST, SECONDS / 1.5 / count), _LONGEST)
    rest = SECONDS - (count - 2) * frame
    return frame, math.ceil(max(STANDING_SECONDS, rest / 2.0) / frame)


def frames_of(path: EquilibriumPath) -> list[int]:
    """Return an even selection of the converged steps, with the first and the last."""
    converged = np.flatnonzero(np.asarray(path.converged))
    spread = np.linspace(0, len(converged) - 1, min(len(converged), MAX_FRAMES)).round().astype(int)
    return [int(step) for step in converged[spread]]


def _background(path: EquilibriumPath, title: str | None) -> Picture:
    """Return what does not move: the curves, and axes with room for every shape."""
    widest = shape_panel(path, representative_steps(path), plane_of(path))
    # Legends would jump, as they change from frame to frame.
    cells = stack([replace(widest, legend="", title=" ")], height=2)
    cells += stack([total_panel(path), notches_panel(path)], 1)
    return Picture(path.robot.name if title is None else title, 9.6, 5.4, cells)


def _robot(path: EquilibriumPath, step: int, view: float | None) -> Panel:
    panel = shape_panel(path, [step], view, colours=[BLUE])
    label = next(one.name for one in panel.items if isinstance(one, (Area, Faces)) and one.name)
    return replace(panel, legend="", title=label)


def _dots(path: EquilibriumPath, step: int) -> list[tuple[list[float], list[float]]]:
    """Return the points of a step on the curves of the total angle and of the notches."""
    x = float(abscissa(path)[0][step])
    total = float(path.total_angle[step]) * QUANTITIES["total_angle"].scale
    notches = [float(one) for one in path.notch_angle[step] * QUANTITIES["notch_angle"].scale]
    return [([x], [total]), ([x] * len(notches), notches)]


def _limit(axes: Any, limits: dict[str, Any]) -> None:
    if axes.name != "3d":
        axes.set_aspect("equal", adjustable="box", anchor="C")
    for name, ends in limits.items():
        getattr(axes, f"set_{name}lim")(*ends)
    if axes.name == "3d":
        axes.set_box_aspect([np.ptp(ends) for ends in limits.values()], zoom=0.92)
