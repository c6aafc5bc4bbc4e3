"""The solid of a robot as STEP, by build123d: round surfaces are round, radial walls plane.

Straight it is exact. Bent, the spine of each notch is a smooth surface through its sections.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from importlib import import_module
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np

from notchflex import InputError, Robot, __version__
from notchflex.export.cuts import RobotCuts, cuts_of
from notchflex.export.flat.drawing import plain_name
from notchflex.export.formats import Document, SolidOptions, Subject
from notchflex.export.solids.straight import (
    DeformationMap,
    channel_radius,
    check_one_piece,
    is_bent,
    sector,
)
from notchflex.support import Line, NotchCut, pieces, robot_digest

_RADIUS_FACTOR = 2.0
"""How far a cutting solid reaches, in outer radii."""
_SECTIONS = 9
"""Sections of a bent spine."""
_STAMP = "2000-01-01T00:00:00"
"""Instead of the time of writing: the same robot gives the same file."""


def step_solid(subject: Subject, options: SolidOptions) -> Document:
    """Make the solid of a robot as STEP, straight as it is cut or bent as its state is.

    Raises:
        InputError: See `straight_solid`; or a strip across the tube is bent, which only STL has.
    """
    robot = subject.robot
    bent = is_bent(subject, options.polishing)
    if bent:
        _check_spines(robot)
    cuts = cuts_of(robot, options.shank, options.polishing)
    solid = _straight(robot, cuts, options)
    check_one_piece(len(solid.solids()))
    solid = _bent(solid, subject, cuts) if bent else solid.solids()[0]
    digest, box = robot_digest(robot), solid.bounding_box()
    solid.label = f"{plain_name(robot)}; notchflex {__version__}, robot {digest}"
    facts = {
        "robot_hash": digest,
        "volume_mm3": float(solid.volume),
        "surface_mm2": float(solid.area),
        "faces": len(solid.faces()),
        "box_mm": [list(box.min), list(box.max)],
    }
    return Document(solid, cuts.warnings, facts, _save)


def _save(solid: Any, file: Path) -> None:
    # Older versions of build123d return False for what newer ones raise; neither says why.
    try:
        written = import_module("build123d").export_step(solid, file, timestamp=_STAMP)
    except RuntimeError:
        written = False
    if not written:
        raise OSError("build123d could not write it; is there room on the disk?")


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


def _straight(robot: Robot, cuts: RobotCuts, options: SolidOptions) -> Any:
    """Return the straight tube without cuts and channels."""
    cad = import_module("build123d")
    base, tube = cad.Plane((0.0, 0.0, cuts.start)), cuts.tube
    length = cuts.end - cuts.start
    outer, inner = (
        cad.Solid.make_cylinder(radius, length, base)
        for radius in (tube.outer_radius, tube.inner_radius)
    )
    removed = [inner, *(_removed(one.cut, tube.outer_radius) for one in cuts.cuts)]
    if drill := channel_radius(robot, options):
        for tendon in robot.tendon:
            angle = math.radians(tendon.direction_deg)
            x, y = tendon.radius * math.cos(angle), tendon.radius * math.sin(angle)
            plane = cad.Plane((x, y, cuts.start))
            removed.append(cad.Solid.make_cylinder(drill, length, plane))
    return outer.cut(*removed)


def _removed(cut: NotchCut, outer: float) -> Any:
    """Return what a cut takes away, beyond the surface too."""
    cad = import_module("build123d")
    view = math.radians(cut.side_deg)
    across = np.array([math.cos(view), math.sin(view), 0.0])
    if cut.radial:
        start, end, points = sector(cut, outer, 9)
        face = cad.Face(cad.Wire.make_polygon([(x, y, start) for x, y in points]))
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
            through = [place(piece.point(part)) for part in (0.0, 0.5, 1.0)]
            edges.append(cad.Edge.make_three_point_arc(*through))
    # Beyond the surface the cut is as wide as at the surface.
    around = [last, (last[0], top), (first[0], top), first]
    for one, two in pairwise(around):
        if math.dist(one, two) > 0.0:
            edges.append(cad.Edge.make_line(place(one), place(two)))
    face = cad.Face(cad.Wire(edges))
    return cad.Solid.extrude(face, tuple(2.0 * depth * out))


def _bent(straight: Any, subject: Subject, cuts: RobotCuts) -> Any:
    """Return rings at their poses, joined by spines through their bent sections.

    Raises:
        InputError: A spine's section has a hole.
    """
    cad = import_module("build123d")
    motion = DeformationMap(subject, cuts)
    at = [cuts.start, *(z for one in cuts.cuts for z in (one.start, one.end)), cuts.end]
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
