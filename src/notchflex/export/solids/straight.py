"""The straight tube with its cuts as a closed surface of triangles (manifold3d).

The frame is that of the robot file: z along the tube from the base (0) toward the tip, a cut of
direction 0 open toward +x.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from notchflex.errors import InputError
from notchflex.export.cuts import RobotCuts
from notchflex.export.options import SolidOptions
from notchflex.export.solids.checks import check_channels, check_window
from notchflex.export.tube_ends import TubeEnd
from notchflex.plotting.shapes.prisms import fair_growth, prism, tube_wall
from notchflex.robot import Robot
from notchflex.robot.notches.cut import NotchCut
from notchflex.robot.notches.profile import outline

if TYPE_CHECKING:
    from manifold3d import Manifold

FEWEST_SIDES, MAX_SIDES = 48, 2000
_RADIUS_FACTOR = 2.0
"""How far a cutting solid reaches, in outer radii."""


def sides_of(robot: Robot, chord: float) -> int:
    """Return the number of flat sides of the tube at which they are near enough to round.

    Raises:
        InputError: There would be very many.
    """
    step = math.acos(max(1.0 - 2.0 * chord / robot.tube.outer_radius, 0.0))
    if math.pi > MAX_SIDES * step:
        raise InputError.OUT_OF_RANGE(
            f"chord: with {chord:g} mm the tube would have more than {MAX_SIDES} flat sides; give "
            "a larger chord."
        )
    return max(FEWEST_SIDES, 4 * math.ceil(math.pi / step / 4.0))


def straight_solid(robot: Robot, cuts: RobotCuts, end: TubeEnd, options: SolidOptions) -> Manifold:
    """Return the straight tube without its cuts and channels.

    Its round surfaces are flat sides that lie half inside and half outside, at most `chord` apart,
    so that the volume is that of the round tube.

    Raises:
        InputError: A channel does not fit the wall, or no solid of a cut is known.
    """
    from manifold3d import Manifold, OpType

    sides = sides_of(robot, options.chord)
    solid = tube_wall(robot.tube, (-options.shank, end.at), sides, fair=True)
    removed = [_removed(one.cut, robot, sides, options.chord) for one in cuts.cuts]
    removed += _channels(robot, end, options)
    return solid - Manifold.batch_boolean(removed, OpType.Add)


def _removed(cut: NotchCut, robot: Robot, sides: int, chord: float) -> Manifold:
    """Return what a cut takes away, beyond the surface too."""
    outer = robot.tube.outer_radius
    if cut.radial:
        return _sector(cut, outer, sides)
    points = np.array(outline(cut, chord))[:, ::-1]
    # Beyond the surface the cut is as wide as at the surface.
    low, high = (
        np.array([[_RADIUS_FACTOR * outer, along]]) for along in (points[0, 1], points[-1, 1])
    )
    return prism(
        np.concatenate([low, points, high])[::-1],
        math.radians(cut.side_deg),
        2.0 * _RADIUS_FACTOR * outer,
    )


def _sector(cut: NotchCut, outer: float, sides: int) -> Manifold:
    """Return the sector of a window with radial walls."""
    from manifold3d import CrossSection, FillRule, Manifold

    start, end, half = check_window(cut, outer)
    middle = math.radians(cut.side_deg)
    # Its corners fall between those of the tube, far outside, so that it cuts at its two walls.
    angles = np.linspace(middle - half, middle + half, max(3, sides // 4))
    arc = _RADIUS_FACTOR * outer * np.stack([np.cos(angles), np.sin(angles)], axis=-1)
    section = CrossSection([np.concatenate([np.zeros((1, 2)), arc])], FillRule.NonZero)
    return Manifold.extrude(section, end - start).translate((0.0, 0.0, start))


def _channels(robot: Robot, end: TubeEnd, options: SolidOptions) -> list[Manifold]:
    """Return the channels of the tendons, through the whole tube."""
    from manifold3d import Manifold

    if not options.channels:
        return []
    check_channels(robot, options.channels)
    radius = 0.5 * options.channels
    sides = max(24, math.ceil(math.pi / math.acos(max(1.0 - 2.0 * options.chord / radius, 0.0))))
    length = end.at + options.shank
    channels: list[Manifold] = []
    for tendon in robot.tendon:
        angle = math.radians(tendon.direction_deg)
        x, y = tendon.radius * math.cos(angle), tendon.radius * math.sin(angle)
        drill = Manifold.cylinder(length, fair_growth(sides) * radius, circular_segments=sides)
        channels.append(drill.translate((x, y, -options.shank)))
    return channels
