"""A planar robot as a pinhole camera sees it: points on its axis, and its outline.

The principal point of the camera is the middle of the photograph. Rings are cylinders, whose sides
are seen as lines and whose ends as half ellipses; the spine of a notch is an arc of the wall, bent
to a circle.
"""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import CubicSpline
from scipy.optimize import least_squares
from scipy.spatial.transform import Rotation

from notchflex import ArcNotch, InputError, Robot, bodies_from_angles
from notchflex.photographs.edges import Lines, Numbers, Outline

_GRID = np.radians(np.arange(-60.0, 121.0, 2.0))
_IN_PLANE = 1e-6


class PlanarRobot:
    """A planar robot of n arc notches, in the plane in which it bends. Lengths mm, angles rad.

    The plane has the axis x on the side of the first notch and z along the straight tube. Each
    notch moves the body behind it by an amount that depends on its own angle alone, so that one
    spline per notch gives the poses of the library (`bodies_from_angles`) to every fit.

    Attributes:
        robot: The robot.
        notches: Number of notches.
        outer: Outer radius.
        inner: Inner radius.
        side: Side of every notch, 1 or -1 along x, (n,).
        depth: Depth of every notch at the outer surface, (n,).
        radial: Whether the edges of a notch point to the tube axis, (n,).
        height: Height of every notch, (n,).
        uncut: Uncut length behind every notch, (n,).
        length: Length from the start of the first notch to the tip.

    Raises:
        InputError: Notches of another kind than "arc", or not all cut in one plane.
    """

    def __init__(self, robot: Robot) -> None:
        arcs = [notch for notch in robot.notches if isinstance(notch, ArcNotch)]
        others = {notch.kind for notch in robot.notches} - {"arc"}
        if others:
            raise InputError.UNSUPPORTED(
                f"{robot.name} has notches of kind {min(others)!r}; photographs are measured for "
                'robots whose notches are all of kind "arc"'
            )
        directions = np.radians([arc.direction_deg for arc in arcs])
        if np.abs(np.sin(directions - directions[0])).max() > _IN_PLANE:
            raise InputError.UNSUPPORTED(
                f"the notches of {robot.name} do not all bend in one plane; one photograph from "
                "the side shows robots that bend in one plane only"
            )
        self.robot, self.notches = robot, len(arcs)
        self.outer, self.inner = robot.tube.outer_radius, robot.tube.inner_radius
        self.side = np.sign(np.cos(directions - directions[0]))
        self.depth = np.array([arc.section_depth(robot.tube) for arc in arcs])
        self.radial = np.array([arc.cut == "on-axis" for arc in arcs])
        self.height, self.uncut = np.array([(arc.height, arc.uncut_length) for arc in arcs]).T
        self.length = float(self.height.sum() + self.uncut.sum())
        position, rotation = bodies_from_angles(robot, np.tile(_GRID, (len(arcs), 1)).T)
        step = np.einsum("sbji,sbj->sbi", rotation[:, :-1], np.diff(position, axis=1))
        step[:, 0, 2] -= robot.tube.base_length  # lengths count from the start of the first notch
        along = step[..., :2] @ [math.cos(directions[0]), math.sin(directions[0])]
        plane = np.stack([along, step[..., 2]], axis=-1)
        self._steps = [CubicSpline(_GRID, plane[:, notch]) for notch in range(self.notches)]

    def width(self, numbers: Numbers) -> float:
        """Return the width of the tube in a view, px."""
        return 2.0 * self.outer * math.exp(numbers[3])

    def poses(self, angles: Numbers) -> tuple[Numbers, Numbers]:
        """Return where the bodies start and how far they are turned.

        Args:
            angles: Notch angles, positive toward the side of the notch, (b, n).

        Returns:
            Starts of the bodies (x, z), the base first, whose start is that of the first notch,
            (b, n + 1, 2); and their angles in the plane, (b, n + 1).
        """
        turned = np.pad(np.cumsum(angles * self.side, axis=1), ((0, 0), (1, 0)))
        steps = [spline(angle) for spline, angle in zip(self._steps, angles.T, strict=True)]
        x, z = np.moveaxis(np.stack(steps, axis=1), -1, 0)
        cos, sin = np.cos(turned[:, :-1]), np.sin(turned[:, :-1])
        moves = np.stack([cos * x + sin * z, cos * z - sin * x], axis=-1)
        return np.pad(np.cumsum(moves, axis=1), ((0, 0), (1, 0), (0, 0))), turned


NUMBERS = 9
"""Numbers of a view, before the angles: place of the start of the first notch from the middle of
the photograph (x, y, px), direction of the base (rad), logarithm of the scale (px/mm), roll about
the tube axis and tilt out of the photograph (rad), inverse distance of the camera (1/mm), and what
the notches are higher and deeper than in the robot file (mm). The angles of the n notches follow
(rad). Where every notch is measured too, 3 n + 1 lengths follow these (mm): what each is higher and
deeper than the others, how far each lies nearer to the tip than in the robot file, and the tip."""

_ROLL = math.radians(5.0)  # of starts: views that are rolled a little are found from there
USUAL_DISTANCE = 0.003  # outer radii over the distance of the camera, in starts


class View:
    """The numbers of b views of a robot of n notches, in a photograph made smaller by a factor."""

    def __init__(self, numbers: Numbers, notches: int, factor: float = 1.0) -> None:
        _, _, direction, log_scale, roll, tilt, near, kerf, cut = numbers[:, :NUMBERS].T
        self.angles = numbers[:, NUMBERS : NUMBERS + notches]
        lengths = numbers[:, NUMBERS + notches :]
        if not lengths.size:
            lengths = np.zeros((len(numbers), 3 * notches + 1))
        kerfs, cuts, self.moved = np.split(lengths, [notches, 2 * notches], axis=1)
        self.kerf, self.cut = kerf[:, None] + kerfs, cut[:, None] + cuts
        self._near, self._scale = near[:, None, None], factor * np.exp(log_scale)[:, None, None]
        self._place = factor * numbers[:, None, :2]
        # Axes of the base in camera axes (right, down, forward). At first z points right, x down.
        turns = np.stack([direction, -tilt, roll], axis=1)
        axes = Rotation.from_euler("ZYX", turns).as_matrix()
        self.z, self.x, self.y = np.moveaxis(axes[:, None], -1, 0)

    def seen(self, point: Numbers) -> Numbers:
        """Project points of camera axes, mm from the start of the first notch, (b, N, 3)."""
        return (self._place + self._scale * point[..., :2]) / (1.0 + self._near * point[..., 2:])

    def frames(self, start: Numbers, turned: Numbers, along: Numbers) -> tuple[Numbers, ...]:
        """Return points on the axis of the tube and unit vectors there, (b, N, 3).

        Args:
            start: Points (x, z) in the plane in which the robot bends, (b, N, 2).
            turned: Directions of the axis there, rad, (b, N).
            along: Lengths along that axis from `start`, mm, (N,) or (b, N).

        Returns:
            The points; the directions of the axis, across it in the plane, and from the camera; and
            across axis and line of sight, and across the axis toward the camera.
        """
        cos, sin = np.cos(turned)[..., None], np.sin(turned)[..., None]
        axis, across = cos * self.z + sin * self.x, cos * self.x - sin * self.z
        point = start[..., :1] * self.x + start[..., 1:] * self.z + along[..., None] * axis
        flat = self._near * (point[..., :2] + self._place / self._scale)
        ray = _unit(np.concatenate([flat, 1.0 + self._near * point[..., 2:]], axis=-1))
        lateral = _unit(np.cross(axis, ray))
        lateral *= np.where(_dot(lateral, across) < 0.0, -1.0, 1.0)[..., None]
        toward = _unit(_dot(ray, axis)[..., None] * axis - ray)
        return point, axis, across, ray, lateral, toward


def _dot(left: NDArray[Any], right: NDArray[Any]) -> Numbers:
    return np.einsum("...i,...i->...", left, right)


def _unit(vector: NDArray[Any]) -> Numbers:
    return vector / np.sqrt(_dot(vector, vector))[..., None]


class ViewPrior(NamedTuple):
    """Prior of the view at one position of a photograph, from a board or a number.

    Attributes:
        log_scale: Logarithm of the scale (px/mm) and its standard deviation.
        slope: How a plane through the robot leads away from the camera along the axes of the
            photograph, (2,): mm deeper for every mm to the right, and down.
        tilt_deviation: Standard deviation of the tilt of a tube that lies in that plane, rad.
        perspective: Inverse distance of the camera and its standard deviation, 1/mm.
    """

    log_scale: tuple[float, float] = (0.0, math.inf)
    slope: tuple[float, float] = (0.0, 0.0)
    tilt_deviation: float = math.radians(8.0)
    perspective: tuple[float, float] = (0.0, math.inf)


NO_PRIOR = ViewPrior()

SIDE, FACE, SPINE = range(3)
"""Kinds of outline: the sides of a ring, its ends, the two edges of a spine."""

BASE = 1.2
"""Length of the straight tube before the first notch that is looked at, outer radii."""

MIN_ANGLE, MAX_ANGLE = -0.6, 1.9
"""Angles of notches that are looked for, rad."""

_SPINE_END = 0.2
"""Part of a spine at either end that is not used: fillets and the corners of rings."""


class OutlineModel:
    """The outline of a robot as a function of its view and its notch angles.

    Args:
        planar: The robot.
        per_side: Points on each side of a ring.
        per_face: Points on each end of a ring.
        corner: Part of an end next to the spine that is not used, outer radii.
        shift: How far blur and shading may shift all edges alike, px (standard deviation).
        prior: Prior of the view: scale, tilt, distance of the camera.

    Attributes:
        kind: Kind of each of the N points: `SIDE`, `FACE` or `SPINE`, (N,).
        ring: Its ring or notch, (N,).
        which: Its side or end: -1 or 1, (N,).
        place: Place along it, 0 to 1, (N,).
        lines: The lines on which the points lie.
        angles: Which numbers of a view are the notch angles.
    """

    def __init__(
        self,
        planar: PlanarRobot,
        per_side: int = 24,
        per_face: int = 16,
        corner: float = 0.12,
        shift: float = 0.7,
        prior: ViewPrior = NO_PRIOR,
    ) -> None:
        self.planar, self.corner, self.prior = planar, corner, prior
        self.angles = slice(NUMBERS, NUMBERS + planar.notches)
        rings = range(planar.notches + 1)
        along = np.linspace(0.06, 0.94, per_side)
        across = np.linspace(0.0, 1.0, per_face)
        spine = np.linspace(_SPINE_END, 1.0 - _SPINE_END, max(3, per_side // 3))
        blocks = [
            (SIDE, rings, (-1, 1), along),
            (FACE, rings[1:], (-1,), across),
            (FACE, rings, (1,), across),
            (SPINE, rings[1:], (-1, 1), spine),
        ]
        points = [
            (kind, ring, which, number, place)
            for kind, rings_of_kind, sides, places in blocks
            for ring in rings_of_kind
            for which in sides
            for number, place in enumerate(places)
        ]
        names = np.array([point[:3] for point in points])
        self.kind, self.ring, self.which = names.T
        self.place = np.array([point[4] for point in points])
        self.lines = Lines(names, self.place, shift)
        row = {point[:4]: number for number, point in enumerate(points)}
        # The other end of the tube before the first notch is hidden: its sides give the inside.
        hidden = row[SIDE, 0, -1, 0]
        self._across = np.array([row.get((k, r, -w, p), hidden) for k, r, w, p in row])
        self._facing = np.array(
            [row.get((k, r + w, -w, p), -1) if k == FACE else -1 for k, r, w, p in row]
        )
        is_end = self.which > 0
        notch = self.ring - 1 + ((self.kind == FACE) & is_end)
        self._is_tip = notch == planar.notches
        self._notch = np.clip(notch, 0, planar.notches - 1)
        self._part = np.where(self.kind == FACE, is_end, self.place)

    def outline(self, numbers: Numbers, factor: float = 1.0) -> Outline:
        """Return the outline of views and angles in a photograph made smaller by a factor.

        Args:
            numbers: Numbers of views (`NUMBERS`), angles (rad) and, where notches are measured,
                their lengths (mm), (b, NUMBERS + n) or (b, NUMBERS + 4 n + 1).
            factor: The factor.
        """
        planar, r, notch = self.planar, self.planar.outer, self._notch
        view = View(np.atleast_2d(numbers), planar.notches, factor)
        poses = planar.poses(view.angles)
        is_face, is_spine = self.kind == FACE, self.kind == SPINE
        # Where the rings begin and end, along each from its start.
        half = np.pad(0.5 * view.kerf, ((0, 0), (1, 1)))
        begin = np.pad(view.moved[:, :-1], ((0, 0), (1, 0))) + half[:, :-1]
        begin[:, 0] = -BASE * planar.outer
        end = np.append(0.0, planar.uncut) + view.moved - half[:, 1:]
        begin, end = begin[:, self.ring], end[:, self.ring]
        along = np.where(is_spine, 0.0, begin + (end - begin) * self._part)
        start, turned = (pose[:, self.ring] for pose in poses)
        start[:, is_spine], turned[:, is_spine] = self._spines(*poses)
        centre, axis, across, ray, lateral, toward = view.frames(start, turned, along)
        side = planar.side[notch]
        x, y = _dot(lateral, across) * side, np.abs(_dot(lateral, view.y))
        edge = spine_edge(planar, notch, view.cut[:, notch], x, y)
        # The part of an end beside the notch; the whole end at the tip.
        low = np.where(self._is_tip, -0.9 * r, np.minimum(edge + self.corner * r, 0.8 * r))
        sine = side * (low + (0.92 * r - low) * self.place) / r
        # The half of the circle that bulges out of the ring.
        bulge = np.where((_dot(axis, ray) > 0.0) == (self.which > 0), 1.0, -1.0)
        cosine = bulge * np.sqrt(1.0 - sine**2)
        is_inner = is_spine & (self.which * side > 0.0)
        aside = np.select([is_face, is_inner], [r * sine, side * edge], r * self.which)
        point = centre + aside[..., None] * lateral + (r * is_face * cosine)[..., None] * toward
        projected = view.seen(point)
        on_face = np.abs(cosine)[..., None] * lateral - (bulge * sine)[..., None] * toward
        tangent = np.where(is_face[:, None], on_face, axis)[:1]
        first = projected[0]
        ahead = view.seen(point[:1] + 1e-4 * tangent)[0] - first
        length = np.maximum(np.linalg.norm(ahead, axis=1, keepdims=True), 1e-12)
        normal = np.stack([-ahead[:, 1], ahead[:, 0]], axis=1) / length
        inward = _dot(first[self._across] - first, normal)
        normal *= np.where(inward > 0.0, -1.0, 1.0)[:, None]
        room = _dot(first[self._facing] - first, normal)
        room[self._facing < 0] = np.inf
        return Outline(projected, normal, room, np.abs(inward))

    def _spines(self, start: Numbers, turned: Numbers) -> tuple[Numbers, Numbers]:
        """Return where the points of spines lie on the tube axis, and its direction there."""
        is_spine = self.kind == SPINE
        notch, place = self._notch[is_spine], self.place[is_spine]
        angle, bend = turned[:, notch], (turned[:, 1:] - turned[:, :-1])[:, notch]
        uncut = np.append(0.0, self.planar.uncut)[notch]
        before = start[:, notch] + uncut[:, None] * _heading(angle)
        length = np.linalg.norm(start[:, notch + 1] - before, axis=-1) / np.sinc(0.5 * bend / np.pi)
        bent = place * bend
        chord = length * place * np.sinc(0.5 * bent / np.pi)
        return before + chord[..., None] * _heading(angle + 0.5 * bent), angle + bent


def _heading(angle: Numbers) -> Numbers:
    return np.stack([np.sin(angle), np.cos(angle)], axis=-1)


def spine_edge(
    planar: PlanarRobot, notch: NDArray[np.int_], cut: Numbers, x: Any, y: Any
) -> Numbers:
    """Return how high over the axis, toward the notch, the inner edge of a spine is seen, mm.

    Args:
        planar: The robot.
        notch: Which notches, from 0.
        cut: What they are deeper than in the robot file, mm.
        x: Cosine of the roll, the component of the side of the notch across the line of sight.
        y: Sine of the roll, not negative.
    """
    outer = planar.outer
    depth = np.clip(planar.depth[notch] + cut, 0.02 * outer, 1.98 * outer)
    cosine = (depth - outer) / outer
    high = -np.inf
    for radius in (outer, planar.inner):
        cos = np.where(planar.radial[notch], cosine, np.clip(cosine * outer / radius, -1.0, 1.0))
        high = np.maximum(high, radius * (-cos * x + np.sqrt(1.0 - cos**2) * y))
    return high


def start_numbers(
    planar: PlanarRobot, place: Any, direction: float, log_scale: float, side: float, angles: Any
) -> Numbers:
    """Return view and angles of a start; with `side` 1 the first notch is on the right."""
    roll = _ROLL if side > 0.0 else math.pi + _ROLL
    view = [direction, log_scale, roll, 0.0, USUAL_DISTANCE / planar.outer, 0.0, 0.0]
    return np.concatenate([place, view, angles])


def axis_points(planar: PlanarRobot, numbers: Numbers) -> Numbers:
    """Return points on the tube axis, px from the middle of the photograph, (n + 2, 2).

    One on the tube before the first notch, one where that notch starts, and the end of every body
    behind a notch; the last one is the tip.
    """
    view = View(numbers[None], planar.notches)
    bodies = [0, *range(planar.notches + 1)]
    start, turned = (pose[:, bodies] for pose in planar.poses(view.angles))
    along = np.array([-BASE * planar.outer, 0.0, *planar.uncut])
    return view.seen(view.frames(start, turned, along)[0])[0]


def on_axis_points(planar: PlanarRobot, points: Numbers) -> list[Numbers]:
    """Return view and angles of chains whose axis lies on points, the better one first.

    In one the first notch is cut on the right of the way from base to tip, in the other on the
    left.

    Args:
        planar: The robot of n notches.
        points: Points on the tube axis as of `axis_points`, px from the middle, (n + 2, 2).

    Raises:
        InputError: There are not n + 2 points, one is not finite, or they lie in one place.
    """
    points, n = np.asarray(points, float), planar.notches
    if points.shape != (n + 2, 2) or not np.isfinite(points).all():
        raise InputError.OUT_OF_RANGE(
            f"a chain of {n} notches has {n + 2} finite points (x, y); got {points.tolist()}"
        )
    steps = np.diff(points, axis=0)
    length = float(np.linalg.norm(steps, axis=1).sum())
    if length < 1.0:
        raise InputError.OUT_OF_RANGE(
            "the points of the chain lie in one place; drag them along the robot"
        )
    log_scale = math.log(length / (planar.length + BASE * planar.outer))
    heading = np.unwrap(np.arctan2(steps[:, 1], steps[:, 0]))
    bounds = np.array([*4 * [(-np.inf, np.inf)], *n * [(MIN_ANGLE, MAX_ANGLE)]]).T

    def fitted(side: float) -> tuple[float, Numbers]:
        angles = np.clip(side * np.diff(heading) * planar.side, MIN_ANGLE, MAX_ANGLE)

        def numbers(free: Numbers) -> Numbers:
            return start_numbers(planar, free[:2], free[2], free[3], side, free[4:])

        solved = least_squares(
            lambda free: (axis_points(planar, numbers(free)) - points).ravel(),
            np.array([*points[1], heading[0], log_scale, *angles]),
            bounds=tuple(bounds), x_scale="jac", max_nfev=60,
        )  # fmt: skip
        return float(solved.cost), numbers(solved.x)

    chains = sorted(map(fitted, (1.0, -1.0)), key=lambda chain: chain[0])
    return [numbers for _, numbers in chains]


def straight_chain(planar: PlanarRobot, width: int, height: int) -> Numbers:
    """Return the points of a straight chain in the middle of a photograph, px, (n + 2, 2)."""
    numbers = np.zeros(NUMBERS + planar.notches)
    numbers[2:4] = math.pi / 2.0, math.log(0.6 * height / planar.length)
    points = axis_points(planar, numbers)
    return points - points.mean(axis=0) + np.array([width - 1.0, height - 1.0]) / 2.0
