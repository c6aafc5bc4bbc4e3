"""Views of one kind of notch for a dimensioned drawing: cuts and dimensions.

All lengths are in mm. In the side view the first coordinate runs along the tube toward the tip, the
second across it toward the bend, both from the tube axis at the left end of the view. A new kind
of notch registers its `notch_view` in a file of its own in this folder.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import singledispatch
from typing import Any

import numpy as np
from numpy.typing import NDArray

from notchflex import InputError, Robot
from notchflex.support import Notch, NotchCut, outline, with_limits

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
    variant: str = ""  # what tells it from others of its kind


def drawn(cut: NotchCut, at: float, sign: float, diameter: float) -> Points:
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
        "add one to notchflex/plotting/drawings/notch_views with @notch_view.register"
    )


class SideView:
    """A side view that is drawn from the base or the body before toward the tip."""

    def __init__(self, robot: Robot, first: bool) -> None:
        self.robot = robot
        self.diameter, self.held, self.at = robot.tube.outer_diameter, first, 0.0
        self.breaks: list[float] = []
        self.along: list[Dimension] = []
        self.absent: list[str] = []
        if first:
            self.piece(robot.tube.base_length, "base length", "tube")
        else:
            self.stub()

    def sized(self, key: str, length: float, part: str = "notch") -> str:
        """Return a length with the tolerance of a key of the robot file."""
        return with_limits(self.robot.tolerance, f"{part}.{key}", length)

    def piece(self, length: float, name: str = "", part: str = "notch") -> tuple[float, float]:
        """Add a piece, broken if it is too long; return its ends in the drawing."""
        start, most = self.at, LONGEST * self.diameter
        self.at += min(length, most)
        if length > most:
            self.breaks.append(0.5 * (start + self.at))
        if name and length > 0.0:
            text = self.sized(name.replace(" ", "_"), length, part)
            self.along.append(Dimension(start, self.at, f"{name} {text}"))
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
