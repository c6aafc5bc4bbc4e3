"""The solid of a robot as STEP, by build123d: round surfaces are round, radial walls plane.

Straight it is exact. Bent, the spine of each notch is a smooth surface through its sections.
"""

from __future__ import annotations

import math
from importlib import import_module
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np

from notchflex import InputError, __version__
from notchflex.export.cuts import RobotCuts, check_one_tube, cuts_of
from notchflex.export.formats import Document, SolidOptions, Subject, plain_name
from notchflex.export.solids import (
    REACH,
    DeformationMap,
    Zone,
    channels,
    check_one_piece,
    is_bent,
    sector,
)
from notchflex.support import Line, NotchCut, Point, pieces, robot_digest

_SECTIONS = 9
"""Sections of a bent spine, of those of the model."""
_STAMP = "2000-01-01T00:00:00"
"""Instead of the time of writing: the same robot gives the same file."""


def step_solid(subject: Subject, options: SolidOptions) -> Document:
    """Make the solid of a robot as STEP, straight as it is cut or bent as its state is.

    Raises:
        InputError: See `straight_solid`; or a strip across the tube is bent, which only STL has.
    """
    robot, bent = subject.robot, is_bent(subject, options.polishing)
    has_spine = robot.geometry.has_spine
    if bent and not has_spine.all():
        raise InputError.UNSUPPORTED(
            "a STEP file of a bent robot needs notches with a spine; notch "
            f"{has_spine.argmin() + 1} bends a strip across the tube. Write an STL file, or the "
            "STEP file of the straight robot."
        )
    check_one_tube(robot)
    cuts = cuts_of(robot, options.shank, options.polishing)
    tube, ends, (drill, places) = cuts.tube, (cuts.start, cuts.end), channels(robot, options)
    removed = [_cylinder(tube.inner_radius, *ends)]
    removed += [_removed(placed.cut, tube.outer_radius) for placed in cuts.cuts]
    removed += [_cylinder(drill, *ends, place) for place in places]
    solid = _cylinder(tube.outer_radius, *ends).cut(*removed)
    for low, high, outer, inner in cuts.rings:
        ring = _cylinder(outer, low, high)
        solid = solid.fuse(ring.cut(_cylinder(inner, low, high)) if inner else ring)
    check_one_piece(len(solid.solids()))
    solid = _bent(solid, DeformationMap(subject, cuts), cuts) if bent else solid.solids()[0]
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


def _cylinder(radius: float, low: float, high: float, place: Point = (0.0, 0.0)) -> Any:
    """Return a cylinder along z, between two heights."""
    cad = import_module("build123d")
    return cad.Solid.make_cylinder(radius, high - low, cad.Plane((*place, low)))


def _removed(cut: NotchCut, outer: float) -> Any:
    """Return what a cut takes away, beyond the surface too."""
    cad = import_module("build123d")
    if cut.radial:
        start, end, points = sector(cut, outer, 9)
        face = cad.Face(cad.Wire.make_polygon([(x, y, start) for x, y in points]))
        return cad.Solid.extrude(face, (0.0, 0.0, end - start))
    view, top = math.radians(cut.side_deg), REACH * outer
    across = np.array([math.cos(view), math.sin(view), 0.0])
    out = top * np.cross([0.0, 0.0, 1.0], across)

    def place(point: Point) -> tuple[float, ...]:
        along, height = point
        return tuple(height * across + [0.0, 0.0, along] - out)

    # Beyond the surface the cut is as wide as at the surface.
    first, last = cut.corners[0], cut.corners[-1]
    around = pairwise([last, (last[0], top), (first[0], top), first])
    lines = [Line(*ends) for ends in around if math.dist(*ends) > 0.0]
    edges = [
        cad.Edge.make_line(*map(place, piece))
        if isinstance(piece, Line)
        else cad.Edge.make_three_point_arc(*(place(piece.point(x)) for x in (0.0, 0.5, 1.0)))
        for piece in [*pieces(cut.corners, cut.radii), *lines]
    ]
    return cad.Solid.extrude(cad.Face(cad.Wire(edges)), tuple(2.0 * out))


def _bent(straight: Any, motion: DeformationMap, cuts: RobotCuts) -> Any:
    """Return rings at their poses, joined by spines through their bent sections.

    Raises:
        InputError: A spine's section has a hole.
    """
    cad = import_module("build123d")
    edges = [edge for placed in cuts.cuts for edge in (placed.start, placed.end)]
    parts: list[Any] = []
    for number, (low, high) in enumerate(pairwise([cuts.start, *edges, cuts.end])):
        if high - low <= 0.0:
            continue
        disc = _cylinder(REACH * cuts.tube.outer_radius, low, high)
        found = [part for solid in straight.solids() for part in solid.intersect(disc).solids()]
        check_one_piece(len(found))
        if number % 2:
            parts.append(_spine(found[0], motion.zones[number // 2]))
        else:
            parts.append(found[0].moved(_location(motion.bodies[number // 2])))
    solids = parts[0].fuse(*parts[1:]).solids()
    return solids[0] if len(solids) == 1 else cad.Compound(solids)


def _spine(piece: Any, zone: Zone) -> Any:
    """Return a spine through its sections, each that of the straight one at its pose."""
    cad = import_module("build123d")
    foot = piece.faces().sort_by(cad.Axis.Z)[0]
    if foot.inner_wires():
        raise InputError.UNSUPPORTED(
            "a STEP file of a bent robot needs spines without holes; leave channels out, or write "
            "an STL file."
        )
    shown = np.linspace(0, len(zone.places) - 1, _SECTIONS).round().astype(int)
    lifts = zone.places[shown] - zone.start
    places = [_location(*pair) for pair in zip(zone.poses[shown], lifts, strict=True)]
    return cad.Solid.make_loft([foot.outer_wire().moved(place) for place in places])


def _location(pose: Any, lift: float = 0.0) -> Any:
    """Return a rotation and the displacement after it, of what is lifted before, as a location."""
    x_dir, _, z_dir, move = pose.T
    place = tuple(move + lift * z_dir)
    return import_module("build123d").Plane(place, x_dir=tuple(x_dir), z_dir=tuple(z_dir)).location
