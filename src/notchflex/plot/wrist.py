"""The robot to scale, seen across the plane it bends in, at several loads."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.patches import FancyArrowPatch, Polygon
from numpy.typing import NDArray

from notchflex.plot.acting import COLOUR, Acting, acting_at
from notchflex.plot.bent import bent_at
from notchflex.plot.outline import Outline, outline
from notchflex.plot.style import GREY, ORANGE, VERMILLION, sequence_colours

if TYPE_CHECKING:
    from notchflex.statics import Path

MOST_SHAPES = 5
"""More shapes than this hide each other."""

ARROW = 0.18
"""Length of the arrow of the largest force, in lengths of the robot."""

SHORTEST = 0.25
"""Length of the shortest arrow, in lengths of the longest."""


def telling_steps(
    path: Path, most: int = MOST_SHAPES, among: Sequence[int] | None = None
) -> list[int]:
    """Return the steps to draw: spread evenly over the shapes that the robot goes through.

    Args:
        path: Solved path.
        most: How many steps at most.
        among: The steps to choose from; all if None.

    Returns:
        Indices of converged steps, from the straightest to the most bent. Where both branches of
        a loop pass the same shapes, the first step that reaches a shape stands for it.
    """
    good = np.flatnonzero(np.asarray(path.converged) & np.isfinite(path.total_angle))
    if among is not None:
        good = np.array([step for step in among if step in good], int)
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
    """Draw a robot at several steps of a path into axes of equal scale, with its loads.

    Args:
        axes: Where to draw.
        path: Solved path.
        steps: Which of its steps.
        view: Direction across the base that is drawn to the right [rad].
    """
    top = 3 * len(steps) + 5
    any_closed = False
    loads: list[Acting] = []
    for order, (step, colour) in enumerate(zip(steps, sequence_colours(len(steps)), strict=True)):
        bent = bent_at(path, step)
        shape = outline(bent, view)
        _draw(axes, shape, colour, load_label(path, step), level=3 * order)
        closed = np.flatnonzero(path.closed[step])
        if len(closed):
            points = np.array([shape.lips[notch] for notch in closed])
            axes.plot(
                *points.T,
                "o",
                color=VERMILLION,
                markersize=3.5,
                zorder=top,
            )
            any_closed = True
        loads += acting_at(path, step, bent)
    if any_closed:
        axes.plot([], [], "o", color=VERMILLION, markersize=3.5, label="closed notch")
    draw_loads(axes, loads, view, ARROW * extent_of(path), zorder=top + 1)
    axes.set_aspect("equal", adjustable="datalim")
    axes.set_ylabel("along the base, z [mm]")
    degrees = round(float(np.degrees(view)), 6) % 360
    name = {0.0: "x", 90.0: "y"}.get(degrees, f"x turned by {degrees:g}° about z")
    axes.set_xlabel(f"across the base, {name} [mm]")


def extent_of(path: Path) -> float:
    """Return about how long a robot is [mm]."""
    steps = np.diff(path.body_position[0], axis=0)
    return float(np.linalg.norm(steps, axis=1).sum() + path.robot.tube.outer_diameter)


def arrow_of(one: Acting, largest: float, longest: float) -> NDArray[np.float64]:
    """Return the arrow of a load [mm]: `longest` for the largest, never too short to be seen."""
    return longest * max(one.size / largest, SHORTEST) * one.vector / one.size


def draw_loads(
    axes: Axes, loads: Sequence[Acting], view: float, longest: float, zorder: int
) -> None:
    """Draw forces as arrows from where they act, moments as bent arrows about it.

    Args:
        axes: Where to draw.
        loads: The forces and moments of all shapes.
        view: Direction across the base that is drawn to the right [rad].
        longest: Length of the arrow of the largest force [mm].
        zorder: Above what to draw.
    """
    across = np.array([np.cos(view), np.sin(view), 0.0])
    normal = np.array([-np.sin(view), np.cos(view), 0.0])
    largest = max((one.size for one in loads if one.name == "force"), default=0.0)
    named: set[str] = set()
    for one in loads:
        start = np.array([one.point @ across, one.point[2]])
        if one.name == "force":
            arrow = arrow_of(one, largest, longest)
            arrow = np.array([arrow @ across, arrow[2]])
            _arrow(axes, start, start + arrow, COLOUR[one.kind], zorder)
            reach = [start, start + arrow]
        else:
            # Seen with z up and the view's direction right, a moment about +normal turns z to it.
            turn = -1.0 if one.vector @ normal > 0.0 else 1.0
            side = 0.4 * longest * np.array([1.0, 0.0])
            _arrow(
                axes, start - turn * side, start + turn * side, COLOUR[one.kind], zorder, bend=0.9
            )
            reach = [start - longest, start + longest]
        axes.update_datalim(np.array(reach))
        if one.label not in named:
            axes.plot([], [], color=COLOUR[one.kind], marker=">", markersize=4.0, label=one.label)
            named.add(one.label)
    axes.autoscale_view()


def _arrow(axes: Axes, start: Any, end: Any, colour: str, zorder: int, bend: float = 0.0) -> None:
    axes.add_patch(
        FancyArrowPatch(
            tuple(start),
            tuple(end),
            arrowstyle="-|>",
            connectionstyle=f"arc3,rad={bend}",
            mutation_scale=9.0,
            shrinkA=0.0,
            shrinkB=0.0,
            color=colour,
            linewidth=1.4,
            zorder=zorder,
        )
    )


def load_label(path: Path, step: int) -> str:
    """Return what tells a step apart in a legend: its tensions and its total angle."""
    tensions = ", ".join(f"{value:.3g}" for value in path.tension[step])
    angle = round(float(np.degrees(path.total_angle[step])), 1) + 0.0  # no minus before a zero
    return f"{tensions} N, {angle:.1f}°"


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
