"""The cross-section of a dimensioned drawing: remaining wall, tendons and directions."""

from __future__ import annotations

import math

import numpy as np
from matplotlib.axes import Axes
from matplotlib.patches import Rectangle, Wedge

from notchflex.plotting.drawings import dimension_lines as draw
from notchflex.plotting.drawings.notch_views import NotchView
from notchflex.plotting.style import BLUE, VERMILLION
from notchflex.robot import Robot
from notchflex.robot.kinds import Notch

Centre = tuple[float, float]

BEYOND, SECTION = "#EAF1F6", BLUE
"""Colours of the tube behind the section and of the section."""


def section_view(
    axes: Axes, robot: Robot, notch: Notch, view: NotchView, scale: float, centre: Centre
) -> None:
    """Draw the cross-section as seen from the tip, with the bend upward.

    The tube axis is at a centre [in] on axes in inches of paper; the scale is in in/mm.
    """
    x, y = centre
    outer, inner = scale * robot.tube.outer_radius, scale * robot.tube.inner_radius
    wall = outer - inner
    level = scale * view.section_from
    axes.add_patch(
        Wedge(centre, outer, 0, 360, width=wall, facecolor=BEYOND, edgecolor=draw.FINE, lw=0.6)
    )
    half = math.acos(view.section_from / robot.tube.outer_radius)
    if not view.toward:
        half = math.pi - half
    middle = 90.0 if view.toward else 270.0
    turn = math.degrees(half)
    style = {"facecolor": SECTION, "edgecolor": draw.INK, "lw": 0.8, "zorder": 4}
    if view.radial:
        axes.add_patch(Wedge(centre, outer, middle - turn, middle + turn, width=wall, **style))
    else:
        left = Wedge(centre, outer, 0, 360, width=wall, **style)
        axes.add_patch(left)
        size = outer + 0.1
        low, high = (y + level, y + size) if view.toward else (y - size, y + level)
        kept = Rectangle((x - size, low), 2.0 * size, high - low, transform=axes.transData)
        left.set_clip_path(kept)
        chord = [math.sqrt(max(radius**2 - level**2, 0.0)) for radius in (inner, outer)]
        for sign in (-1.0, 1.0):
            ends = [x + sign * end for end in chord]
            draw.line(axes, ends, [y + level] * 2, color=draw.INK, lw=0.8, zorder=5)
    draw.centre_line(axes, [x - outer - 0.1, x + outer + 0.1], [y, y])
    draw.centre_line(axes, [x, x], [y - outer - 0.1, y + outer + 0.1])
    _directions(axes, notch, centre, outer)
    _section_tendons(axes, robot, notch, scale, centre, outer)
    draw.angular(axes, centre, outer + 0.12, half, view.toward)
    arc = 2.0 * half * robot.tube.outer_radius
    words = f"remaining arc {2.0 * turn:.4g}°, {arc:.4g} at the outer surface"
    foot = y - outer - 0.3
    for text in (words, *view.notes, "A–A, seen from the tip"):
        weight = "bold" if text.startswith("A–A") else "normal"
        draw.label(axes, x, foot, text, fontweight=weight)
        foot -= 0.17


def _directions(axes: Axes, notch: Notch, centre: Centre, outer: float) -> None:
    """Draw the direction of bending, and the axes x and y of the base."""
    x, y = centre
    style = {"color": VERMILLION, "lw": 2.0, "mutation_scale": 11.0}
    draw.arrow(axes, (x, y + outer + 0.1), (x, y + outer + 0.42), **style)
    text = f"bends toward\ndirection {notch.direction_deg:g}°"
    draw.label(axes, x + 0.12, y + outer + 0.3, text, ha="left")
    corner = np.array([x + outer + 0.62, y - 0.72 * outer])
    for name, direction in (("x", 0.0), ("y", 90.0)):
        angle = math.radians(90.0 + direction - notch.direction_deg)
        way = np.array([math.cos(angle), math.sin(angle)])
        end = corner + 0.28 * way
        draw.arrow(axes, (corner[0], corner[1]), (end[0], end[1]), color=draw.INK)
        position = corner + 0.37 * way
        draw.label(axes, position[0], position[1], name)


def _section_tendons(
    axes: Axes, robot: Robot, notch: Notch, scale: float, centre: Centre, outer: float
) -> None:
    """Draw the tendons, and the radius of the one nearest to the side of the bend."""
    turns = [math.radians(one.direction_deg - notch.direction_deg) for one in robot.tendon]
    nearest = max(range(len(turns)), key=lambda number: math.cos(turns[number]))
    for number, (tendon, turn) in enumerate(zip(robot.tendon, turns, strict=True)):
        way = np.array([-math.sin(turn), math.cos(turn)])
        position = np.asarray(centre) + scale * tendon.radius * way
        axes.plot(*position, "o", ms=5.0, color=VERMILLION, mec="white", mew=0.6, zorder=14)
        if number != nearest:
            continue
        text = f"tendon\nradius\n{tendon.radius:.4g}"
        if abs(math.sin(turn)) < 1e-6 and math.cos(turn) > 0.0:
            at = centre[0] + outer + 0.28
            draw.line(axes, [position[0], at + 0.05], [position[1]] * 2)
            draw.line(axes, [centre[0], at + 0.05], [centre[1]] * 2)
            draw.vertical(axes, centre[1], float(position[1]), at, at - 0.1)
            draw.label(axes, at + 0.06, 0.5 * (centre[1] + float(position[1])), text, ha="left")
        else:
            draw.arrow(axes, centre, (float(position[0]), float(position[1])))
            draw.label(axes, centre[0] + outer + 0.3, float(position[1]), text, ha="left")
