"""A dimensioned drawing of a robot: for every shape of notch a side view and a cross-section.

The cuts are those of `robot.geometry`, in mm; a drawing is in inches of paper, so that a letter has
the same size as the drawing around it.
"""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Iterable, Iterator
from itertools import chain, repeat
from textwrap import shorten
from typing import Any, NamedTuple

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from notchflex import ArcNotch, InputError, Robot, RodGap, StripNotch, ULink
from notchflex.plotting.marks import Area, Array, Arrow, Colour, Curve, Mark, Note, box
from notchflex.plotting.style import BLUE, VERMILLION, house_style
from notchflex.plotting.with_matplotlib import draw_marks
from notchflex.support import Notch, NotchCut, number_at, outline, round_number, with_limits

TEXT = 8.0
"""Size of the letters, in points."""
LETTER = 0.064
"""Width of a letter, in inches, on average and a little more."""
INK = "#222222"
_FINE, _BEYOND, _TUBE = "#555555", "#EAF1F6", "#C9DDEB"
_CENTRE, _HIDDEN = (9.0, 2.0, 1.5, 2.0), (4.0, 2.5)  # dashes

_LEVEL = 0.25  # distance of one dimension line from the next [in]
_SHORTEST = 0.3  # a shorter dimension has its arrows outside [in]

MAX_SHAPES = 6
"""Maximum number of shapes of notches in a drawing; a sentence names the others."""
MM = 1.0 / 25.4
"""Inches of a millimetre."""
# Largest outer diameter, as a part of the width of a row, and that width [in].
_DIAMETER, _WIDTH = 0.26, 10.0
# Room for the diameters, for a column of lengths and beside the cross-section [in].
_LEFT, _COLUMN, _RIGHT = 1.05, 0.85, 1.6
_WORDS = 4.2  # least distance of a cross-section from the start, for the texts below [in]
# In outer diameters: drawn length of a neighbouring piece, longest uncut piece that is not broken,
# and largest distance of a drawn arc from the true one.
_STUB, _LONGEST, _CHORD = 0.35, 1.6, 0.0005

_PIECES: dict[type[Notch], tuple[str, ...]] = {
    ArcNotch: ("height", "uncut length"),
    StripNotch: ("height", "strip thickness", "uncut length"),
    RodGap: ("length", "uncut length"),
    ULink: ("slot width", "strip thickness", "slot width", "uncut length"),
}
"""Names of the lengths along a notch, from the base; other kinds have their numbers alone."""


class Dimension(NamedTuple):
    """A dimension: its two ends [mm], and its name with its value."""

    start: float
    end: float
    text: str


class NotchRow:
    """The views of one shape of notch, side by side: a part of the tube, and a cross-section.

    The first coordinate runs along the tube toward the tip, the second across it toward the bend,
    both from the tube axis at the left end, in mm, or times the scale in inches. Inches are the
    scale [in/mm], width, height and middle of the cross-section, outer and inner radius.
    """

    def __init__(self, robot: Robot, entry: int, names: str, most: float) -> None:
        """Draw two notches of an entry of the robot file, and the last one if its cuts differ."""
        self.robot, self.notch, self.names = robot, robot.notch[entry], names
        self.tube = tube = self.notch.tube or robot.tube
        self.length, self.breaks = 0.0, list[float]()
        self.along, self.cuts, self.faces = list[Dimension](), list[Array](), list[Array]()
        first = sum(notch.repeat for notch in robot.notch[:entry])
        last, layouts = first + self.notch.repeat - 1, robot.geometry.cuts
        self.held = first == 0  # the left end is the proximal face of the robot
        if self.held:
            self._add_piece("base length", robot.tube.base_length, "tube")
        else:
            self._add_stub()
        shown = {first, min(first + 1, last)}
        if len(layouts[last].cuts) != len(layouts[first].cuts):
            shown.add(last)
        before, toward = first, list[tuple[NotchCut, Array]]()
        for number in sorted(shown):
            if number > before + 1:
                self._add_stub()
                self.length += _STUB * tube.outer_diameter
            toward += self._add_notch(number)
            before = number
        end = max([self.length, *(float(cut[-1, 0]) for cut in self.cuts)])
        # A notch that reaches beyond the tip is broken off there too.
        self.tip = before == len(layouts) - 1 and end == self.length
        self.length = end
        if not self.tip:
            self._add_stub()
        self._add_depths(toward)
        columns = _COLUMN * len(self.across) + 0.55
        room = most - _LEFT - columns - _RIGHT
        size = min(_DIAMETER * most, room / (1.0 + self.length / tube.outer_diameter))
        self.scale = usual_scale(size / tube.outer_diameter)
        self.outer, self.inner = self.scale * tube.outer_radius, self.scale * tube.inner_radius
        # From the left end of the tube to the middle of the cross-section.
        self.middle = max(self.scale * self.length + columns + self.outer, _WORDS)
        self.width = _LEFT + self.middle + self.outer + _RIGHT
        self.height = 1.46 + 2.0 * self.outer + _LEVEL * len(self.along) + 0.17 * len(self.notes)

    def _sized(self, name: str, length: float, part: str = "notch") -> str:
        """Return a length with the tolerance of its key of the robot file."""
        key = name.replace(" ", "_")
        return with_limits(self.robot.tolerance, f"{part}.{key}", round(length, 9))

    def _add_piece(self, name: str, length: float, part: str = "notch") -> None:
        """Add a piece, broken if it is too long; the first one of a name has its dimension."""
        start, most = self.length, _LONGEST * self.tube.outer_diameter
        self.length += min(length, most)
        if length > most:
            self.breaks.append(0.5 * (start + self.length))
        text = f"{name} {self._sized(name, length, part)}".strip()
        if length and not any(text == dimension.text for dimension in self.along):
            self.along.append(Dimension(start, self.length, text))

    def _add_stub(self) -> None:
        """Add a part of a neighbouring body, broken off at its outer end."""
        start = self.length
        self.length += _STUB * self.tube.outer_diameter
        self.breaks.append(self.length if start else 0.0)

    def _add_notch(self, number: int) -> Iterator[tuple[NotchCut, Array]]:
        """Add a notch (from 0); yield its cuts from the side of the bend, with their profiles."""
        tube, layouts = self.tube, self.robot.geometry.cuts
        start = self.robot.tube.base_length + sum(layout.length for layout in layouts[:number])
        cuts, length = layouts[number]
        bottoms = [x for cut in cuts for x, y in cut.corners if y == _bottom(cut)]
        # Of a later notch the length behind it is drawn at the tip only.
        far = [length] if not self.cuts or number == len(layouts) - 1 else []
        edges = np.unique(np.round([0.0, *np.subtract(bottoms, start), *far], 9))
        names = chain(_PIECES.get(type(self.notch), ()), repeat(""))
        places = [self.length]
        for name, piece in zip(names, np.diff(edges).tolist(), strict=False):
            self._add_piece(name, piece)
            places.append(self.length)
        for cut in cuts:
            points = np.array(outline(cut, _CHORD * tube.outer_diameter))
            begin = points[0, 0]
            points[:, 0] += np.interp(begin - start, edges, places) - begin
            side = math.cos(math.radians(cut.side_deg - self.notch.direction_deg))
            sign, bottom = math.copysign(1.0, side), _bottom(cut)
            if cut.radial:  # its face is seen from its outer to its inner corner
                if bottom < 0.0:  # above the axis the wall hides it
                    self.faces.append(points[points[:, 1] == bottom] * [1.0, sign])
                bottom = max(bottom, bottom * tube.inner_radius / tube.outer_radius)
                points[:, 1] = np.maximum(points[:, 1], bottom)
            self.cuts.append(points * [1.0, sign])
            if sign > 0.0:
                yield cut, points

    def _add_depths(self, cuts: list[tuple[NotchCut, Array]]) -> None:
        """Add the cross-section at the first of some cuts, and the lengths across the tube."""
        notch, tube, corner = self.notch, self.tube, _bottom(cuts[0][0])
        outer, self.radial = tube.outer_radius, cuts[0][0].radial
        bottoms = [points[points[:, 1] == points[:, 1].min(), 0] for _, points in cuts]
        self.section = float(bottoms[0].mean()), corner
        depth = getattr(notch, "depth", outer - corner)
        lengths = [
            Dimension(corner, outer, f"depth\n{self._sized('depth', depth)}"),
            Dimension(-outer, corner, f"remaining\n{2.0 * outer - depth:.6g}"),
        ]
        # Each column with the place where its extension lines begin.
        self.across = [(float(bottoms[-1].min()), lengths)]
        self.notes = list[str]()
        if isinstance(notch, RodGap):
            half, size = 0.5 * notch.diameter, self._sized("diameter", notch.diameter)
            lengths[:] = [Dimension(-half, half, f"backbone\ndiameter\n{size}")]
            bore = self._sized("inner_diameter", notch.inner_diameter)
            self.notes.append(f"round backbone, inner diameter {bore}")
        strip = getattr(notch, "strip_length", None)
        if isinstance(notch, StripNotch):
            strip = notch.strip_length_in(tube)
            width = self._sized("wall_width", notch.wall_width_in(tube))
            self.notes.append(f"wall width (both walls together) {width}")
        elif isinstance(notch, ULink):
            radius = self._sized("slot_radius", notch.slot_radius)
            self.notes.append(f"slot radius {radius}, half the slot width")
        if strip:
            text = f"strip\nlength\n{self._sized('strip_length', strip)}"
            self.across.append((self.section[0], [Dimension(-0.5 * strip, 0.5 * strip, text)]))


def _bottom(cut: NotchCut) -> float:
    return min(height for _, height in cut.corners)


def label(at: Any, text: str, align: str = "center center", **options: Any) -> Note:
    """Return a text on a white background."""
    options = {"colour": INK, "size": TEXT, "inside": False} | options
    return Note(text, at, align=align, **options)


def _stroke(points: Any, colour: Colour = _FINE, width: float = 0.5, dash: Any = ()) -> Curve:
    return Curve(points, colour, dash, width)


def _ink(points: Any, width: float = 1.0) -> Curve:
    return _stroke(points, INK, width)


def _arrow(start: Any, end: Any, colour: Colour = _FINE, width: float = 0.7) -> Arrow:
    return Arrow([start, end], colour, width, max(6.0, 5.5 * width))


def _dimension(
    start: float, end: float, at: float, edge: float, text: str = "", upright: bool = False
) -> Iterator[Mark]:
    """Yield a dimension line from `start` to `end` along the tube, at a height, with its text.

    Its extension lines start at the height `edge`. An upright one is across the tube.
    """
    middle = 0.5 * (start + end)
    if upright:
        yield label((at + 0.07, middle), text, "left center")
    else:
        yield label((middle, at + 0.035), text, "center bottom")

    def place(along: float, across: float) -> tuple[float, float]:
        return (across, along) if upright else (along, across)

    for end_at in (start, end):
        yield _stroke([place(end_at, edge), place(end_at, at + math.copysign(0.05, at - edge))])
    first, last = place(start, at), place(end, at)
    if end - start >= _SHORTEST:
        yield from (_arrow(first, last), _arrow(last, first))
        return
    yield _arrow(place(start - 0.17, at), first)
    yield _arrow(place(end + 0.17, at), last)
    yield _stroke([first, last], width=0.7)


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
        head = label((0.25, total - 0.25), robot.name, "left center", size=11.0)
        foot = label((0.25, 0.1), "\n".join(notes), "left bottom", size=7.5, colour=_FINE)
        draw_marks(axes, [head, foot])
        top = total - 0.45
        for row in rows:
            draw_row(axes, row, top)
            top -= row.height
    return figure


def paper(width: float, height: float) -> tuple[Figure, Axes]:
    """Return an empty figure of a size, and axes in inches of it."""
    figure = Figure(figsize=(width, height))
    axes = figure.add_axes((0.0, 0.0, 1.0, 1.0), xlim=(0.0, width), ylim=(0.0, height))
    axes.set_axis_off()
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


def notch_rows(robot: Robot, width: float = _WIDTH) -> tuple[list[NotchRow], list[str]]:
    """Return a row for every shape of notch, and the notes that belong to them.

    Raises:
        InputError: A kind of notch has no drawing, or the cuts of none are known.
    """
    shapes, unknown = dict[Notch, tuple[list[str], int]](), list[str]()
    first = 1
    for entry, notch in enumerate(robot.notch):
        last = first + notch.repeat - 1
        single = dataclasses.replace(notch, repeat=1, precurvature_deg=0.0)
        numbers = shapes.setdefault(single, ([], entry))[0] if notch.is_cut else unknown
        numbers.append(str(first) if first == last else f"{first}–{last}")
        first = last + 1
    if not shapes:
        raise InputError.UNSUPPORTED(
            f"the cuts of no notch of {robot.name} are known, so there is no drawing of it; "
            "`notchflex view` shows its bodies."
        )
    named = [(", ".join(numbers), entry) for numbers, entry in shapes.values()]
    rows = [NotchRow(robot, entry, names, width) for names, entry in named[:MAX_SHAPES]]
    notes = ["Lengths in mm, under the names of the robot file; to scale except where broken."]
    if any(notch.precurvature_deg for notch in robot.notch):
        notes[0] += " Drawn without precurvature."
    if len(set(robot.tubes)) > 1:
        notes.append("Every notch is drawn as if the pieces beside it had its tube.")
    if unknown:
        notes.append(f"Not shown, as cuts are not known: notch {', '.join(unknown)}.")
    if others := [names for names, _ in named[MAX_SHAPES:]]:
        notes.append(f"Not shown: notches {shorten(', '.join(others), 100)}.")
    if any(tolerance.sd is not None for tolerance in robot.tolerance):
        notes.append("Tolerances that are standard deviations are drawn as ± twice them.")
    single = [
        f"{name} {with_limits(robot.tolerance, name, number_at(robot, name))}"
        for name in (tolerance.value for tolerance in robot.tolerance)
        if "[" in name
    ]
    return rows, [*notes, f"Of single parts: {', '.join(single)}."] if single else notes


def draw_row(axes: Axes, row: NotchRow, top: float) -> None:
    """Draw the views of one notch below a height."""
    axis = top - 0.62 - _LEVEL * len(row.along) - row.outer
    notch, names = row.notch, shorten(row.names, 48, placeholder=" ...")
    parts = (
        f'{"notch" if names.isdigit() else "notches"} {names}: kind "{notch.kind}"',
        f'cut "{notch.cut}"' if isinstance(notch, ArcNotch) else "",
        f"bends toward {notch.direction_deg:g}°",
        "base length 0" if row.held and not row.robot.tube.base_length else "",
        "" if notch.uncut_length else "uncut length 0",
        f"scale {scale_text(row.scale)}",
    )
    heading = ", ".join(filter(None, parts))
    draw_marks(axes, [label((0.25, top - 0.12), heading, "left center", size=9.0, bold=True)])
    for view, left in (
        (_side_view, _LEFT),
        (_dimensions, _LEFT),
        (_section_view, _LEFT + row.middle),
        (_section_tendons, _LEFT + row.middle),
    ):
        draw_marks(axes, [_shifted(mark, (left, axis)) for mark in view(row)])


def _shifted(mark: Any, origin: Any) -> Any:
    if isinstance(mark, Area):
        return dataclasses.replace(mark, polygons=[ring + origin for ring in mark.polygons])
    if isinstance(mark, Note):
        return dataclasses.replace(mark, at=np.add(mark.at, origin))
    return dataclasses.replace(mark, points=np.add(mark.points, origin))


def _dimensions(row: NotchRow) -> Iterator[Mark]:
    tube, scale, outer = row.tube, row.scale, row.outer
    place = "tube" if row.notch.tube is None else "notch.tube"
    for level, (start, end, text) in enumerate(row.along):
        height = outer + 0.2 + _LEVEL * level
        yield from _dimension(scale * start, scale * end, height, outer, text)
    for name, size, radius, at in (
        ("outer", tube.outer_diameter, outer, -0.6),
        ("inner", tube.inner_diameter, row.inner, -0.25),
    ):
        limits = with_limits(row.robot.tolerance, f"{place}.{name}_diameter", size)
        yield from _dimension(-radius, radius, at, 0.0, upright=True)
        yield label((at - 0.1, 0.0), f"{name} diameter {limits}", turned=True)
    for number, (start, column) in enumerate(row.across):
        right = scale * row.length
        at = right + 0.15 + _COLUMN * (0.5 + number)
        for low, high, text in column:
            yield from _dimension(scale * low, scale * high, at, at - 0.1, text, upright=True)
            for y in (scale * low, scale * high):
                edge = right if abs(y) == outer else scale * start
                yield _stroke([(edge, y), (at + 0.05, y)])


def _side_view(row: NotchRow) -> Iterator[Mark]:
    scale, outer, length = row.scale, row.outer, row.scale * row.length
    yield Area([box(0.0, -outer, length, outer)], _TUBE, 1.0)
    for sign in (-1.0, 1.0):
        yield _ink([(0.0, sign * outer), (length, sign * outer)])
        inner = sign * row.inner
        yield _stroke([(0.0, inner), (length, inner)], width=0.6, dash=_HIDDEN)
    for cut in row.cuts:
        edge = scale * cut
        edge[:, 1] = np.clip(edge[:, 1], -outer, outer)  # a gap goes through all
        out = np.array([0.0, np.sign(cut[0, 1]) * 0.02])  # over the line of the surface
        yield Area([np.concatenate([edge[:1] + out, edge, edge[-1:] + out])], "white", 1.0)
        if isinstance(row.notch, RodGap):
            half = 0.5 * scale * row.notch.diameter
            rod = box(edge[0, 0], -half, edge[-1, 0], half)
            yield Area([rod], INK, 1.0, 0.8, face=BLUE)
            yield from map(_ink, (edge[:2], edge[2:]))
        else:
            yield _ink(edge)
    yield from (_ink(scale * face, 0.7) for face in row.faces)
    for tendon in row.robot.tendon:
        turn = math.radians(tendon.direction_deg - row.notch.direction_deg)
        y = scale * tendon.radius * math.cos(turn)
        yield _stroke([(-0.16, y), (length + 0.06, y)], VERMILLION, 1.1)
    yield _stroke([(-0.12, 0.0), (length + 0.1, 0.0)], dash=_CENTRE)
    for x, free in ((0.0, row.held), (length, row.tip)):
        if free:
            yield _ink([(x, -outer), (x, outer)])
    for place in row.breaks:  # what is omitted: a white band between two zigzag lines
        y = np.linspace(-outer - 0.06, outer + 0.06, 13)
        aside = 0.035 * np.where(np.arange(13) % 2 == 0, -1.0, 1.0)
        left, right = (np.column_stack([scale * place + x + aside, y]) for x in (-0.035, 0.035))
        yield Area([np.concatenate([left, right[::-1]])], "white", 1.0)
        yield from (_stroke(left, INK), _stroke(right, INK))
    if row.held:  # hatched, as what is fixed
        for y in np.arange(-outer, outer, 0.12):
            yield _ink([(-0.1, y), (0.0, y + 0.1)], 0.5)
    low = -outer - 0.47
    yield _arrow((0.0, low), (0.5, low), INK, 1.0)
    yield label((0.56, low), "z, toward the tip", "left center")
    yield _stroke([(1.8, low), (2.1, low)], VERMILLION, 1.1)
    yield label((2.16, low), "tendon", "left center")
    x, foot = scale * row.section[0], -outer - 0.2
    yield _stroke([(x, outer + 0.06), (x, foot)], dash=_CENTRE)
    yield _ink([(x, -outer - 0.05), (x, foot)], 1.4)
    yield _arrow((x + 0.24, foot), (x, foot), INK)
    yield label((x + 0.32, foot), "A", bold=True)


def _section_view(row: NotchRow) -> Iterator[Mark]:
    """Yield the cross-section as seen from the tip, with the bend upward."""
    radius, outer, inner = row.tube.outer_radius, row.outer, row.inner
    yield Area([_arc(outer)], _FINE, 1.0, 0.6, face=_BEYOND)
    yield Area([_arc(inner)], _FINE, 1.0, 0.6, face="white")
    if isinstance(gap := row.notch, RodGap):
        for size, face in ((gap.diameter, BLUE), (gap.inner_diameter, "white")):
            if size:
                yield Area([_arc(0.5 * row.scale * size)], INK, 1.0, 0.8, face=face)
        yield from _around(row, [])
        return
    half = math.acos(-row.section[1] / radius)
    level = math.cos(half) * outer / inner  # of a straight edge, in radii of the bore
    half_inner = half if row.radial else math.acos(min(max(level, -1.0), 1.0))
    ring = _arc(outer, half)
    if row.radial or level < 1.0:  # else less than the wall is left
        ring = np.concatenate([ring, _arc(inner, half_inner)[::-1]])
    yield Area([ring], INK, 1.0, 0.8, face=BLUE)
    # The dimension of the angle of what remains.
    edge = _arc(outer + 0.12, half)
    yield _stroke(edge, width=0.7)
    yield from (_arrow(edge[8], edge[0]), _arrow(edge[-9], edge[-1]))
    for way in _arc(1.0, half)[[0, -1]]:
        yield _stroke(np.outer([outer + 0.02, outer + 0.17], way))
    angle, length = math.degrees(2.0 * half), 2.0 * half * radius
    words = f"remaining arc {angle:.4g}°, {length:.4g} at the outer surface"
    yield from _around(row, [words])


def _arc(size: float, most: float = math.pi) -> Array:
    """Return points of an arc, from its lowest point to an angle on both sides; else a circle."""
    turns = most * np.linspace(-1.0, 1.0, 121)
    return size * np.column_stack([np.sin(turns), -np.cos(turns)])


def _around(row: NotchRow, words: Iterable[str]) -> Iterator[Mark]:
    """Yield what stands round a cross-section: centre lines, texts, the bend, the axes x and y."""
    outer, direction = row.outer, row.notch.direction_deg
    for way in np.eye(2):
        yield _stroke(np.outer([-outer - 0.1, outer + 0.1], way), dash=_CENTRE)
    for number, text in enumerate((*words, *row.notes, "A–A, seen from the tip")):
        yield label((0.0, -outer - 0.3 - 0.17 * number), text, bold=text.startswith("A–A"))
    yield _arrow((0.0, outer + 0.1), (0.0, outer + 0.42), VERMILLION, 2.0)
    yield label((0.12, outer + 0.3), f"bends toward\ndirection {direction:g}°", "left center")
    corner = np.array([outer + 1.15, -0.3 * outer])
    for name, turn in (("x", 90.0), ("y", 180.0)):  # the axes of the base
        angle = math.radians(turn - direction)
        way = np.array([math.cos(angle), math.sin(angle)])
        yield _arrow(corner, corner + 0.28 * way, INK)
        yield label(corner + 0.37 * way, name)


def _section_tendons(row: NotchRow) -> Iterator[Mark]:
    """Yield the tendons, and the radius of the one nearest to the side of the bend."""
    turns = [math.radians(t.direction_deg - row.notch.direction_deg) for t in row.robot.tendon]
    arms = [
        row.scale * tendon.radius * np.array([-math.sin(turn), math.cos(turn)])
        for tendon, turn in zip(row.robot.tendon, turns, strict=True)
    ]
    yield Curve(arms, VERMILLION, None, marker="o", size=4.0, layer=14)
    nearest = int(np.argmax(np.cos(turns)))
    radius = row.robot.tendon[nearest].radius
    limits, (x, y) = with_limits(row.robot.tolerance, "tendon.radius", radius), arms[nearest]
    yield _arrow((0.0, 0.0), (x, y))
    yield _stroke([(0.5 * x, 0.5 * y), (row.outer + 0.32, 0.5 * y)])
    yield label((row.outer + 0.34, 0.5 * y), f"tendon\nradius\n{limits}", "left center")
