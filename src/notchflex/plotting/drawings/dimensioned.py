"""A dimensioned drawing of a robot: for every shape of notch a side view and a cross-section."""

from __future__ import annotations

import dataclasses
import math
from pathlib import Path as FilePath

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from notchflex.plotting.drawings import dimension_lines as draw
from notchflex.plotting.drawings.dimensioned_section import section_view
from notchflex.plotting.drawings.notch_views import NotchView, notch_view
from notchflex.plotting.style import VERMILLION, house_style, save
from notchflex.robot import Robot
from notchflex.robot.kinds import Notch

MAX_SHAPES = 6
"""Maximum number of shapes of notches in a drawing; a sentence names the others."""
DIAMETER, ROOM = 1.9, 5.0
"""Largest outer diameter and side view on paper [in]."""
LEFT, COLUMN, RIGHT = 1.05, 0.85, 1.2
"""Room for the diameters, for a column of lengths and beside the cross-section [in]."""
TUBE = "#C9DDEB"


def dimensioned_figure(robot: Robot) -> Figure:
    """Draw the tube and every shape of notch with their dimensions, to scale [mm].

    Args:
        robot: The robot; its dimensions have the names of the robot file.

    Returns:
        The drawing; `notchflex.plotting.save` writes it.

    Raises:
        InputError: A kind of notch has no drawing.

    Example:
        >>> import notchflex as nf
        >>> figure = dimensioned_figure(nf.load_robot("pacheco2021-a"))
        >>> "height 0.8" in [text.get_text() for text in figure.axes[0].texts]
        True
    """
    shapes = _shapes(robot)
    rows = [(names, robot.notch[number]) for names, number in shapes[:MAX_SHAPES]]
    views = [
        notch_view(robot.notch[number], robot, number == 0, (*robot.notch, None)[number + 1])
        for _, number in shapes[:MAX_SHAPES]
    ]
    with house_style():
        heights = [_row_height(view, robot) for view in views]
        total = sum(heights) + 0.75
        width = max(_section_at(view, robot)[1] for view in views) + RIGHT
        figure = Figure(figsize=(width, total))
        axes = figure.add_axes((0.0, 0.0, 1.0, 1.0))
        axes.set_axis_off()
        axes.set_xlim(0.0, width)
        axes.set_ylim(0.0, total)
        axes.text(0.25, total - 0.25, robot.name, fontsize=11.0, va="center")
        top = total - 0.45
        for (names, notch), view, height in zip(rows, views, heights, strict=True):
            _row(axes, robot, names, notch, view, top)
            top -= height
        left = f" Not shown: notches {', '.join(s[0] for s in shapes[MAX_SHAPES:])}."
        note = "Lengths in mm, under the names of the robot file; to scale except where broken."
        if any(notch.precurvature_deg for notch in robot.notch):
            note += " Drawn without precurvature."
        note += left if len(shapes) > MAX_SHAPES else ""
        axes.text(0.25, 0.16, note, fontsize=7.5, va="center", color=draw.FINE)
    return figure


def save_dimensioned(robot: Robot, target: str | FilePath) -> None:
    """Write the dimensioned drawing of a robot; see `dimensioned_figure` and `save`."""
    save(dimensioned_figure(robot), target)


def _shapes(robot: Robot) -> list[tuple[str, int]]:
    """Return the different notches: their numbers as text, and the index in `robot.notch`."""
    shapes: dict[Notch, tuple[list[str], int]] = {}
    first = 1
    for number, notch in enumerate(robot.notch):
        last = first + notch.repeat - 1
        single = dataclasses.replace(notch, repeat=1, precurvature_deg=0.0)
        names, _ = shapes.setdefault(single, ([], number))
        names.append(str(first) if first == last else f"{first}–{last}")
        first = last + 1
    return [(", ".join(names), number) for names, number in shapes.values()]


def _scale(view: NotchView, robot: Robot) -> float:
    """Return the scale [in/mm]."""
    return min(DIAMETER / robot.tube.outer_diameter, ROOM / view.length)


def _along(view: NotchView, scale: float) -> list[tuple[float, float, str]]:
    return [(LEFT + scale * d.start, LEFT + scale * d.end, d.text) for d in view.along]


def _row_height(view: NotchView, robot: Robot) -> float:
    scale = _scale(view, robot)
    above = 1 + max(draw.levels(_along(view, scale)), default=0)
    below = 0.3 + 0.17 * (2 + len(view.notes)) + 0.2
    return 0.42 + draw.LEVEL * above + 0.2 + scale * robot.tube.outer_diameter + below


def _section_at(view: NotchView, robot: Robot) -> tuple[float, float]:
    """Return the centre and the right end of the cross-section [in]."""
    scale = _scale(view, robot)
    columns = LEFT + scale * view.length + COLUMN * len(view.across)
    outer = scale * robot.tube.outer_radius
    return columns + 0.35 + outer, columns + 0.35 + 2.0 * outer


def _row(axes: Axes, robot: Robot, names: str, notch: Notch, view: NotchView, top: float) -> None:
    """Draw the views of one notch below a height."""
    scale = _scale(view, robot)
    outer = scale * robot.tube.outer_radius
    number = "notch" if names.isdigit() else "notches"
    variant = f", {view.variant}" if view.variant else ""
    head = f'{number} {names}: kind "{notch.kind}"{variant}, bends toward {notch.direction_deg:g}°'
    head += "".join(f", {name} 0" for name in view.absent)
    axes.text(0.25, top - 0.12, head, fontsize=9.0, va="center", fontweight="bold")
    along = _along(view, scale)
    stages = draw.levels(along)
    axis = top - 0.42 - draw.LEVEL * (1 + max(stages, default=0)) - 0.2 - outer
    right = LEFT + scale * view.length
    _side_view(axes, robot, notch, view, scale, axis)
    for (start, end, text), stage in zip(along, stages, strict=True):
        draw.horizontal(
            axes, start, end, axis + outer + 0.2 + draw.LEVEL * stage, axis + outer, text
        )
    for radius, at, name in (
        (robot.tube.outer_radius, LEFT - 0.6, "outer"),
        (robot.tube.inner_radius, LEFT - 0.25, "inner"),
    ):
        text = f"{name} diameter {2.0 * radius:.4g}"
        low, high = axis - scale * radius, axis + scale * radius
        draw.vertical(axes, low, high, at, LEFT)
        draw.label(axes, at - 0.1, axis, text, rotation=90)
    columns = [right + 0.15 + COLUMN * (0.5 + number) for number in range(len(view.across))]
    for start, height, column in view.projected:
        ends = [LEFT + scale * start, columns[column] + 0.05]
        draw.line(axes, ends, [axis + scale * height] * 2)
    for at, column in zip(columns, view.across, strict=True):
        for one in column:
            low, high = axis + scale * one.start, axis + scale * one.end
            roomy = high - low > 0.5
            draw.vertical(axes, low, high, at, at - 0.1)
            for y in {low, high} & {axis - outer, axis + outer}:
                draw.line(axes, [right, at], [y, y])
            x, aside = (at, "center") if roomy else (at + 0.07, "left")
            draw.label(axes, x, 0.5 * (low + high), one.text, ha=aside)
    centre = (_section_at(view, robot)[0], axis)
    section_view(axes, robot, notch, view, scale, centre)


def _side_view(
    axes: Axes, robot: Robot, notch: Notch, view: NotchView, scale: float, axis: float
) -> None:
    outer, inner = scale * robot.tube.outer_radius, scale * robot.tube.inner_radius
    right = LEFT + scale * view.length
    axes.fill_between([LEFT, right], axis - outer, axis + outer, color=TUBE, lw=0, zorder=2)
    for sign in (-1.0, 1.0):
        draw.line(axes, [LEFT, right], [axis + sign * outer] * 2, color=draw.INK, lw=1.0, zorder=3)
        hidden = {"color": draw.FINE, "lw": 0.6, "dashes": (4, 2.5), "zorder": 3}
        draw.line(axes, [LEFT, right], [axis + sign * inner] * 2, **hidden)
    draw.centre_line(axes, [LEFT - 0.12, right + 0.1], [axis, axis])
    for cut in view.cuts:
        edge = np.array([LEFT, axis]) + scale * cut.edge
        out = np.array([0.0, np.sign(cut.edge[0, 1]) * 0.02])  # over the line of the surface
        hole = np.concatenate([edge[:1] + out, edge, edge[-1:] + out])
        axes.fill(*hole.T, facecolor="white", edgecolor="none", zorder=4)
        axes.plot(*edge.T, color=draw.INK, lw=1.0, zorder=5, solid_joinstyle="miter")
        if cut.face is not None:
            face = np.array([LEFT, axis]) + scale * cut.face
            axes.plot(*face.T, color=draw.INK, lw=0.7, zorder=5)
    for end, free in ((LEFT, view.held), (right, view.tip)):
        if free:
            draw.line(axes, [end, end], [axis - outer, axis + outer], color=draw.INK, lw=1.0)
    for at in view.breaks:
        draw.broken(axes, LEFT + scale * at, axis - outer, axis + outer)
    if view.held:  # hatched, as what is fixed
        for y in np.arange(axis - outer, axis + outer, 0.12):
            draw.line(axes, [LEFT - 0.1, LEFT], [y, y + 0.1], color=draw.INK)
    _tendons(axes, robot, notch, scale, axis, right)
    section = LEFT + scale * view.section_at
    foot = axis - outer - 0.2
    draw.centre_line(axes, [section] * 2, [axis + outer + 0.06, foot])
    draw.line(axes, [section] * 2, [axis - outer - 0.05, foot], color=draw.INK, lw=1.4)
    draw.arrow(axes, (section + 0.24, foot), (section, foot), color=draw.INK)
    draw.label(axes, section + 0.32, foot, "A", fontweight="bold")


def _tendons(
    axes: Axes, robot: Robot, notch: Notch, scale: float, axis: float, right: float
) -> None:
    """Draw the tendons in the side view, and the direction of the tip."""
    for tendon in robot.tendon:
        turn = math.radians(tendon.direction_deg - notch.direction_deg)
        y = axis + scale * tendon.radius * math.cos(turn)
        draw.line(axes, [LEFT - 0.16, right + 0.06], [y, y], color=VERMILLION, lw=1.1, zorder=6)
    foot = axis - scale * robot.tube.outer_radius - 0.47
    draw.arrow(axes, (LEFT, foot), (LEFT + 0.5, foot), color=draw.INK, lw=1.0)
    draw.label(axes, LEFT + 0.56, foot, "z, toward the tip", ha="left")
    draw.line(axes, [LEFT + 1.8, LEFT + 2.1], [foot] * 2, color=VERMILLION, lw=1.1)
    draw.label(axes, LEFT + 2.16, foot, "tendon", ha="left")
