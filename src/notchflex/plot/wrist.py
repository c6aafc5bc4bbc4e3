"""The robot to scale, seen across the plane it bends in, at several loads."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np
from matplotlib.axes import Axes
from matplotlib.patches import Polygon

from notchflex.plot.outline import Outline, outline
from notchflex.plot.style import GREY, ORANGE, VERMILLION, sequence_colours

if TYPE_CHECKING:
    from notchflex.statics import Path

MOST_SHAPES = 5
"""More shapes than this hide each other."""


def telling_steps(path: Path, most: int = MOST_SHAPES) -> list[int]:
    """Return the steps to draw: spread evenly over the shapes that the robot goes through.

    Args:
        path: Solved path.
        most: How many steps at most.

    Returns:
        Indices of converged steps, from the straightest to the most bent. Both branches of a loop
        pass the same shapes, so the first step that reaches a shape stands for it.
    """
    good = np.flatnonzero(np.asarray(path.converged) & np.isfinite(path.total_angle))
    if not len(good):
        return []
    bend = np.abs(path.notch_angle[good]).sum(axis=1)
    wanted = np.linspace(bend.min(), bend.max(), most)
    chosen: list[int] = []
    for target in wanted:
        step = int(good[np.argmin(np.abs(bend - target))])
        near = any(np.ptp([path.total_angle[step], path.total_angle[c]]) < 1e-6 for c in chosen)
        if step not in chosen and not (near and np.ptp(bend) < 1e-6):
            chosen.append(step)
    return chosen


def draw_wrist(axes: Axes, path: Path, steps: Sequence[int], view: float = 0.0) -> None:
    """Draw a robot at several steps of a path into axes of equal scale.

    Args:
        axes: Where to draw.
        path: Solved path.
        steps: Which of its steps.
        view: Direction across the base that is drawn to the right [rad].
    """
    colours = sequence_colours(len(steps))
    any_closed = False
    for order, (step, colour) in enumerate(zip(steps, colours, strict=True)):
        shape = outline(path.robot, path.body_position[step], path.body_rotation[step], view)
        label = load_label(path, step)
        closed = np.flatnonzero(path.closed[step])
        _draw(axes, shape, colour, label, level=3 * order)
        if len(closed):
            points = np.array([shape.lips[notch] for notch in closed])
            axes.plot(
                *points.T,
                "o",
                color=VERMILLION,
                markersize=3.5,
                zorder=3 * len(steps) + 5,
                label=None if any_closed else "closed notch",
            )
            any_closed = True
    axes.set_aspect("equal", adjustable="datalim")
    axes.set_ylabel("along the base, z [mm]")
    degrees = round(float(np.degrees(view)), 6) % 360
    name = {0.0: "x", 90.0: "y"}.get(degrees, f"x turned by {degrees:g}° about z")
    axes.set_xlabel(f"across the base, {name} [mm]")


def load_label(path: Path, step: int) -> str:
    """Return what tells a step apart in a legend: its tensions and its total angle."""
    tensions = ", ".join(f"{value:.3g}" for value in path.tension[step])
    return f"{tensions} N, {np.degrees(path.total_angle[step]):.1f}°"


def _draw(axes: Axes, shape: Outline, colour: tuple[float, ...], label: str, level: int) -> None:
    # Pale and nearly opaque: shapes further bent lie over the others, and lines stay readable.
    pale = tuple(1.0 - 0.3 * (1.0 - part) for part in colour[:3])
    for index, polygon in enumerate([*shape.flexures, *shape.bodies]):
        axes.add_patch(
            Polygon(
                polygon,
                facecolor=(*pale, 0.85),
                edgecolor=colour,
                linewidth=0.8,
                joinstyle="round",
                zorder=2 + level,
                label=label if index == 0 else None,
            )
        )
    for line in shape.bores:
        axes.plot(*line.T, color=colour, linewidth=0.5, linestyle=(0, (3, 2)), zorder=3 + level)
    for line in shape.tendons:
        axes.plot(*line.T, color=ORANGE, linewidth=1.0, zorder=4 + level)
    axes.plot(*shape.held.T, color=GREY, linewidth=4.0, zorder=2, solid_capstyle="butt")
