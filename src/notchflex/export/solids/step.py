"""The solid of a robot as STEP, by build123d: round surfaces are round, radial walls plane.

Straight it is exact. Bent, the spine of each notch is a smooth surface through its sections.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from importlib import import_module
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np

from notchflex import __version__
from notchflex.errors import InputError
from notchflex.export.cuts import RobotCuts, cuts_of
from notchflex.export.document import Subject
from notchflex.export.flat.title import plain_name
from notchflex.export.options import SolidOptions
from notchflex.export.solids.bent import DeformationMap, is_bent
from notchflex.export.solids.checks import check_channels, check_one_piece, check_window
from notchflex.export.tube_ends import TubeEnd, tube_end
from notchflex.results.same_robot import robot_digest
from notchflex.robot import Robot
from notchflex.robot.notches.cut import NotchCut
from notchflex.robot.notches.profile import Line, pieces

_RADIUS_FACTOR = 2.0
"""How far a cutting solid reaches, in outer radii."""
_SECTIONS = 9
"""Sections of a bent spine."""
_STAMP = "2000-01-01T00:00:00"
"""Instead of the time of writing: the same robot gives the same file."""


@dataclass(frozen=True)
class StepSolid:
    """A solid of build123d."""

    robot: Robot
    solid: Any
    warnings: tuple[str, ...]

    @property
    def facts(self) -> dict[str, Any]:
        """Numbers about the solid."""
        box = self.solid.bounding_box()
        return {
            "robot_hash": robot_digest(self.robot),
            "volume_mm3": float(self.solid.volume),
            "surface_mm2": float(self.solid.area),
            "faces": len(self.solid.faces()),
            "box_mm": [list(box.min), list(box.max)],
        }

    def save(self, file: Path) -> None:
        """Write it."""
        cad = import_module("build123d")
        digest = robot_digest(self.robot)
        self.solid.label = f"{plain_name(self.robot)}; notchflex {__version__}, robot {digest}"
        if not cad.export_step(self.solid, file, timestamp=_STAMP):
            raise OSError(f"build123d could not write {file}")


def step_solid(subject: Subject, options: SolidOptions) -> StepSolid:
    """Make the solid of a robot as STEP, straight as it is cut or bent as its state is.

    Raises:
        InputError: See `straight_solid`; or a strip across the tube is bent, which only STL has.
    """
    robot = subject.robot
    bent = is_bent(subject)
    if bent:
        _check_spines(robot)
    cuts = cuts_of(robot)
    end = tube_end(robot, cuts)
    solid = _straight(robot, cuts, end, options)
    check_one_piece(len(solid.solids()))
    solid = _bent(solid, subject, cuts, end, options) if bent else solid.solids()[0]
    return StepSolid(robot, solid, (end.warning,) if end.warning else ())


def _check_spines(robot: Robot) -> None:
    """Raise if a notch has no spine along the tube.

    Raises:
        InputError: A strip would be bent.
    """
    others = [number for number, one in enumerate(robot.notches, 1) if one.spine_cut is None]
    if others:
        raise InputError.UNSUPPORTED(
            f"a STEP file of a bent robot needs notches with a spine; notch {others[0]} bends a "
            "strip across the tube. Write an STL file, or the STEP file of the straight robot."
        )


def _straight(robot: Robot, cuts: RobotCuts, end: TubeEnd, options: SolidOptions) -> Any:
    """Return the straight tube without cuts and channels."""
    cad = import_module("build123d")
    base = cad.Plane((0.0, 0.0, -options.shank))
    length = end.at + options.shank
    outer, inner = (
        cad.Solid.make_cylinder(radius, length, base)
        for radius in (robot.tube.outer_radius, robot.tube.inner_radius)
    )
    removed = [inner, *(_removed(one.cut, robot.tube.outer_radius) for one in cuts.cuts)]
    if options.channels:
        check_channels(robot, options.channels)
        for tendon in robot.tendon:
            angle = math.radians(tendon.direction_deg)
            x, y = tendon.radius * math.cos(angle), tendon.radius * math.sin(angle)
            plane = cad.Plane((x, y, -options.shank))
            removed.append(cad.Solid.make_cylinder(0.5 * options.channels, length, plane))
    return outer.cut(*removed)


def _removed(cut: NotchCut, outer: float) -> Any:
    """Return what a cut takes away, beyond the surface too."""
    cad = import_module("build123d")
    view = math.radians(cut.side_deg)
    across = np.array([math.cos(view), math.sin(view), 0.0])
    if cut.radial:
        start, end, half = check_window(cut, outer)
        angles = np.linspace(view - half, view + half, 9)
        arc = 2.0 * _RADIUS_FACTOR * outer * np.stack([np.cos(angles), np.sin(angles)], axis=-1)
        corners = [(0.0, 0.0, start), *((x, y, start) for x, y in arc)]
        face = cad.Face(cad.Wire.make_polygon(corners))
        return cad.Solid.extrude(face, (0.0, 0.0, end - start))
    out = np.cross([0.0, 0.0, 1.0], across)
    depth = 2.0 * outer

    def place(point: tuple[float, float]) -> tuple[float, ...]:
        along, height = point
        return tuple(height * across + [0.0, 0.0, along] - depth * out)

    top = _RADIUS_FACTOR * outer
    first, last = cut.corners[0], cut.corners[-1]
    edges: list[Any] = []
    for piece in pieces(cut.corners, cut.radii):
        if isinstance(piece, Line):
            edges.append(cad.Edge.make_line(place(piece.start), place(piece.end)))
        else:
            through = [place(piece.at(part)) for part in (0.0, 0.5, 1.0)]
            edges.append(cad.Edge.make_three_point_arc(*through))
    # Beyond the surface the cut is as wide as at the surface.
    around = [last, (last[0], top), (first[0], top), first]
    for one, two in pairwise(around):
        if math.dist(one, two) > 0.0:
            edges.append(cad.Edge.make_line(place(one), place(two)))
    face = cad.Face(cad.Wire(edges))
    return cad.Solid.extrude(face, tuple(2.0 * depth * out))


def _bent(
    straight: Any, subject: Subject, cuts: RobotCuts, end: TubeEnd, options: SolidOptions
) -> Any:
    """Return rings at their poses, joined by spines through their bent sections.

    Raises:
        InputError: A spine's section has a hole.
    """
    cad = import_module("build123d")
    motion = DeformationMap(subject, cuts)
    at = [-options.shank, *(z for one in cuts.cuts for z in (one.start, one.end)), end.at]
    parts: list[Any] = []
    for number, (low, high) in enumerate(pairwise(at)):
        if high - low <= 0.0:
            continue
        piece = _slab(straight, low, high, subject.robot.tube.outer_radius)
        if number % 2 == 0:
            parts.append(piece.moved(_location(*motion.of_body(number // 2))))
        else:
            parts.append(_spine(piece, motion.zones[number // 2], low, high))
    whole = parts[0].fuse(*parts[1:])
    solids = whole.solids()
    return solids[0] if len(solids) == 1 else cad.Compound(solids)


def _slab(straight: Any, low: float, high: float, outer: float) -> Any:
    """Return the part of the straight solid between two heights."""
    cad = import_module("build123d")
    disc = cad.Solid.make_cylinder(_RADIUS_FACTOR * outer, high - low, cad.Plane((0.0, 0.0, low)))
    parts = [solid for part in straight.solids() for solid in part.intersect(disc).solids()]
    check_one_piece(len(parts))
    return parts[0]


def _spine(piece: Any, zone: Any, low: float, high: float) -> Any:
    """Return a spine through its sections, each that of the straight one at its pose."""
    cad = import_module("build123d")
    faces = piece.faces().sort_by(cad.Axis.Z)
    if len(faces[0].inner_wires()):
        raise InputError.UNSUPPORTED(
            "a STEP file of a bent robot needs spines without holes; leave channels out, or write "
            "an STL file."
        )
    section = faces[0].outer_wire()
    wires = []
    for height in np.linspace(low, high, _SECTIONS):
        turn, move = zone.pose_at(height)
        lifted = move + turn @ np.array([0.0, 0.0, height - low])
        wires.append(section.moved(_location(turn, lifted)))
    return cad.Solid.make_loft(wires)


def _location(turn: Any, move: Sequence[float] | Any) -> Any:
    """Return a rotation and the displacement after it as a location of build123d."""
    cad = import_module("build123d")
    turn = np.asarray(turn)
    return cad.Plane(tuple(move), x_dir=tuple(turn[:, 0]), z_dir=tuple(turn[:, 2])).location
