"""The tube with its cuts as a closed surface of triangles, straight or bent, and as STL.

The frame is that of the robot file: z along the tube from the base (0) toward the tip, a cut of
direction 0 open toward +x.

A point of a flexure moves with the section of the rod that it lies in, from its place in the
straight tube to that in the state; all others move with their rigid body. The triangles stay those
of the straight solid, refined, so that the surface stays closed.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation, Slerp

from notchflex import InputError, Robot, RobotShape, Tube, __version__
from notchflex.export.cuts import RobotCuts, cuts_of
from notchflex.export.formats import Document, SolidOptions, Subject
from notchflex.plotting import fair_growth, prism, shape_at, shape_from_angles, tube_wall
from notchflex.support import NotchCut, outline, robot_digest

if TYPE_CHECKING:
    from manifold3d import Manifold


Points = NDArray[np.float64]

_ROUNDING = 1e-9  # mm
_FAR = 4.0  # outer radii: chords of a few points lie outside of the tube


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


def channel_radius(robot: Robot, options: SolidOptions) -> float:
    """Return the radius of the channels as they are drilled, before polishing; 0 for none [mm].

    Raises:
        InputError: A channel would break through the outer surface, or would cut nothing.
    """
    tube, diameter = robot.tube, options.channels
    if not diameter:
        return 0.0
    if diameter <= 2.0 * options.polishing:
        raise InputError.OUT_OF_RANGE(
            f"channels: {diameter:g} mm wide after polishing by {options.polishing:g} mm, they "
            f"need no drill; give more than {2.0 * options.polishing:g} mm."
        )
    for number, tendon in enumerate(robot.tendon, start=1):
        far = tendon.radius + 0.5 * diameter
        if far >= tube.outer_radius:
            raise InputError.OUT_OF_RANGE(
                f"channels: {diameter:g} mm wide, the channel of tendon {number} reaches "
                f"{far:.6g} mm from the axis and the wall ends at {tube.outer_radius:.6g} mm; give "
                f"less than {2.0 * (tube.outer_radius - tendon.radius):.6g} mm."
            )
        if far <= tube.inner_radius:
            raise InputError.OUT_OF_RANGE(
                f"channels: {diameter:g} mm wide, the channel of tendon {number} lies within the "
                f"bore, {tube.inner_radius:.6g} mm from the axis, and cuts nothing; leave channels "
                "out."
            )
    return 0.5 * diameter - options.polishing


FEWEST_SIDES, MAX_SIDES = 48, 2000
_RADIUS_FACTOR = 2.0
"""How far a cutting solid reaches, in outer radii."""


def sides_of(tube: Tube, chord: float) -> int:
    """Return the number of flat sides of the tube at which they are near enough to round.

    Raises:
        InputError: There would be very many.
    """
    step = math.acos(max(1.0 - 2.0 * chord / tube.outer_radius, 0.0))
    if math.pi > MAX_SIDES * step:
        raise InputError.OUT_OF_RANGE(
            f"chord: with {chord:g} mm the tube would have more than {MAX_SIDES} flat sides; give "
            "a larger chord."
        )
    return max(FEWEST_SIDES, 4 * math.ceil(math.pi / step / 4.0))


def straight_solid(robot: Robot, cuts: RobotCuts, options: SolidOptions) -> Manifold:
    """Return the straight tube without its cuts and channels.

    Its round surfaces are flat sides that lie half inside and half outside, at most `chord` apart,
    so that the volume is that of the round tube.

    Raises:
        InputError: A channel does not fit the wall, or no solid of a cut is known.
    """
    from manifold3d import Manifold, OpType

    sides = sides_of(cuts.tube, options.chord)
    solid = tube_wall(cuts.tube, (cuts.start, cuts.end), sides, fair=True)
    removed = [_removed(one.cut, cuts.tube, sides, options.chord) for one in cuts.cuts]
    removed += _channels(robot, cuts, options)
    return solid - Manifold.batch_boolean(removed, OpType.Add)


def _removed(cut: NotchCut, tube: Tube, sides: int, chord: float) -> Manifold:
    """Return what a cut takes away, beyond the surface too."""
    outer = tube.outer_radius
    if cut.radial:
        from manifold3d import CrossSection, FillRule, Manifold

        # Its corners fall between those of the tube, far outside, so that it cuts at its two walls.
        start, end, corners = sector(cut, outer, max(3, sides // 4))
        section = CrossSection([corners], FillRule.NonZero)
        return Manifold.extrude(section, end - start).translate((0.0, 0.0, start))
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


def _channels(robot: Robot, cuts: RobotCuts, options: SolidOptions) -> list[Manifold]:
    """Return the channels of the tendons, through the whole tube."""
    from manifold3d import Manifold

    if not (radius := channel_radius(robot, options)):
        return []
    sides = max(24, math.ceil(math.pi / math.acos(max(1.0 - 2.0 * options.chord / radius, 0.0))))
    length = cuts.end - cuts.start
    channels: list[Manifold] = []
    for tendon in robot.tendon:
        angle = math.radians(tendon.direction_deg)
        x, y = tendon.radius * math.cos(angle), tendon.radius * math.sin(angle)
        drill = Manifold.cylinder(length, fair_growth(sides) * radius, circular_segments=sides)
        channels.append(drill.translate((x, y, cuts.start)))
    return channels


PIECES = 16
"""Sections of the model's flexures at least, between which points are interpolated."""
STEPS = 10
"""Straight pieces of a bent flexure at least: a notch that bends by 30 deg has 3 deg in each."""


@dataclass(frozen=True)
class Zone:
    """The length of tube in which one flexure lies, and how its points move.

    A spine is crossed along z, a strip across the tube.

    Args:
        start: Where it starts along the tube [mm].
        end: Where it ends.
        direction: What the place of a point in the flexure is measured along, a unit vector.
        places: Place of each section, rising [mm], (k,).
        turns: Rotation of each section from the straight tube to the state, (k, 3, 3).
        moves: Its displacement after that rotation [mm], (k, 3).
    """

    start: float
    end: float
    direction: Points
    places: Points
    turns: Points
    moves: Points

    @property
    def along_tube(self) -> bool:
        """Whether it is a spine along the tube, not a strip across it."""
        return bool(self.direction[2] > 0.5)

    def pose_at(self, height: float) -> tuple[Points, Points]:
        """Return rotation and displacement at a height of a spine, between two sections [mm]."""
        between = Slerp(self.places, Rotation.from_matrix(self.turns))
        turn = between(np.clip(height, self.places[0], self.places[-1])).as_matrix()
        middle = np.array([[0.0, 0.0, height]])
        return turn, self.moved(middle)[0] - turn @ middle[0]

    def moved(self, points: Points) -> Points:
        """Return points of the zone where they are in the state [mm], (v, 3)."""
        at = np.clip(points @ self.direction, self.places[0], self.places[-1])
        before = np.clip(np.searchsorted(self.places, at) - 1, 0, len(self.places) - 2)
        step = self.places[before + 1] - self.places[before]
        part = ((at - self.places[before]) / step)[:, None]
        first, second = (
            np.einsum("vij,vj->vi", self.turns[one], points) + self.moves[one]
            for one in (before, before + 1)
        )
        return (1.0 - part) * first + part * second


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
    """Map from points of the straight tube to their positions in a state."""

    def __init__(self, subject: Subject, cuts: RobotCuts) -> None:
        """Take the shapes of the straight tube and of the state."""
        robot = subject.robot
        level = "tendons" if subject.path is None else subject.path.chain.level
        straight = np.zeros(robot.number_of_notches)
        rest = shape_from_angles(robot, straight, PIECES, level)
        shape = (
            shape_from_angles(robot, robot.geometry.free_angle, PIECES)
            if subject.path is None
            else shape_at(subject.path, subject.step, PIECES)
        )
        self.zones = [_zone(rest, shape, cuts, notch) for notch in range(robot.number_of_notches)]
        turns = shape.rotation @ np.swapaxes(rest.rotation, 1, 2)
        self._bodies = turns, shape.position - _turned(turns, rest.position)

    def of_body(self, number: int) -> tuple[Points, Points]:
        """Return rotation and displacement of a body (0 is the base)."""
        turns, moves = self._bodies
        return turns[number], moves[number]

    def __call__(self, points: Points) -> Points:
        """Return points of the straight tube where they are in the state [mm], (v, 3)."""
        along = points[:, 2]
        body = np.searchsorted([zone.end for zone in self.zones], along, side="left")
        turns, moves = self._bodies
        new = _turned(turns[body], points) + moves[body]
        for zone in self.zones:
            inside = (along >= zone.start) & (along <= zone.end)
            new[inside] = zone.moved(points[inside])
        return new


def bent_solid(straight: Manifold, motion: DeformationMap, cuts: RobotCuts) -> Manifold:
    """Bend the straight solid of a robot.

    Its edges are refined to the length of a piece of a flexure. Lengths of tube without cuts, which
    stay straight, are shortened meanwhile, so that they get few triangles.
    """
    length = min(float(np.ptp(zone.places)) for zone in motion.zones) / STEPS
    box = straight.bounding_box()
    low, high = float(box[2]), float(box[5])
    knots = [low - 1.0]  # below the tube: a cut may start at its very end
    for one in sorted(cuts.cuts, key=lambda one: one.start):
        if one.start > knots[-1]:
            knots += [one.start, one.end]
        else:  # it overlaps along the tube with the one before
            knots[-1] = max(knots[-1], one.end)
    knots.append(high)
    steps = np.diff(knots)
    steps[::2] = np.minimum(steps[::2], 2.0 * length)
    short = np.concatenate([[knots[0]], knots[0] + np.cumsum(steps)])

    def along(points: Points, old: Points, new: Points) -> Points:
        return np.column_stack([points[:, :2], np.interp(points[:, 2], old, new)])

    whole = np.array(knots)
    shorter = straight.warp_batch(lambda points: along(points, whole, short))
    return shorter.refine_to_length(length).warp_batch(
        lambda points: motion(along(points, short, whole))
    )


def _turned(turns: Points, points: Points) -> Points:
    return np.einsum("vij,vj->vi", turns, points)


def _zone(rest: RobotShape, shape: RobotShape, cuts: RobotCuts, notch: int) -> Zone:
    """Return the zone of a flexure."""
    robot = rest.robot
    line, bent = rest.flexures[notch], shape.flexures[notch]
    turns = bent.rotation @ np.swapaxes(line.rotation, 1, 2)
    moves = bent.position - _turned(turns, line.position)
    first = next(number for number, one in enumerate(cuts.cuts) if one.notch == notch + 1)
    if robot.geometry.has_spine[notch]:  # a spine along the tube
        direction = np.array([0.0, 0.0, 1.0])
        ends = cuts.cuts[first].start, cuts.cuts[first].end
        return _without_legs(ends, direction, line.position @ direction, turns, moves, 0.0)
    # A strip across the tube lies between this notch's first cut and the next one along the tube.
    view = math.radians(robot.notches[notch].direction_deg)
    direction = np.array([math.cos(view), math.sin(view), 0.0])
    heights = line.position @ direction
    if heights[0] > heights[-1]:  # its proximal end lies on the side of the bend
        direction, heights = -direction, -heights
    ends = cuts.cuts[first].end, cuts.cuts[first + 1].start
    return _without_legs(ends, direction, heights, turns, moves, robot.tube.outer_radius)


def _without_legs(
    ends: tuple[float, float],
    direction: Points,
    heights: Points,
    turns: Points,
    moves: Points,
    outer: float,
) -> Zone:
    """Return a zone whose sections all have a place of their own.

    Elastic ends are sections at one place: those of a strip run along the wall, and are spread over
    it, from the strip to the outer surface; of others the outermost counts.
    """
    low, high = np.flatnonzero(heights == heights[0])[-1], np.flatnonzero(heights == heights[-1])[0]
    spread = np.array(heights)
    if low > 0:
        spread[: low + 1] = np.linspace(min(-outer, heights[0]), heights[0], low + 1)
    if high < len(heights) - 1:
        spread[high:] = np.linspace(heights[-1], max(outer, heights[-1]), len(heights) - high)
    kept = np.concatenate([[True], np.diff(spread) > 0.0])
    kept[-1] = True
    return Zone(*ends, direction, spread[kept], turns[kept], moves[kept])


STRETCHED = (
    "the model's strips overlap with the walls that they turn into; in the bent solid the material "
    "between them is stretched, by about 1 % of the volume."
)

_TRIANGLE = np.dtype([("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("spare", "<u2")])


def stl_solid(subject: Subject, options: SolidOptions) -> Document:
    """Make the solid of a robot as STL, straight as it is cut or bent as its state is.

    Raises:
        InputError: See `straight_solid`.
    """
    robot = subject.robot
    bent = is_bent(subject, options.polishing)
    cuts = cuts_of(robot, options.shank, options.polishing)
    solid = straight_solid(robot, cuts, options)
    check_one_piece(len(solid.decompose()))
    warnings = cuts.warnings
    if bent:
        motion = DeformationMap(subject, cuts)
        solid = bent_solid(solid, motion, cuts)
        if not all(zone.along_tube for zone in motion.zones):
            warnings += (STRETCHED,)
    low, high = np.array(solid.bounding_box()).reshape(2, 3)
    digest = robot_digest(robot)
    facts = {
        "robot_hash": digest,
        "triangles": solid.num_tri(),
        "volume_mm3": solid.volume(),
        "surface_mm2": solid.surface_area(),
        "holes": solid.genus(),
        "box_mm": [low.tolist(), high.tolist()],
    }
    return Document(solid, warnings, facts, partial(_save, digest))


def _save(digest: str, solid: Manifold, file: Path) -> None:
    mesh = solid.to_mesh64()
    points = np.asarray(mesh.vert_properties)[:, :3][np.asarray(mesh.tri_verts, int)]
    normal = np.cross(points[:, 1] - points[:, 0], points[:, 2] - points[:, 0])
    length = np.linalg.norm(normal, axis=1, keepdims=True)
    table = np.zeros(len(points), _TRIANGLE)
    table["normal"] = normal / np.where(length > 0.0, length, 1.0)
    table["corners"] = points
    head = f"notchflex {__version__}, robot {digest}, mm".encode("ascii")
    count = np.array([len(points)], "<u4")
    file.write_bytes(head.ljust(80) + count.tobytes() + table.tobytes())
