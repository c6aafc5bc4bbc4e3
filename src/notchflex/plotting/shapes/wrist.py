"""The robot to scale, seen across the plane it bends in, at several loads."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from notchflex.plotting.drive import by_stroke, driven_by_stroke
from notchflex.plotting.shapes.acting import COLOUR, Acting, acting_at
from notchflex.plotting.shapes.bent import bent_at
from notchflex.plotting.shapes.outline import Outline, outline
from notchflex.plotting.sheet import BESIDE, FINE, Area, Arrow, Colour, Item, Line, Note, Panel
from notchflex.plotting.style import GREY, ORANGE, VERMILLION, rgb, sequence_colours

if TYPE_CHECKING:
    from notchflex.results import EquilibriumPath

MOST_SHAPES = 5
"""More shapes than this hide each other."""

ARROW = 0.18
"""Length of the arrow of the largest force, in lengths of the robot."""

_NOTHING = 1e-6
"""A tension [N] or stroke [mm] less than this is written as 0."""

SHORTEST = 0.25
"""Length of the shortest arrow, in lengths of the longest."""


def telling_steps(
    path: EquilibriumPath, most: int = MOST_SHAPES, among: Sequence[int] | None = None
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


def wrist_panel(
    path: EquilibriumPath,
    steps: Sequence[int],
    view: float = 0.0,
    *,
    title: str = "",
    scale: str = "shape",
    colours: Sequence[Colour] | None = None,
    legend: str = BESIDE,
) -> Panel:
    """Return a robot at several steps of a path, on axes of equal scale, with its loads.

    Args:
        path: Solved path.
        steps: Which of its steps.
        view: Direction across the base that is drawn to the right [rad].
        title: What stands above it.
        scale: Panels of one name show the same part of the plane.
        colours: One for each step; from dark to light if None.
        legend: Where its legend stands.
    """
    items: list[Item] = []
    closed_points: list[NDArray[np.float64]] = []
    loads: list[Acting] = []
    colours = sequence_colours(len(steps)) if colours is None else colours
    for order, (step, colour) in enumerate(zip(steps, colours, strict=True)):
        bent = bent_at(path, step)
        shape = outline(bent, view)
        if not order:  # what holds the robot stands still: it is drawn once
            items.append(Area([shape.held], GREY, GREY, 0.5, layer=1))
        items += _robot(shape, colour, load_label(path, step), level=3 * order)
        closed_points += [shape.contact_pairs[notch] for notch in np.flatnonzero(path.closed[step])]
        loads += acting_at(path, step, bent)
    top = 3 * len(steps) + 5
    if closed_points:
        dots = np.array(closed_points)
        mark: dict[str, Any] = {
            "dash": None,
            "marker": "o",
            "size": 3.5,
            "group": "closed notch",
            "layer": top,
        }
        items.append(Line(dots, VERMILLION, name="closed notch", **mark))
    items += load_arrows(loads, view, ARROW * extent_of(path), layer=top + 1)
    if not steps:
        items.append(Note("no step was solved"))
    return Panel(
        items,
        f"across the base, {across_name(view)} [mm]",
        "along the base, z [mm]",
        title=title,
        legend=legend if steps else "",
        equal=True,
        scale=scale,
    )


def across_name(view: float) -> str:
    """Return what the direction across the base that is drawn to the right is called."""
    degrees = round(float(np.degrees(view)), 6) % 360
    return {0.0: "x", 90.0: "y"}.get(degrees, f"x turned by {degrees:g}° about z")


def extent_of(path: EquilibriumPath) -> float:
    """Return about how long a robot is [mm]."""
    steps = np.diff(path.body_position[0], axis=0)
    return float(np.linalg.norm(steps, axis=1).sum() + path.robot.tube.outer_diameter)


def arrow_of(one: Acting, largest: float, longest: float) -> NDArray[np.float64]:
    """Return the arrow of a load [mm]: `longest` for the largest, never too short to be seen."""
    return longest * max(one.size / largest, SHORTEST) * one.vector / one.size


def load_arrows(
    loads: Sequence[Acting], view: float, longest: float, layer: int
) -> Iterator[Arrow]:
    """Return forces as arrows from where they act, moments as bent arrows about it.

    Args:
        loads: The forces and moments of all shapes.
        view: Direction across the base that is drawn to the right [rad].
        longest: Length of the arrow of the largest force [mm].
        layer: Above what they lie.
    """
    across = np.array([np.cos(view), np.sin(view), 0.0])
    normal = np.array([-np.sin(view), np.cos(view), 0.0])
    largest = max((one.size for one in loads if one.name == "force"), default=0.0)
    named: set[str] = set()
    for one in loads:
        start = np.array([one.point @ across, one.point[2]])
        name = "" if one.label in named else one.label
        named.add(one.label)
        if one.name == "force":
            arrow = arrow_of(one, largest, longest)
            end = start + np.array([arrow @ across, arrow[2]])
            yield Arrow(start, end, COLOUR[one.kind], name=name, layer=layer)
        else:
            # Seen with z up and the view's direction right, a moment about +normal turns z to it.
            turn = -1.0 if one.vector @ normal > 0.0 else 1.0
            side = 0.4 * longest * turn * np.array([1.0, 0.0])
            yield Arrow(
                start - side,
                start + side,
                COLOUR[one.kind],
                bend=0.9,
                name=name,
                layer=layer,
                reach=np.array([start - longest, start + longest]),
            )


def load_label(path: EquilibriumPath, step: int) -> str:
    """Return what tells a step apart in a legend: what drives it, and its total angle.

    The strokes of tendons that strokes drive, and the tensions where there are none.
    """
    angle = round(float(np.degrees(path.total_angle[step])), 1) + 0.0  # no minus before a zero
    drawn = driven_by_stroke(path) or [
        tendon for tendon in range(path.tension.shape[1]) if by_stroke(path, tendon)
    ]
    if not drawn:
        return f"{', '.join(_short(value) for value in path.tension[step])} N, {angle:.1f}°"
    return f"{', '.join(_short(path.stroke[step, one]) for one in drawn)} mm, {angle:.1f}°"


def _short(value: float) -> str:
    """Write a load with three digits; what rounding left of nothing is nothing."""
    return f"{0.0 if abs(value) < _NOTHING else value:.3g}"


def _robot(shape: Outline, colour: Colour, label: str, level: int) -> Iterator[Item]:
    # Pale and nearly opaque: shapes further bent lie over the others, and lines stay readable.
    pale = tuple(1.0 - 0.3 * (1.0 - part) for part in rgb(colour))
    yield Area(
        [*shape.flexures, *shape.bodies], pale, colour, name=label, group=label, layer=2 + level
    )
    bores = np.concatenate([_apart(line) for line in shape.bores])
    yield Line(bores, colour, FINE, 0.5, group=label, layer=3 + level)
    for line in shape.tendons:
        yield Line(line, ORANGE, width=1.0, group=label, layer=4 + level)


def _apart(line: NDArray[np.float64]) -> NDArray[np.float64]:
    """A line and a gap behind it."""
    return np.concatenate([line, np.full((1, 2), np.nan)])
