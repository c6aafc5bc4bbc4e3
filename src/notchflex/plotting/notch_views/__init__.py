"""Views of every kind of notch for a dimensioned drawing: cuts and dimensions.

All lengths are in mm. In the side view the first coordinate runs along the tube toward the tip, the
second across it toward the bend, both from the tube axis at the left end of the view. A new kind
of notch registers its `notch_view` in a file of its own in this folder.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import singledispatch
from typing import NamedTuple

import numpy as np

from notchflex import InputError, Robot
from notchflex._imports import import_all
from notchflex.plotting.marks import Array
from notchflex.support import Notch, NotchCut, outline, with_limits

STUB = 0.35
"""Drawn length of a neighbouring piece, in outer diameters."""
LONGEST = 1.6
"""Longest uncut piece that is not broken, in outer diameters."""
CHORD = 0.0005
"""Largest distance of a drawn arc from the true one, in outer diameters."""


class Dimension(NamedTuple):
    """A dimension: its two ends [mm], and its name with its value."""

    start: float
    end: float
    text: str


@dataclass
class NotchView:
    """Side view, drawn from the base toward the tip, and cross-section of one kind of notch."""

    robot: Robot
    held: bool  # the left end is the proximal face of the robot
    length: float = 0.0  # of tube in the side view [mm]
    tip: bool = False  # the right end is the tip
    breaks: list[float] = field(default_factory=list)  # where a part of the tube is omitted [mm]
    cuts: list[Array] = field(default_factory=list)  # from outer surface to outer surface, (k, 2)
    faces: list[Array] = field(default_factory=list)  # other visible edges, of slanted cut faces
    along: list[Dimension] = field(default_factory=list)
    across: list[list[Dimension]] = field(default_factory=list)  # in columns, from the tube axis
    projected: list[tuple[float, float, int]] = field(default_factory=list)
    """Their extension lines: start, height, column."""
    section_at: float = 0.0  # position of the cross-section [mm]
    section_from: float = 0.0  # height of the edge of the remaining section [mm]
    radial: bool = False  # the edges of the cut are radial (on-axis), not one straight line
    toward: bool = False  # the remaining section lies on the side of the bend
    notes: list[str] = field(default_factory=list)  # further dimensions in words
    absent: list[str] = field(default_factory=list)  # names of dimensions that are 0
    variant: str = ""  # what tells it from others of its kind

    def __post_init__(self) -> None:
        """Begin with the base or a part of the body before."""
        self.diameter = self.robot.tube.outer_diameter
        if self.held:
            self.piece(self.robot.tube.base_length, "base length", "tube")
        else:
            self.stub()

    def sized(self, key: str, length: float, part: str = "notch") -> str:
        """Return a length with the tolerance of a key of the robot file."""
        return with_limits(self.robot.tolerance, f"{part}.{key}", length)

    def piece(self, length: float, name: str = "", part: str = "notch") -> tuple[float, float]:
        """Add a piece, broken if it is too long; return its ends in the drawing."""
        start, most = self.length, LONGEST * self.diameter
        self.length += min(length, most)
        if length > most:
            self.breaks.append(0.5 * (start + self.length))
        if name and length > 0.0:
            text = f"{name} {self.sized(name.replace(' ', '_'), length, part)}"
            self.along.append(Dimension(start, self.length, text))
        elif name:
            self.absent.append(name)
        return start, self.length

    def stub(self) -> None:
        """Add a part of a neighbouring body, broken off at its outer end."""
        start = self.length
        self.length += STUB * self.diameter
        self.breaks.append(self.length if start else 0.0)

    def cut(self, cut: NotchCut, start: float, sign: float = 1.0) -> Array:
        """Add a cut that starts at a place, above or below the axis; return its edge."""
        points = np.array(outline(cut, CHORD * self.diameter))
        self.cuts.append((points - [points[:, 0].min() - start, 0.0]) * [1.0, sign])
        return self.cuts[-1]

    def depth(self, corner: float, depth: float) -> None:
        """Add the dimensions of the depth of a cut to a height, and of what remains below."""
        outer = 0.5 * self.diameter
        above = Dimension(corner, outer, f"depth\n{self.sized('depth', depth)}")
        below = Dimension(-outer, corner, f"remaining\n{self.diameter - depth:.6g}")
        self.across.append([above, below])

    def strip(self, length: float) -> None:
        """Add the dimension of a strip across the tube."""
        text = f"strip\nlength\n{self.sized('strip_length', length)}"
        self.across.append([Dimension(-0.5 * length, 0.5 * length, text)])


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
        "add one to notchflex/plotting/notch_views with @notch_view.register"
    )


import_all(__name__, __path__)
