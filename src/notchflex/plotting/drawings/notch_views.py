"""Views of one kind of notch for a dimensioned drawing: what is cut away, and what is measured.

All lengths are in mm. In the side view the first coordinate runs along the tube toward the tip, the
second across it toward the bend, both from the tube axis at the left end of the view. A new kind
of notch registers its own `notch_view`.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import singledispatch

import numpy as np
from numpy.typing import NDArray

from notchflex.errors import InputError
from notchflex.robot import ArcNotch, Robot, StripNotch, ULink
from notchflex.robot.kinds import Notch

Points = NDArray[np.float64]

STUB = 0.35
"""Length of a neighbouring piece that is only begun, in outer diameters."""
LONGEST = 1.6
"""Longest uncut piece that is drawn in full, in outer diameters; a longer one is broken."""


@dataclass(frozen=True)
class Dimension:
    """One measured length: from where to where it goes [mm], and its name with its value."""

    start: float
    end: float
    text: str


@dataclass(frozen=True)
class Cut:
    """One cut in the side view: its edge from surface to surface, (k, 2).

    Attributes:
        edge: Corners of the edge, the first and last on the outer surface.
        face: Height of a second visible edge below the first, such as that of a slanted cut face,
            as two ends, (2, 2); None where there is none.
    """

    edge: Points
    face: Points | None = None


@dataclass(frozen=True)
class NotchView:
    """Side view and cross-section of one kind of notch.

    Attributes:
        length: Length of tube that the side view shows [mm].
        held: Whether the left end is the proximal face of the robot.
        tip: Whether the right end is the tip.
        breaks: Where the view leaves out a part of the tube [mm].
        cuts: What is cut away.
        along: Lengths along the tube.
        across: Columns of lengths across the tube; each is measured from the tube axis.
        projected: Extension lines of those: where each begins, its height [mm], its column.
        section_at: Where the cross-section is taken [mm].
        section_from: Up to which height the cross-section is left [mm], from the tube axis.
        radial: Whether the edges of the cut are radial (on-axis) or one straight line.
        toward: Whether what is left lies on the side of the bend; else opposite.
        notes: What else is measured, in words.
        absent: Lengths that are 0, so that the side view does not show them.
    """

    length: float
    held: bool
    tip: bool
    breaks: Sequence[float]
    cuts: Sequence[Cut]
    along: Sequence[Dimension]
    across: Sequence[Sequence[Dimension]]
    projected: Sequence[tuple[float, float, int]]
    section_at: float
    section_from: float
    radial: bool = False
    toward: bool = False
    notes: Sequence[str] = field(default_factory=tuple[str, ...])
    absent: Sequence[str] = field(default_factory=tuple[str, ...])


@singledispatch
def notch_view(notch: Notch, robot: Robot, first: bool, following: Notch | None) -> NotchView:
    """Describe the views of a notch.

    Args:
        notch: The notch as the robot file has it, with `repeat`.
        robot: The robot that it belongs to.
        first: Whether it is the first of the robot.
        following: The next notch toward the tip; None behind the last one.

    Returns:
        Its side view and cross-section.

    Raises:
        InputError: There is no drawing of its kind.
    """
    del robot, first, following
    raise InputError.UNSUPPORTED(
        f'there is no dimensioned drawing of notches of kind = "{notch.kind}"; '
        "register one in notchflex.plotting.drawings.notch_views."
    )


@dataclass
class _Line:
    """A side view that grows toward the tip."""

    diameter: float
    at: float = 0.0
    breaks: list[float] = field(default_factory=list[float])
    along: list[Dimension] = field(default_factory=list[Dimension])
    absent: list[str] = field(default_factory=list[str])

    def piece(self, length: float, name: str = "") -> tuple[float, float]:
        """Add a piece; one that is too long is broken. Return from where to where it is drawn."""
        start, most = self.at, LONGEST * self.diameter
        self.at += min(length, most)
        if length > most:
            self.breaks.append(0.5 * (start + self.at))
        if name and length > 0.0:
            self.along.append(Dimension(start, self.at, f"{name} {length:.4g}"))
        elif name:
            self.absent.append(name)
        return start, self.at

    def begin(self, robot: Robot, first: bool) -> None:
        """Begin with the base, or with a part of the body before."""
        if first:
            self.piece(robot.tube.base_length, "base length")
        else:
            self.stub()

    def stub(self) -> None:
        """Add a part of a neighbouring body, broken off at its outer end."""
        start = self.at
        self.at += STUB * self.diameter
        self.breaks.append(start if start == 0.0 else self.at)


@notch_view.register
def _arc(notch: ArcNotch, robot: Robot, first: bool, following: Notch | None) -> NotchView:
    """Describe a cut that leaves an arc of the wall (Pacheco 2021, York 2015)."""
    outer, inner = robot.tube.outer_radius, robot.tube.inner_radius
    corner = outer - notch.depth
    radial = notch.cut == "on-axis"
    # A radial cut face is seen from its outer to its inner corner.
    slanted = corner * inner / outer if radial else corner
    line = _Line(robot.tube.outer_diameter)
    line.begin(robot, first)
    cuts: list[Cut] = []
    shown = min(notch.repeat, 2)
    for number in range(shown):
        start, end = line.piece(notch.height, "" if number else "height")
        top = max(corner, slanted)
        edge = np.array([(start, outer), (start, top), (end, top), (end, outer)])
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
    return NotchView(
        length=line.at,
        held=first,
        tip=tip,
        breaks=line.breaks,
        cuts=cuts,
        along=line.along,
        absent=line.absent,
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
    del (
        following
    )  # the last notch may reach beyond the tip, so that the view is broken off there too
    outer = robot.tube.outer_radius
    line = _Line(robot.tube.outer_diameter)
    line.begin(robot, first)
    cuts: list[Cut] = []
    vertex = 0.0
    for number in range(min(notch.repeat, 2)):
        start, near = line.piece(notch.height, "" if number else "height")
        _, far = line.piece(notch.strip_thickness, "" if number else "strip thickness")
        upper = [(start, outer), (near, outer - notch.depth), (near, outer)]
        lower = [(far, -outer), (far, notch.depth - outer), (far + notch.height, -outer)]
        cuts += [Cut(np.array(upper)), Cut(np.array(lower))]
        vertex = near
        if number == 0:
            line.piece(notch.uncut_length, "uncut length")
    line.at = max(line.at, float(cuts[-1].edge[-1, 0]))
    line.stub()
    corner = notch.depth - outer
    left = robot.tube.outer_diameter - notch.depth
    length, walls = notch.strip_length_in(robot.tube), notch.wall_width_in(robot.tube)
    return NotchView(
        length=line.at,
        held=first,
        tip=False,
        breaks=line.breaks,
        cuts=cuts,
        along=line.along,
        absent=line.absent,
        across=[
            [
                Dimension(-corner, outer, f"depth\n{notch.depth:.4g}"),
                Dimension(-outer, -corner, f"remaining\n{left:.4g}"),
            ],
            [Dimension(-0.5 * length, 0.5 * length, f"strip\nlength\n{length:.4g}")],
        ],
        projected=[
            (vertex, -corner, 0),
            (line.at, 0.5 * length, 1),
            (line.at, -0.5 * length, 1),
        ],
        section_at=float(cuts[1].edge[0, 0]),
        section_from=corner,
        toward=True,
        notes=[f"wall width (both walls together) {walls:.4g}"],
    )


@notch_view.register
def _u_link(notch: ULink, robot: Robot, first: bool, following: Notch | None) -> NotchView:
    """Describe a row of slots with round ends (Gao 2017)."""
    outer, radius, half = robot.tube.outer_radius, notch.slot_radius, 0.5 * notch.strip_length
    line = _Line(robot.tube.outer_diameter)
    line.begin(robot, first)
    cuts: list[Cut] = []
    side = -1.0 if notch.proximal_slot == "away" else 1.0
    shown = range(notch.slots) if notch.slots <= 4 else (0, 1, 2, notch.slots - 1)
    # The slot of the section is cut from the side of the bend; its neighbour from the other one.
    centres: dict[float, float] = {}
    around = np.linspace(0.0, math.pi, 25)
    for place, number in enumerate(shown):
        if place and number > shown[place - 1] + 1:
            line.stub()
            line.at += STUB * line.diameter
        start, end = line.piece(notch.height, "slot width" if place == 1 else "")
        sign, middle = side * (-1.0) ** number, 0.5 * (start + end)
        arc = [(middle - radius * np.cos(t), sign * (-half - radius * np.sin(t))) for t in around]
        cuts.append(Cut(np.array([(start, sign * outer), *arc, (end, sign * outer)])))
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
    corner = -half - radius
    depth = outer + half + radius
    return NotchView(
        length=line.at,
        held=first,
        tip=following is None,
        breaks=line.breaks,
        cuts=cuts,
        along=line.along,
        absent=line.absent,
        across=[
            [Dimension(-half, half, f"strip\nlength\n{notch.strip_length:.4g}")],
            [Dimension(corner, outer, f"depth\n{depth:.4g}")],
        ],
        projected=[*((at, height, 0) for at, height in ends), (section_at, corner, 1)],
        section_at=section_at,
        section_from=corner,
        notes=[f"slot radius {radius:.4g}, half the slot width"],
    )
