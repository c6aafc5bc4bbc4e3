"""Views of one kind of notch for a dimensioned drawing: cuts and dimensions.

All lengths are in mm. In the side view the first coordinate runs along the tube toward the tip, the
second across it toward the bend, both from the tube axis at the left end of the view. A new kind
of notch registers its own `notch_view`.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import singledispatch
from typing import Any

import numpy as np
from numpy.typing import NDArray

from notchflex.errors import InputError
from notchflex.robot import ArcNotch, Robot, StripNotch, ULink
from notchflex.robot.kinds import Notch
from notchflex.robot.notches.cut import NotchCut
from notchflex.robot.notches.profile import outline

Points = NDArray[np.float64]

STUB = 0.35
"""Drawn length of a neighbouring piece, in outer diameters."""
LONGEST = 1.6
"""Longest uncut piece that is not broken, in outer diameters."""
CHORD = 0.0005
"""Largest distance of a drawn arc from the true one, in outer diameters."""


@dataclass(frozen=True)
class Dimension:
    """A dimension: its two ends [mm], and its name with its value."""

    start: float
    end: float
    text: str


@dataclass(frozen=True)
class Cut:
    """A cut in the side view."""

    edge: Points  # its corners, the first and the last on the outer surface, (k, 2)
    face: Points | None = None  # ends of a second visible edge, as of a slanted cut face, (2, 2)


@dataclass(frozen=True)
class NotchView:
    """Side view and cross-section of one kind of notch."""

    length: float  # of tube in the side view [mm]
    held: bool  # the left end is the proximal face of the robot
    tip: bool  # the right end is the tip
    breaks: Sequence[float]  # positions at which a part of the tube is omitted [mm]
    cuts: Sequence[Cut]
    along: Sequence[Dimension]
    across: Sequence[Sequence[Dimension]]  # in columns, from the tube axis
    projected: Sequence[tuple[float, float, int]]  # their extension lines: start, height, column
    section_at: float  # position of the cross-section [mm]
    section_from: float  # height of the edge of the remaining section [mm], from the tube axis
    radial: bool = False  # the edges of the cut are radial (on-axis), not one straight line
    toward: bool = False  # the remaining section lies on the side of the bend
    notes: Sequence[str] = ()  # further dimensions in words
    absent: Sequence[str] = ()  # names of dimensions that are 0


def _drawn(cut: NotchCut, at: float, sign: float, diameter: float) -> Points:
    """Return the edge of a cut that starts at a place of the view, above or below the axis."""
    points = np.array(outline(cut, CHORD * diameter))
    return (points - [points[:, 0].min() - at, 0.0]) * [1.0, sign]


@singledispatch
def notch_view(notch: Notch, robot: Robot, first: bool, following: Notch | None) -> NotchView:
    """Describe the views of a notch of the robot file, with `repeat`.

    It may be the first one of the robot; the next one toward the tip follows, if there is one.

    Raises:
        InputError: Its kind has no drawing.
    """
    del robot, first, following
    raise InputError.UNSUPPORTED(
        f'there is no dimensioned drawing of notches of kind = "{notch.kind}"; '
        "register one in notchflex.plotting.drawings.notch_views."
    )


class _SideView:
    """A side view that is drawn from the base or the body before toward the tip."""

    def __init__(self, robot: Robot, first: bool) -> None:
        self.diameter, self.held, self.at = robot.tube.outer_diameter, first, 0.0
        self.breaks: list[float] = []
        self.along: list[Dimension] = []
        self.absent: list[str] = []
        if first:
            self.piece(robot.tube.base_length, "base length")
        else:
            self.stub()

    def piece(self, length: float, name: str = "") -> tuple[float, float]:
        """Add a piece, broken if it is too long; return its ends in the drawing."""
        start, most = self.at, LONGEST * self.diameter
        self.at += min(length, most)
        if length > most:
            self.breaks.append(0.5 * (start + self.at))
        if name and length > 0.0:
            self.along.append(Dimension(start, self.at, f"{name} {length:.4g}"))
        elif name:
            self.absent.append(name)
        return start, self.at

    def stub(self) -> None:
        """Add a part of a neighbouring body, broken off at its outer end."""
        start = self.at
        self.at += STUB * self.diameter
        self.breaks.append(start if start == 0.0 else self.at)

    def view(self, **others: Any) -> NotchView:
        """Return the view; `others` are the fields of `NotchView` that are not known here."""
        known: dict[str, Any] = {"length": self.at, "held": self.held, "breaks": self.breaks}
        return NotchView(**known, along=self.along, absent=self.absent, **others)


@notch_view.register
def _arc(notch: ArcNotch, robot: Robot, first: bool, following: Notch | None) -> NotchView:
    """Describe a cut that leaves an arc of the wall (Pacheco 2021, York 2015)."""
    outer, inner = robot.tube.outer_radius, robot.tube.inner_radius
    (window,), _ = notch.cut_layout(robot.tube, None, following)
    corner = window.corners[1][1]
    radial = window.radial
    # A radial cut face is seen from its outer to its inner corner.
    slanted = corner * inner / outer if radial else corner
    line = _SideView(robot, first)
    cuts: list[Cut] = []
    shown = min(notch.repeat, 2)
    for number in range(shown):
        start, end = line.piece(notch.height, "" if number else "height")
        top = max(corner, slanted)
        edge = _drawn(window, start, 1.0, line.diameter)
        edge[:, 1] = np.maximum(edge[:, 1], top)
        # Where the cut ends above the axis, the wall hides its face.
        face = np.array([(start, corner), (end, corner)]) if corner < top else None
        cuts.append(Cut(edge, face))
        if number == 0:
            line.piece(notch.uncut_length, "uncut length")
            if shown == 1 and following is not None:
                line.stub()
    if shown == 2:
        line.stub()
    tip = shown == 1 and following is None
    left = robot.tube.outer_diameter - notch.depth
    return line.view(
        tip=tip,
        cuts=cuts,
        across=[
            [
                Dimension(corner, outer, f"depth\n{notch.depth:.4g}"),
                Dimension(-outer, corner, f"remaining\n{left:.4g}"),
            ]
        ],
        projected=[(float(cuts[-1].edge[0, 0]), corner, 0)],
        section_at=float(cuts[0].edge[[0, -1], 0].mean()),
        section_from=corner,
        radial=radial,
    )


@notch_view.register
def _strip(notch: StripNotch, robot: Robot, first: bool, following: Notch | None) -> NotchView:
    """Describe a pair of triangular notches with the strip between them (Liu 2022)."""
    # The last notch may reach beyond the tip, so the view is broken off there too.
    (below, above), _ = notch.cut_layout(robot.tube, None, following)
    outer = robot.tube.outer_radius
    line = _SideView(robot, first)
    cuts: list[Cut] = []
    vertex = 0.0
    for number in range(min(notch.repeat, 2)):
        start, near = line.piece(notch.height, "" if number else "height")
        _, far = line.piece(notch.strip_thickness, "" if number else "strip thickness")
        cuts.append(Cut(_drawn(below, start, 1.0, line.diameter)))
        cuts.append(Cut(_drawn(above, far, -1.0, line.diameter)))
        vertex = near
        if number == 0:
            line.piece(notch.uncut_length, "uncut length")
    line.at = max(line.at, float(cuts[-1].edge[-1, 0]))
    line.stub()
    corner = notch.depth - outer
    left = robot.tube.outer_diameter - notch.depth
    length, walls = notch.strip_length_in(robot.tube), notch.wall_width_in(robot.tube)
    return line.view(
        tip=False,
        cuts=cuts,
        across=[
            [
                Dimension(-corner, outer, f"depth\n{notch.depth:.4g}"),
                Dimension(-outer, -corner, f"remaining\n{left:.4g}"),
            ],
            [Dimension(-0.5 * length, 0.5 * length, f"strip\nlength\n{length:.4g}")],
        ],
        projected=[(vertex, -corner, 0), (line.at, 0.5 * length, 1), (line.at, -0.5 * length, 1)],
        section_at=float(cuts[1].edge[0, 0]),
        section_from=corner,
        toward=True,
        notes=[f"wall width (both walls together) {walls:.4g}"],
    )


@notch_view.register
def _u_link(notch: ULink, robot: Robot, first: bool, following: Notch | None) -> NotchView:
    """Describe a row of slots with round ends (Gao 2017)."""
    outer, radius, half = robot.tube.outer_radius, notch.slot_radius, 0.5 * notch.strip_length
    slot = notch.cut_layout(robot.tube, None, following).cuts[0]
    line = _SideView(robot, first)
    cuts: list[Cut] = []
    side = -1.0 if notch.proximal_slot == "away" else 1.0
    shown = range(notch.slots) if notch.slots <= 4 else (0, 1, 2, notch.slots - 1)
    # The slot of the section is cut from the side of the bend; its neighbour from the other one.
    centres: dict[float, float] = {}
    for place, number in enumerate(shown):
        if place and number > shown[place - 1] + 1:
            line.stub()
            line.at += STUB * line.diameter
        start, end = line.piece(notch.height, "slot width" if place == 1 else "")
        sign, middle = side * (-1.0) ** number, 0.5 * (start + end)
        cuts.append(Cut(_drawn(slot, start, sign, line.diameter)))
        if place < 3:
            centres[sign] = middle
        if number + 1 in shown:
            line.piece(notch.strip_thickness, "" if place else "strip thickness")
    if not isinstance(following, ULink):
        line.piece(notch.uncut_length, "uncut length")
    if following is not None:
        line.stub()
    section_at = centres[1.0]
    ends = [(section_at, -half), (centres[-1.0], half)]
    corner = slot.corners[1][1]
    depth = outer + half + radius
    return line.view(
        tip=following is None,
        cuts=cuts,
        across=[
            [Dimension(-half, half, f"strip\nlength\n{notch.strip_length:.4g}")],
            [Dimension(corner, outer, f"depth\n{depth:.4g}")],
        ],
        projected=[*((at, height, 0) for at, height in ends), (section_at, corner, 1)],
        section_at=section_at,
        section_from=corner,
        notes=[f"slot radius {radius:.4g}, half the slot width"],
    )
