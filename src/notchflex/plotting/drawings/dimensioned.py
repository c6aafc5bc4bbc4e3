"""A dimensioned drawing of a robot: for every shape of notch a side view and a cross-section."""

from __future__ import annotations

import dataclasses
import math
from dataclasses import dataclass
from textwrap import shorten

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Rectangle, Wedge

from notchflex import Robot
from notchflex.plotting.drawings import dimension_lines as draw
from notchflex.plotting.drawings.notch_views import NotchView, notch_view
from notchflex.plotting.style import BLUE, VERMILLION, house_style
from notchflex.support import Notch, number_at, round_number, with_limits

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
    corner = np.array([x + outer + 1.15, y - 0.3 * outer])
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
        text = f"tendon\nradius\n{with_limits(robot.tolerance, 'tendon.radius', tendon.radius)}"
        if abs(math.sin(turn)) < 1e-6 and math.cos(turn) > 0.0:
            at = centre[0] + outer + 0.28
            draw.line(axes, [position[0], at + 0.05], [position[1]] * 2)
            draw.line(axes, [centre[0], at + 0.05], [centre[1]] * 2)
            draw.vertical(axes, centre[1], float(position[1]), at, at - 0.1)
            draw.label(axes, at + 0.06, 0.5 * (centre[1] + float(position[1])), text, ha="left")
        else:
            draw.arrow(axes, centre, (float(position[0]), float(position[1])))
            draw.label(axes, centre[0] + outer + 0.3, float(position[1]), text, ha="left")


MAX_SHAPES = 6
"""Maximum number of shapes of notches in a drawing; a sentence names the others."""
DIAMETER, WIDTH = 0.26, 10.0
"""Largest outer diameter, as a part of the width of a row, and that width [in]."""
MM = 1.0 / 25.4
"""Inches of a millimetre."""
LEFT, COLUMN, RIGHT = 1.05, 0.85, 1.6
"""Room for the diameters, for a column of lengths and beside the cross-section [in]."""
WORDS = 4.2
"""Least distance of a cross-section from the start of the side view, for the texts below [in]."""
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
    rows, notes = notch_rows(robot)
    with house_style():
        total = sum(row.height for row in rows) + 0.6 + 0.15 * len(notes)
        figure, axes = paper(max(row.width for row in rows), total)
        axes.text(0.25, total - 0.25, robot.name, fontsize=11.0, va="center", parse_math=False)
        top = total - 0.45
        for row in rows:
            draw_row(axes, row, top)
            top -= row.height
        axes.text(0.25, 0.1, "\n".join(notes), fontsize=7.5, color=draw.FINE)
    return figure


def paper(width: float, height: float) -> tuple[Figure, Axes]:
    """Return an empty figure of a size, and axes in inches of it."""
    figure = Figure(figsize=(width, height))
    axes = figure.add_axes((0.0, 0.0, 1.0, 1.0))
    axes.set_axis_off()
    axes.set_xlim(0.0, width)
    axes.set_ylim(0.0, height)
    return figure, axes


def usual_scale(most: float) -> float:
    """Return the largest scale of ISO 5455 that is not above one [in/mm]."""
    return MM * round_number(most / MM)


def scale_text(scale: float) -> str:
    """Return a scale [in/mm] as a drawing states it.

    Example:
        >>> scale_text(20.0 * MM), scale_text(0.2 * MM)
        ('20:1', '1:5')
    """
    ratio = scale / MM
    return f"{ratio:g}:1" if ratio >= 1.0 else f"1:{1.0 / ratio:g}"


@dataclass(frozen=True)
class NotchRow:
    """The views of one shape of notch, side by side, within a width [in]."""

    robot: Robot
    names: str
    notch: Notch
    view: NotchView
    most: float

    @property
    def scale(self) -> float:
        """The scale [in/mm]."""
        outer = self.robot.tube.outer_diameter
        room = self.most - LEFT - COLUMN * len(self.view.across) - 0.35 - RIGHT
        fits = min(DIAMETER * self.most / outer, room / (self.view.length + outer))
        return usual_scale(fits)

    @property
    def height(self) -> float:
        """Its height [in]."""
        above = draw.LEVEL * max(draw.levels(self.along), default=0)
        below = 0.17 * len(self.view.notes)
        return 1.71 + above + self.scale * self.robot.tube.outer_diameter + below

    @property
    def along(self) -> list[tuple[float, float, str]]:
        """Ends of the dimensions along the tube [in], and their texts."""
        ends = [LEFT, LEFT] + self.scale * np.array([(d.start, d.end) for d in self.view.along])
        return [(a, b, d.text) for (a, b), d in zip(ends.tolist(), self.view.along, strict=True)]

    @property
    def section(self) -> float:
        """Where the middle of the cross-section is [in]."""
        columns = self.scale * self.view.length + COLUMN * len(self.view.across)
        return LEFT + max(columns + 0.35 + self.scale * self.robot.tube.outer_radius, WORDS)

    @property
    def width(self) -> float:
        """Its width [in]."""
        return self.section + self.scale * self.robot.tube.outer_radius + RIGHT


def notch_rows(robot: Robot, width: float = WIDTH) -> tuple[list[NotchRow], list[str]]:
    """Return a row for every shape of notch, and the notes that belong to them.

    Raises:
        InputError: A kind of notch has no drawing.
    """
    shapes = _shapes(robot)
    after = (*robot.notch[1:], None)
    rows: list[NotchRow] = []
    for names, number in shapes[:MAX_SHAPES]:
        view = notch_view(robot.notch[number], robot, number == 0, after[number])
        rows.append(NotchRow(robot, names, robot.notch[number], view, width))
    notes = ["Lengths in mm, under the names of the robot file; to scale except where broken."]
    if any(notch.precurvature_deg for notch in robot.notch):
        notes[0] += " Drawn without precurvature."
    if len(shapes) > MAX_SHAPES:
        others = shorten(", ".join(names for names, _ in shapes[MAX_SHAPES:]), 100)
        notes.append(f"Not shown: notches {others}.")
    if any(one.sd is not None for one in robot.tolerance):
        notes.append("Tolerances that are standard deviations are drawn as ± twice them.")
    single = [
        f"{one.value} {with_limits(robot.tolerance, one.value, number_at(robot, one.value))}"
        for one in robot.tolerance
        if "[" in one.value
    ]
    return rows, [*notes, f"Of single parts: {', '.join(single)}."] if single else notes


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


def draw_row(axes: Axes, row: NotchRow, top: float) -> None:
    """Draw the views of one notch below a height."""
    robot, notch, view, scale = row.robot, row.notch, row.view, row.scale
    names = shorten(row.names, 48, placeholder=" ...")
    outer = scale * robot.tube.outer_radius
    number = "notch" if names.isdigit() else "notches"
    variant = f", {view.variant}" if view.variant else ""
    head = f'{number} {names}: kind "{notch.kind}"{variant}, bends toward {notch.direction_deg:g}°'
    head += "".join(f", {name} 0" for name in view.absent) + f", scale {scale_text(scale)}"
    axes.text(0.25, top - 0.12, head, fontsize=9.0, va="center", fontweight="bold")
    along, stages = row.along, draw.levels(row.along)
    axis = top - 0.42 - draw.LEVEL * (1 + max(stages, default=0)) - 0.2 - outer
    right = LEFT + scale * view.length
    _side_view(axes, row, axis)
    for (start, end, text), stage in zip(along, stages, strict=True):
        draw.horizontal(
            axes, start, end, axis + outer + 0.2 + draw.LEVEL * stage, axis + outer, text
        )
    for size, at, name in (
        (robot.tube.outer_diameter, LEFT - 0.6, "outer"),
        (robot.tube.inner_diameter, LEFT - 0.25, "inner"),
    ):
        limits = with_limits(robot.tolerance, f"tube.{name}_diameter", size)
        text = f"{name} diameter {limits}"
        low, high = axis - 0.5 * scale * size, axis + 0.5 * scale * size
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
    section_view(axes, robot, notch, view, scale, (row.section, axis))


def _side_view(axes: Axes, row: NotchRow, axis: float) -> None:
    robot, view, scale = row.robot, row.view, row.scale
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
    for tendon in robot.tendon:
        turn = math.radians(tendon.direction_deg - row.notch.direction_deg)
        y = axis + scale * tendon.radius * math.cos(turn)
        draw.line(axes, [LEFT - 0.16, right + 0.06], [y, y], color=VERMILLION, lw=1.1, zorder=6)
    foot = axis - outer - 0.47  # the direction of the tip
    draw.arrow(axes, (LEFT, foot), (LEFT + 0.5, foot), color=draw.INK, lw=1.0)
    draw.label(axes, LEFT + 0.56, foot, "z, toward the tip", ha="left")
    draw.line(axes, [LEFT + 1.8, LEFT + 2.1], [foot] * 2, color=VERMILLION, lw=1.1)
    draw.label(axes, LEFT + 2.16, foot, "tendon", ha="left")
    section = LEFT + scale * view.section_at
    foot = axis - outer - 0.2
    draw.centre_line(axes, [section] * 2, [axis + outer + 0.06, foot])
    draw.line(axes, [section] * 2, [axis - outer - 0.05, foot], color=draw.INK, lw=1.4)
    draw.arrow(axes, (section + 0.24, foot), (section, foot), color=draw.INK)
    draw.label(axes, section + 0.32, foot, "A", fontweight="bold")
