"""The tube with its cuts as a closed surface of triangles, straight or bent, and as STL.

The frame is that of the robot file: z along the tube from the base (0) toward the tip, a cut of
direction 0 open toward +x.

A point of a flexure moves with the section of the rod that it lies in, from its place in the
straight tube to that in the state; all others move with their rigid body. The triangles stay those
of the straight solid, refined, so that the surface stays closed.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from functools import lru_cache, partial
from itertools import pairwise
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import make_interp_spline

from notchflex import EquilibriumPath, InputError, Robot, RobotShape, __version__
from notchflex.export.cuts import RobotCuts, check_one_tube, cuts_of
from notchflex.export.formats import Document, SolidOptions, Subject
from notchflex.plotting import fair_growth, prism, ring_solid, shape_at, shape_from_angles
from notchflex.support import FlexureShape, NotchCut, outline, robot_digest

if TYPE_CHECKING:
    from manifold3d import Manifold


Points = NDArray[np.float64]

_ROUNDING = 1e-9  # mm
_FAR = 4.0  # outer radii: chords of a few points lie outside of the tube
_FEWEST_SIDES, _MAX_SIDES = 48, 2000  # flat sides of the tube
_FEWEST_SIDES_OF_CHANNELS = 24
REACH = 2.0
"""How far a cutting solid reaches, in outer radii."""
_STEPS_OF_SCENES = 6
_PIECES = 16
"""Sections of the model's flexures at least, between which points are interpolated."""
_STEPS = 10
"""Straight pieces of a bent flexure at least: a notch that bends by 30 deg has 3 deg in each."""


def sector(cut: NotchCut, outer: float, count: int) -> tuple[float, float, Points]:
    """Return start and end of a radial cut [mm], and its cross-section, far beyond the tube.

    Its corners are the axis and `count` points of an arc.

    Raises:
        InputError: It is not a window with straight ends.
    """
    if len(cut.corners) == 4:
        (start, _), (low, bottom), (high, also), (end, _) = cut.corners
        if max(abs(start - low), abs(end - high), abs(bottom - also)) < _ROUNDING:
            middle, half = math.radians(cut.side_deg), math.acos(bottom / outer)
            angles = np.linspace(middle - half, middle + half, count)
            arc = _FAR * outer * np.stack([np.cos(angles), np.sin(angles)], axis=-1)
            return start, end, np.concatenate([np.zeros((1, 2)), arc])
    raise InputError.UNSUPPORTED(
        "a radial cut that is not a window with straight ends has no solid; export a flat pattern."
    )


def check_one_piece(count: int) -> None:
    """Raise if the cuts divide the tube.

    Raises:
        InputError: There is another number of pieces than one.
    """
    if count != 1:
        raise InputError.UNSUPPORTED(
            "the cuts and channels divide the tube into pieces that do not hold together; give "
            "the notches a larger uncut_length or a smaller depth, or a larger shank."
        )


def channels(robot: Robot, options: SolidOptions) -> tuple[float, list[tuple[float, float]]]:
    """Return the radius of the channels as they are drilled, before polishing, and their places.

    Raises:
        InputError: A channel would break through the outer surface, or would cut nothing.
    """
    tube, diameter, places = robot.tube, options.channels, list[tuple[float, float]]()
    if not diameter:
        return 0.0, places
    if diameter <= 2.0 * options.polishing:
        raise InputError.OUT_OF_RANGE(
            f"channels: {diameter:g} mm wide after polishing by {options.polishing:g} mm, they "
            f"need no drill; give more than {2.0 * options.polishing:g} mm."
        )
    for number, tendon in enumerate(robot.tendon, start=1):
        far, angle = tendon.radius + 0.5 * diameter, math.radians(tendon.direction_deg)
        what = f"channels: {diameter:g} mm wide, the channel of tendon {number}"
        if far >= tube.outer_radius:
            raise InputError.OUT_OF_RANGE(
                f"{what} reaches {far:.6g} mm from the axis and the wall ends at "
                f"{tube.outer_radius:.6g} mm; give less than "
                f"{2.0 * (tube.outer_radius - tendon.radius):.6g} mm."
            )
        if far <= tube.inner_radius:
            raise InputError.OUT_OF_RANGE(
                f"{what} lies within the bore, {tube.inner_radius:.6g} mm from the axis, and cuts "
                "nothing; leave channels out."
            )
        places.append((tendon.radius * math.cos(angle), tendon.radius * math.sin(angle)))
    return 0.5 * diameter - options.polishing, places


def _sides(radius: float, sagitta: float, least: int) -> int:
    """Return the number of flat sides, at least, that lie so near to a round surface [mm]."""
    return max(least, math.ceil(math.pi / math.acos(max(1.0 - 2.0 * sagitta / radius, 0.0))))


def straight_solid(robot: Robot, cuts: RobotCuts, options: SolidOptions) -> Manifold:
    """Return the straight tube without its cuts and channels.

    Its round surfaces are flat sides that lie half inside and half outside, at most `chord` apart,
    so that the volume is that of the round tube.

    Raises:
        InputError: A channel does not fit the wall, or no solid of a cut is known.
    """
    from manifold3d import Manifold

    sides = 4 * math.ceil(_sides(cuts.tube.outer_radius, options.chord, _FEWEST_SIDES) / 4)
    if sides > _MAX_SIDES:
        raise InputError.OUT_OF_RANGE(
            f"chord: with {options.chord:g} mm the tube would have more than {_MAX_SIDES} flat "
            "sides; give a larger chord."
        )
    drills: list[Manifold] = []
    radius, places = channels(robot, options)
    for place in places:
        count = _sides(radius, options.chord, _FEWEST_SIDES_OF_CHANNELS)
        length, grown = cuts.end - cuts.start, fair_growth(count) * radius
        drill = Manifold.cylinder(length, grown, circular_segments=count)
        drills.append(drill.translate((*place, cuts.start)))
    return _wall(cuts, cuts.start, cuts.end, sides, options.chord, drills)


def _wall(
    cuts: RobotCuts,
    low: float,
    high: float,
    sides: int,
    chord: float,
    drills: Sequence[Manifold] = (),
) -> Manifold:
    """Return a length of the straight tube without the cuts that reach into it."""
    from manifold3d import Manifold, OpType

    removed = [
        _removed(placed.cut, placed.outer, sides, chord)
        for placed in cuts.cuts
        if placed.start < high and placed.end > low
    ]
    walls, rings = (
        [
            ring_solid((ring.outer, ring.inner), ends, sides)
            for ring in of
            if (ends := (max(low, ring.low), min(high, ring.high)))[0] < ends[1]
        ]
        for of in (cuts.walls, cuts.rings)
    )
    wall = Manifold.batch_boolean(walls, OpType.Add)
    left = wall - Manifold.batch_boolean([*removed, *drills], OpType.Add)
    if not rings:
        return left
    # Rings in one another leave edges of 1e-6 mm, which single precision would open.
    return Manifold.batch_boolean([left, *rings], OpType.Add).as_original().simplify(1e-6)


def _removed(cut: NotchCut, outer: float, sides: int, chord: float) -> Manifold:
    """Return what a cut takes away, beyond the surface too."""
    if cut.radial:
        from manifold3d import CrossSection, FillRule, Manifold

        # Its corners fall between those of the tube, far outside, so that it cuts at its two walls.
        start, end, corners = sector(cut, outer, max(3, sides // 4))
        section = CrossSection([corners], FillRule.NonZero)
        return Manifold.extrude(section, end - start).translate((0.0, 0.0, start))
    reach, points = REACH * outer, np.array(outline(cut, chord))[::-1, ::-1]
    # Beyond the surface the cut is as wide as at the surface.
    first, last = ([[reach, along]] for along in points[[0, -1], 1])
    corners = np.concatenate([first, points, last])
    return prism(corners, math.radians(cut.side_deg), 2.0 * reach)


class Zone(NamedTuple):
    """The length of tube in which one flexure lies, and how its points move.

    A spine is crossed along z, a strip across the tube.

    Attributes:
        start: Where it starts along the tube [mm].
        end: Where it ends.
        direction: What the place of a point in the flexure is measured along, a unit vector.
        places: Place of each section, rising [mm], (k,).
        poses: Rotation of each section from the straight tube to the state, and its displacement
            after that [mm], (k, 3, 4).
    """

    start: float
    end: float
    direction: Points
    places: Points
    poses: Points

    def moved(self, points: Points) -> Points:
        """Return points of the zone where they are in the state [mm], (v, 3)."""
        along = np.clip(points @ self.direction, self.places[0], self.places[-1])
        return _moved(make_interp_spline(self.places, self.poses, k=1)(along), points)


def is_bent(subject: Subject, polishing: float) -> bool:
    """Return whether the robot of a solid is bent, under loads or without any.

    Before polishing it is the straight tube.

    Raises:
        InputError: It is loaded before polishing.
    """
    if subject.path is not None and polishing:
        raise InputError.CONFLICT(
            "polishing: under load the solid is the finished robot; leave polishing out, or the "
            "solid straight."
        )
    curved = any(notch.precurvature_deg for notch in subject.robot.notches)
    return subject.path is not None or (curved and not polishing)


class DeformationMap:
    """Map from points of the straight tube to their positions in a state.

    Attributes:
        zones: Where the flexures lie, base to tip.
        bodies: Rotations and displacements of the bodies from the straight tube, (n + 1, 3, 4).
        shape: The shape of the state.
    """

    def __init__(self, subject: Subject, cuts: RobotCuts) -> None:
        """Take the shapes of the straight tube and of the state."""
        path, robot = subject.path, subject.robot
        rest = _straight(robot, "tendons" if path is None else path.chain.level)
        self.shape = bent = (
            shape_from_angles(robot, robot.geometry.free_angle, _PIECES)
            if path is None
            else shape_at(path, subject.step, _PIECES)
        )
        self.zones = [_zone(rest, bent, cuts, notch) for notch in range(len(rest.flexures))]
        self.bodies = _poses(rest, bent)

    def __call__(self, points: Points) -> Points:
        """Return points of the straight tube where they are in the state [mm], (v, 3)."""
        along = points[:, 2]
        body = np.searchsorted([zone.end for zone in self.zones], along, side="left")
        new = _moved(self.bodies[body], points)
        for zone in self.zones:
            inside = (along >= zone.start) & (along <= zone.end)
            new[inside] = zone.moved(points[inside])
        return new


@lru_cache(maxsize=8)
def _straight(robot: Robot, level: str) -> RobotShape:
    return shape_from_angles(robot, 0.0 * robot.geometry.free_angle, _PIECES, level)


def _moved(poses: Points, points: Points) -> Points:
    """Return points after rotations and displacements, (v, 3)."""
    return np.einsum("vij,vj->vi", poses[..., :3], points) + poses[..., 3]


def _poses(rest: RobotShape | FlexureShape, bent: RobotShape | FlexureShape) -> Points:
    """Return rotations and displacements of bodies or sections."""
    turns = bent.rotation @ np.swapaxes(rest.rotation, 1, 2)
    moves = bent.position - np.einsum("vij,vj->vi", turns, rest.position)
    return np.concatenate([turns, moves[..., None]], axis=-1)


def _zone(rest: RobotShape, bent: RobotShape, cuts: RobotCuts, notch: int) -> Zone:
    """Return the zone of a flexure."""
    robot, line = rest.robot, rest.flexures[notch]
    poses = _poses(line, bent.flexures[notch])
    first = next(number for number, cut in enumerate(cuts.cuts) if cut.notch == notch + 1)
    has_spine, cut = robot.geometry.has_spine[notch], cuts.cuts[first]
    side, outer = math.radians(robot.notches[notch].direction_deg), cut.outer
    across = [math.cos(side), math.sin(side), 0.0]
    direction = np.array([0.0, 0.0, 1.0] if has_spine else across)
    places = line.position @ direction
    if places[0] > places[-1]:  # the proximal end of a strip lies on the side of the bend
        direction, places = -direction, -places
    # Sections at one place are elastic ends.
    low, high = np.flatnonzero(places == places[0])[-1], np.flatnonzero(places == places[-1])[0]
    if has_spine:
        shown = slice(low, high + 1)
        return Zone(cut.start, cut.end, direction, places[shown], poses[shown])
    # Those of a strip run along the wall, and are spread over it, to the outer surface.
    before, beyond = places[: low + 1], places[high:]
    before[:] = np.linspace(places[0], min(-outer, places[0]), len(before))[::-1]
    beyond[:] = np.linspace(places[-1], max(outer, places[-1]), len(beyond))
    places, kept = np.unique(places, return_index=True)
    # It lies between this notch's first cut and the next one along the tube.
    return Zone(cut.end, cuts.cuts[first + 1].start, direction, places, poses[kept])


def bent_solid(straight: Manifold, motion: DeformationMap, cuts: RobotCuts) -> Manifold:
    """Bend the straight solid of a robot.

    Its edges are refined to the length of a piece of a flexure. Lengths of tube without cuts, which
    stay straight, are shortened meanwhile, so that they get few triangles.
    """
    length = min(float(np.ptp(zone.places)) for zone in motion.zones) / _STEPS
    box = straight.bounding_box()
    knots = [box[2] - 1.0]  # below the tube: a cut may start at its very end
    for cut in sorted(cuts.cuts, key=lambda cut: cut.start):
        if cut.start > knots[-1]:
            knots += [cut.start, cut.end]
        else:  # it overlaps along the tube with the one before
            knots[-1] = max(knots[-1], cut.end)
    whole = np.array([*knots, box[5]])
    steps = np.diff(whole)
    steps[::2] = np.minimum(steps[::2], 2.0 * length)
    short = whole[0] + np.append(0.0, np.cumsum(steps))

    def along(points: Points, old: Points, new: Points) -> Points:
        return np.column_stack([points[:, :2], np.interp(points[:, 2], old, new)])

    shorter = straight.warp_batch(lambda points: along(points, whole, short))
    return shorter.refine_to_length(length).warp_batch(
        lambda points: motion(along(points, short, whole))
    )


class MovingSolids:
    """The bodies and flexures of a robot as closed surfaces, for a scene in which they move.

    A surface is its vertices [mm], (v, 3), and corners of triangles, counter-clockwise as seen from
    outside, (f, 3). Bodies are in their own frames and keep their shape; flexures are straight and
    change theirs, but keep their triangles.

    Args:
        robot: The robot.
        shank: Uncut tube on the base side [mm].
        sides: Flat sides of a body, as large in volume as the round tube. Flexures have half as
            many, because they change with every state.

    Attributes:
        bodies: Surfaces of the bodies, base first.
        flexures: Surfaces of the flexures, base to tip.

    Raises:
        InputError: No solid of a cut is known.

    Example:
        >>> from notchflex import Load, load_robot, simulate
        >>> robot = load_robot("pacheco2021-a")
        >>> solids = MovingSolids(robot)
        >>> shape, flexures = solids.at(simulate(robot, Load(tension=1.0)))
        >>> len(shape.position), len(flexures), flexures[0].shape == solids.flexures[0][0].shape
        (6, 5, True)
    """

    def __init__(self, robot: Robot, shank: float = 0.0, sides: int = 96) -> None:
        self._cuts = cuts = cuts_of(robot, shank)
        zones = DeformationMap(Subject(robot), cuts).zones
        knots = [cuts.start, *(end for zone in zones for end in (zone.start, zone.end)), cuts.end]
        ends = list(pairwise(knots))
        chord = 0.5 * cuts.tube.outer_radius * (1.0 - math.cos(math.pi / sides))
        places = _straight(robot, "tendons").position
        self.bodies: list[tuple[Points, NDArray[np.int64]]] = []
        for pair, place in zip(ends[::2], places, strict=True):
            points, faces = _surface(_wall(cuts, *pair, sides, chord))
            self.bodies.append((points - place, faces))
        self.flexures = [
            _surface(
                _wall(cuts, *pair, sides // 2, chord).refine_to_length(
                    float(np.ptp(zone.places)) / _STEPS_OF_SCENES
                )
            )
            for pair, zone in zip(ends[1::2], zones, strict=True)
        ]

    def at(self, path: EquilibriumPath, step: int = 0) -> tuple[RobotShape, list[Points]]:
        """Return the shape at a step of a path, and the vertices of the flexures there."""
        motion = DeformationMap(Subject(path.robot, path, step), self._cuts)
        pairs = zip(motion.zones, self.flexures, strict=True)
        return motion.shape, [zone.moved(points) for zone, (points, _) in pairs]


def _surface(solid: Manifold) -> tuple[Points, NDArray[np.int64]]:
    """Return vertices and triangles of a solid, copied: views would keep its mesh alive."""
    mesh = solid.to_mesh64()
    return np.array(mesh.vert_properties)[:, :3], np.asarray(mesh.tri_verts, np.int64)


def stl_solid(subject: Subject, options: SolidOptions) -> Document:
    """Make the solid of a robot as STL, straight as it is cut or bent as its state is.

    Raises:
        InputError: See `straight_solid`.
    """
    robot, bent = subject.robot, is_bent(subject, options.polishing)
    check_one_tube(robot)
    cuts = cuts_of(robot, options.shank, options.polishing)
    solid = straight_solid(robot, cuts, options)
    check_one_piece(len(solid.decompose()))
    warnings = cuts.warnings
    if bent:
        solid = bent_solid(solid, DeformationMap(subject, cuts), cuts)
        if not robot.geometry.has_spine.all():
            warnings += (
                "the model's strips overlap with the walls that they turn into; in the bent solid "
                "the material between them is stretched, by about 1 % of the volume.",
            )
    digest = robot_digest(robot)
    facts = {
        "robot_hash": digest,
        "triangles": solid.num_tri(),
        "volume_mm3": solid.volume(),
        "surface_mm2": solid.surface_area(),
        "holes": solid.genus(),
        "box_mm": np.reshape(solid.bounding_box(), (2, 3)).tolist(),
    }
    return Document(solid, warnings, facts, partial(_save, digest))


def _save(digest: str, solid: Manifold, file: Path) -> None:
    from trimesh import Trimesh
    from trimesh.exchange.stl import export_stl

    surface = Trimesh(*_surface(solid), process=False)
    head = f"notchflex {__version__}, robot {digest}, mm".encode("ascii").ljust(80)
    file.write_bytes(head + export_stl(surface)[len(head) :])
