"""All cuts of a robot along the tube that they are cut into, and where tendons pass its edges.

Polishing takes a layer from every surface of the tube afterwards. The tube and its cuts are then
those before it, so that what is left has the dimensions of the robot: the walls are thicker, and
the cuts narrower and less deep.
"""

from __future__ import annotations

import math
from collections.abc import Generator, Iterator
from contextlib import contextmanager
from itertools import accumulate, pairwise
from string import ascii_lowercase
from typing import NamedTuple

import numpy as np
from jaxtyping import Float

from notchflex import InputError, Robot, RodGap, Tube
from notchflex.support import NotchCut, shrunk


class PlacedCut(NamedTuple):
    """A cut at its place on the tube.

    Attributes:
        notch: Number of the notch that it belongs to, from 1 at the base.
        name: That number, with a letter where the notch has several cuts.
        cut: The cut; its corners are measured from the base along the tube [mm].
        outer: Outer radius of the tube that it is cut into [mm].
    """

    notch: int
    name: str
    cut: NotchCut
    outer: float

    @property
    def start(self) -> float:
        """Its proximal end along the tube [mm]."""
        return min(self.cut.corners)[0]

    @property
    def end(self) -> float:
        """Its distal end along the tube [mm]."""
        return max(self.cut.corners)[0]


class Ring(NamedTuple):
    """A ring about the tube axis: a length of tube, a backbone, what joins it to a disk [mm]."""

    low: float
    high: float
    outer: float
    inner: float


class RobotCuts(NamedTuple):
    """A tube and what is cut out of it.

    Attributes:
        tube: The tube that is cut, of several the first.
        cuts: Every cut, base to tip as the notches stand.
        start: Where the tube is cut off on the base side, from the base [mm]; negative.
        end: Where it ends [mm].
        warnings: A sentence where that is not the tip of the robot file.
        walls: The lengths of tube that are cut, base to tip.
        rings: What is added to them without their cuts: backbones, which the disks hold, and
            sleeves for notches that are known by numbers.
    """

    tube: Tube
    cuts: tuple[PlacedCut, ...]
    start: float
    end: float
    warnings: tuple[str, ...]
    walls: tuple[Ring, ...]
    rings: tuple[Ring, ...]


def cuts_of(robot: Robot, shank: float = 0.0, polishing: float = 0.0) -> RobotCuts:
    """Return every cut of a robot in its straight tube, or tubes.

    Args:
        robot: The robot, as it is after polishing.
        shank: Uncut tube on the base side [mm].
        polishing: Thickness that polishing takes from every surface [mm].

    Raises:
        InputError: A kind of notch does not know its cuts, or polishing fills a cut or the bore.

    Example:
        >>> from notchflex import load_robot
        >>> cuts = cuts_of(load_robot("pacheco2021-a"))
        >>> len(cuts.cuts), round(cuts.cuts[-1].start, 9), round(cuts.end, 9)
        (5, 8.0, 10.0)
    """
    tube, layouts, warnings = robot.tube, robot.geometry.cuts, ()
    with naming("the tube before polishing"):
        stock = Tube(tube.outer_diameter + 2.0 * polishing, tube.inner_diameter - 2.0 * polishing)
    cuts = [
        PlacedCut(number, f"{number}{letter if len(layout.cuts) > 1 else ''}", cut, of.outer_radius)
        for number, (layout, of) in enumerate(zip(layouts, robot.tubes[1:], strict=True), start=1)
        for letter, cut in zip(ascii_lowercase, layout.cuts, strict=False)
    ]
    *starts, end = accumulate((layout.length for layout in layouts), initial=tube.base_length)
    last, wall = max(cut.end for cut in cuts), tube.outer_radius - tube.inner_radius
    last_notch = robot.notches[-1]
    on_backbone = last_notch.is_round or not last_notch.is_cut  # its body may have no length
    if end <= last and not on_backbone:
        warnings = (
            f"the last cut ends at {last:.6g} mm and the robot file at {end:.6g} mm, which leaves "
            f"no ring at the tip; a ring of the thickness of the wall, {wall:.6g} mm, was added "
            "beyond the cut. Give the last notch an `uncut_length` to set it.",
        )
        end = last + wall
    rings = tuple(_rings(robot, cuts, -shank, end))
    if polishing and rings:
        raise InputError.UNSUPPORTED(
            "polishing: a robot of disks on a backbone is not cut from a tube; leave polishing out."
        )
    if polishing:
        cuts = [_unpolished(cut, tube, stock, polishing) for cut in cuts]
    low, high = -shank - polishing, end + polishing
    tubes = robot.tubes if len(set(robot.tubes)) > 1 else (stock,)
    walls = [
        Ring(start, stop, one.outer_radius, one.inner_radius)
        for one, (start, stop) in zip(
            tubes, pairwise([low, *starts[: len(tubes) - 1], high]), strict=True
        )
        if start < stop
    ]
    return RobotCuts(stock, tuple(cuts), low, high, warnings, tuple(walls), rings)


def _rings(robot: Robot, cuts: list[PlacedCut], low: float, high: float) -> Iterator[Ring]:
    """Yield every backbone through its gap and the bodies beside it, and what fills their holes."""
    for placed in cuts:
        notch, tube = robot.notches[placed.notch - 1], robot.tubes[placed.notch]
        start, end, reach = placed.start, placed.end, 0.5 * (tube.outer_radius + tube.inner_radius)
        if not notch.is_cut:
            yield Ring(start, end, tube.outer_radius, tube.inner_radius)
        if isinstance(notch, RodGap):
            begin = max((cut.end for cut in cuts if cut.end <= start), default=low)
            stop = min((cut.start for cut in cuts if cut.start >= end), default=high)
            outer, inner = 0.5 * notch.diameter, 0.5 * notch.inner_diameter
            rings = Ring(begin, stop, outer, inner), Ring(begin, start, reach, inner)
            yield from (
                ring for ring in (*rings, Ring(end, stop, reach, inner)) if ring.low < ring.high
            )


def check_one_tube(robot: Robot) -> None:
    """Refuse a robot that is made of several tubes or materials, or whose cuts are not known."""
    for number, notch in enumerate(robot.notches, start=1):
        if not notch.is_cut:
            raise InputError.UNSUPPORTED(
                f'notch {number} is of kind = "{notch.kind}", whose cuts are not known, so nothing '
                "can be made of it; describe it by a kind that is cut, such as "
                '"arc", or view the robot.'
            )
    if len({*robot.tubes, *robot.materials}) > 2:
        raise InputError.UNSUPPORTED(
            f"{robot.name} is made of several tubes or materials, and this file is of one piece; "
            "export a robot file for each of them."
        )


@contextmanager
def naming(what: str) -> Generator[None]:
    """Put what is made before what is wrong with it."""
    try:
        yield
    except InputError as problem:
        raise InputError(f"{what}: {problem}", problem.code) from None


def angle_at(height: float, radius: float) -> float:
    """Return the angle from the side of a cut at which a surface has a height [rad]."""
    return math.acos(min(1.0, max(-1.0, height / radius)))


def _unpolished(placed: PlacedCut, tube: Tube, stock: Tube, polishing: float) -> PlacedCut:
    """Return a cut before polishing, which moves its walls into the material.

    A radial wall is then no longer radial: in the middle of the wall it lies where the robot has
    it, which keeps the area of the section.
    """
    cut, top, inside = placed.cut, stock.outer_radius, (polishing, polishing)
    with naming(f"the cut of notch {placed.notch}"):
        if cut.radial:
            middle = 0.5 * (tube.outer_radius + tube.inner_radius)
            profile = [(x, -middle * angle_at(y, tube.outer_radius)) for x, y in cut.corners]
            corners = [(x, top * math.cos(y / middle)) for x, y in shrunk(profile, inside, 0.0)]
        else:
            corners = shrunk(cut.corners, inside, top)
    radii = tuple(max(radius - polishing, 0.0) for radius in cut.radii)
    return placed._replace(cut=cut._replace(corners=tuple(corners), radii=radii), outer=top)


class Hole(NamedTuple):
    """A point that a tendon is led through.

    Attributes:
        body: The body it is fixed to, 0 the base.
        place: Its place in the frame of that body, mm.
    """

    body: int
    place: Float[np.ndarray, " 3"]


def tendon_holes(robot: Robot, number: int) -> list[Hole]:
    """Return the points that a tendon (counted from 0) runs through, base to tip."""
    tendon, placed = robot.tendon[number], robot.geometry.holes
    last, side = tendon.end_body or robot.number_of_notches, np.radians(tendon.direction_deg)
    holes: list[Hole] = []
    walls = robot.geometry.walls(tendon.direction_deg, tendon.radius)
    for body, (start, end) in ((body, wall) for body, wall in enumerate(walls[: last + 1]) if wall):
        # Nothing leads it through a base without length; it ends at the first edge of its body.
        passes = end > 0.0 if body == 0 else body < last
        for edge, along in enumerate((start, end) if passes else (start,)):
            place = tendon.radius * np.array([np.cos(side), np.sin(side)])
            if placed is not None:
                place = (placed.enters, placed.leaves)[edge][body, number, :2]
            holes.append(Hole(body, np.array([*place, along])))
    return holes
