"""The projected chain: points on its axis, and its outline in a photograph.

A pinhole camera sees the chain; its principal point is the middle of the photograph. Rings are
cylinders, whose sides are seen as lines and whose ends as half ellipses; the spine of a notch is an
arc of the wall, bent to a circle.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import least_squares

from notchflex import InputError
from notchflex.photographs.camera import NO_PRIOR, NUMBERS, Frame, View, ViewPrior, dot
from notchflex.photographs.chain_table import ChainTable, Numbers
from notchflex.photographs.lines import Lines

SIDE, FACE, SPINE = 0, 1, 2
"""Kinds of outline: the sides of a ring, its ends, the two edges of a spine."""

BASE = 1.2
"""Length of the straight tube before the first notch that is looked at, outer radii."""

MIN_ANGLE, MAX_ANGLE = -0.6, 1.9
"""Angles of notches that are looked for, rad."""

_SPINE_END = 0.2
"""Part of a spine at either end that is not used: fillets and the corners of rings."""


class Outline(NamedTuple):
    """Points of outlines. N points, b views.

    Attributes:
        point: Where they are seen, px from the middle of the photograph, (b, N, 2).
        normal: Unit normals that point out of the robot, of the first view, (N, 2).
        room: How far the background reaches beyond each point along its normal, px, of the first
            view, (N,); infinite where nothing follows.
        breadth: How far the robot reaches inside each point, px, (N,).
    """

    point: Numbers
    normal: Numbers
    room: Numbers
    breadth: Numbers


class OutlineModel:
    """The outline of a robot as a function of its view and its notch angles.

    Args:
        table: The robot.
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
    """

    def __init__(
        self,
        table: ChainTable,
        per_side: int = 24,
        per_face: int = 16,
        corner: float = 0.12,
        shift: float = 0.7,
        prior: ViewPrior = NO_PRIOR,
    ) -> None:
        self.table, self.corner, self.prior = table, corner, prior
        rings, sides = np.arange(table.notches + 1), [-1, 1]
        along = np.linspace(0.06, 0.94, per_side)
        across = np.linspace(0.0, 1.0, per_face)
        spine = np.linspace(_SPINE_END, 1.0 - _SPINE_END, max(3, per_side // 3))
        blocks = [
            _block(SIDE, rings, sides, along),
            _block(FACE, rings[1:], [-1], across),
            _block(FACE, rings, [1], across),
            _block(SPINE, rings[1:], sides, spine),
        ]
        names = np.concatenate([name for name, _ in blocks], axis=1)
        self.kind, self.ring, self.which, _ = names
        self.place = np.concatenate([place for _, place in blocks])
        names_of_lines = self.kind * 10000 + self.ring * 2 + (self.which > 0)
        self.lines = Lines(names_of_lines, self.place, shift)
        number = {name: row for row, name in enumerate(zip(*names.tolist(), strict=True))}
        # The other end of the tube before the first notch is hidden: its sides give the inside.
        hidden = number[SIDE, 0, -1, 0]
        self._across = np.array([number.get((k, r, -w, p), hidden) for k, r, w, p in number])
        self._facing = np.array(
            [number.get((k, r + w, -w, p), -1) if k == FACE else -1 for k, r, w, p in number]
        )

    def outline(self, numbers: Numbers) -> Outline:
        """Return the outline of views and angles.

        Args:
            numbers: Numbers of `VIEW`, angles (rad) and, where notches are measured, their
                lengths (mm), (b, NUMBERS + n) or (b, NUMBERS + 4 n + 1).
        """
        view = View(np.atleast_2d(numbers), self.table.notches)
        start, turned = self.table.poses(view.angles)
        point = np.zeros((len(view.angles), len(self.kind), 3))
        tangent = np.zeros_like(point)
        for part, positions in (
            (self.kind == SIDE, self._sides),
            (self.kind == FACE, self._faces),
            (self.kind == SPINE, self._spines),
        ):
            point[:, part], tangent[:, part] = positions(view, start, turned, part)
        projected = view.seen(point)
        along = (view.seen(point[:1] + 1e-4 * tangent[:1]) - projected[:1])[0]
        length = np.maximum(np.linalg.norm(along, axis=1, keepdims=True), 1e-12)
        normal = np.stack([-along[:, 1], along[:, 0]], axis=1) / length
        return Outline(projected, *self._oriented(projected[0], normal, view))

    def _oriented(self, projected: Numbers, normal: Numbers, view: View) -> tuple[Numbers, ...]:
        """Turn normals outward; find the room outside and the breadth inside of each point."""
        inward = ((projected[self._across] - projected) * normal).sum(axis=1)
        outward = -np.sign(inward)
        normal = normal * np.where(outward == 0.0, 1.0, outward)[:, None]
        room = np.full(len(projected), np.inf)
        has = self._facing >= 0
        room[has] = ((projected[self._facing[has]] - projected[has]) * normal[has]).sum(axis=1)
        return normal, room, np.abs(inward)

    def _sides(
        self, view: View, start: Numbers, turned: Numbers, part: NDArray[np.bool_]
    ) -> tuple[Numbers, Numbers]:
        ring = self.ring[part]
        begin, end = self._ends(view)
        first, last = begin[:, ring], end[:, ring]
        frame = Frame(view, start[:, ring], turned[:, ring])
        centre = frame.on_axis(first + (last - first) * self.place[part])
        lateral, _ = frame.lateral(centre)
        across = self.table.outer * self.which[part]
        return centre + across[:, None] * lateral, frame.axis

    def _ends(self, view: View) -> tuple[Numbers, Numbers]:
        """Return where the rings begin and end, along each from its start, mm, (b, n + 1)."""
        n, half = self.table.notches, 0.5 * view.kerf
        begin = np.full((len(half), n + 1), -BASE * self.table.outer)
        begin[:, 1:] = half + view.moved[:, :n]
        end = np.append(0.0, self.table.uncut) + view.moved
        end[:, :n] -= half
        return begin, end

    def _faces(
        self, view: View, start: Numbers, turned: Numbers, part: NDArray[np.bool_]
    ) -> tuple[Numbers, Numbers]:
        ring, which = self.ring[part], self.which[part]
        n = self.table.notches
        begin, end = self._ends(view)
        frame = Frame(view, start[:, ring], turned[:, ring])
        centre = frame.on_axis(np.where(which > 0, end[:, ring], begin[:, ring]))
        lateral, toward = frame.lateral(centre)
        notch = np.clip(np.where(which > 0, ring, ring - 1), 0, n - 1)
        tip = (which > 0) & (ring == n)
        side = self.table.side[notch]
        # The part of an end beside the notch; the whole end at the tip.
        edge = self._spine_edge(view, lateral, frame, notch)
        r = self.table.outer
        low = np.where(tip, -0.9 * r, np.minimum(edge * side + self.corner * r, 0.8 * r))
        q = side * (low + (0.92 * r - low) * self.place[part]) / r
        depth = np.sqrt(1.0 - q**2)
        # The half of the circle that bulges out of the ring.
        tilt = dot(frame.axis, view.ray(centre))
        sign = np.where(tilt * which > 0.0, 1.0, -1.0)
        point = centre + r * (q[..., None] * lateral + (sign * depth)[..., None] * toward)
        tangent = depth[..., None] * lateral - (sign * q)[..., None] * toward
        return point, tangent

    def _spines(
        self, view: View, start: Numbers, turned: Numbers, part: NDArray[np.bool_]
    ) -> tuple[Numbers, Numbers]:
        notch, which, place = self.ring[part] - 1, self.which[part], self.place[part]
        before, after = start[:, notch].copy(), start[:, notch + 1]
        uncut = np.append(0.0, self.table.uncut)[notch]
        angle0 = turned[:, notch]
        before = before + np.stack([np.sin(angle0), np.cos(angle0)], -1) * uncut[:, None]
        bend = turned[:, notch + 1] - angle0
        chord = np.linalg.norm(after - before, axis=-1)
        middle = 0.5 * bend
        length = chord / np.sinc(middle / np.pi)
        at = place * bend
        reach = (length * place * np.sinc(0.5 * at / np.pi))[..., None]
        heading = angle0 + 0.5 * at
        corner = before + reach * np.stack([np.sin(heading), np.cos(heading)], axis=-1)
        frame = Frame(view, corner, angle0 + at)
        centre = frame.origin
        lateral, _ = frame.lateral(centre)
        side = self.table.side[notch]
        inner = self._spine_edge(view, lateral, frame, notch)
        across = np.where(which * side < 0.0, -side * self.table.outer, inner)
        return centre + across[..., None] * lateral, frame.axis

    def _spine_edge(
        self, view: View, lateral: Numbers, frame: Frame, notch: NDArray[np.int_]
    ) -> Numbers:
        """Return where the inner edge of a spine is seen, along `lateral` from the axis, mm."""
        side = self.table.side[notch]
        x = dot(lateral, frame.x) * side
        y = np.abs(dot(lateral, view.y[:, None]))
        return side * spine_edge(self.table, notch, view.cut[:, notch], x, y)


def spine_edge(
    table: ChainTable, notch: NDArray[np.int_], cut: Numbers, x: Numbers, y: Numbers
) -> Numbers:
    """Return how high over the axis, toward the notch, the inner edge of a spine is seen, mm.

    Args:
        table: The robot.
        notch: Which notches, from 0.
        cut: What they are deeper than in the robot file, mm.
        x: Cosine of the roll, the component of the side of the notch across the line of sight.
        y: Sine of the roll, not negative.
    """
    outer = table.outer
    depth = np.clip(table.depth[notch] + cut, 0.02 * outer, 1.98 * outer)
    cosine = (depth - outer) / outer
    high = -np.inf
    for radius in (outer, table.inner):
        cos = np.where(table.radial[notch], cosine, np.clip(cosine * outer / radius, -1.0, 1.0))
        high = np.maximum(high, radius * (-cos * x + np.sqrt(1.0 - cos**2) * y))
    return high


def _block(
    kind: int, rings: NDArray[np.int_], which: list[int], place: Numbers
) -> tuple[NDArray[np.int_], Numbers]:
    """Return kind, ring, side and number of all points of a kind, (4, N), and their places."""
    grid = np.meshgrid([kind], rings, which, np.arange(len(place)), indexing="ij")
    names = np.reshape(grid, (4, -1))
    return names, place[names[3]]


_ROLL = math.radians(5.0)  # of starts: views that are rolled a little are found from there


def axis_points(table: ChainTable, numbers: Numbers) -> Numbers:
    """Return points on the tube axis, px from the middle of the photograph, (n + 2, 2).

    One on the tube before the first notch, one where that notch starts, and the end of every body
    behind a notch; the last one is the tip.

    Args:
        table: The robot of n notches.
        numbers: Numbers of `VIEW` and angles (rad).
    """
    view = View(numbers[None], table.notches)
    start, turned = table.poses(view.angles)
    bodies = np.concatenate([[0], np.arange(table.notches + 1)])
    along = np.concatenate([[-BASE * table.outer, 0.0], table.uncut])
    frame = Frame(view, start[:, bodies], turned[:, bodies])
    return view.seen(frame.on_axis(along))[0]


def on_axis_points(table: ChainTable, points: Numbers) -> list[Numbers]:
    """Return view and angles of chains whose axis lies on points, the better one first.

    In one the first notch is cut on the right of the way from base to tip, in the other on the
    left.

    Args:
        table: The robot of n notches.
        points: Points on the tube axis as of `axis_points`, px from the middle, (n + 2, 2).

    Raises:
        InputError: There are not n + 2 points, one is not finite, or they lie in one place.
    """
    points = np.asarray(points, float)
    if points.shape != (table.notches + 2, 2) or not np.isfinite(points).all():
        raise InputError.OUT_OF_RANGE(
            f"a chain of {table.notches} notches has {table.notches + 2} finite points (x, y); got "
            f"{points.tolist()}"
        )
    steps = np.diff(points, axis=0)
    length = float(np.linalg.norm(steps, axis=1).sum())
    if length < 1.0:
        raise InputError.OUT_OF_RANGE(
            "the points of the chain lie in one place; drag them along the robot"
        )
    scale = length / (table.length + BASE * table.outer)
    heading = np.unwrap(np.arctan2(steps[:, 1], steps[:, 0]))
    candidates: list[tuple[float, Numbers]] = []
    for side, roll in ((1.0, _ROLL), (-1.0, math.pi + _ROLL)):
        view = [0.0, 0.0, 0.0, 0.0, roll, 0.0, 0.003 / table.outer, 0.0, 0.0]
        first = np.clip(side * np.diff(heading) * table.side, MIN_ANGLE, MAX_ANGLE)
        start = np.array([*points[1], heading[0], math.log(scale), *first])
        free = [0, 1, 2, 3, *range(NUMBERS, NUMBERS + table.notches)]
        numbers = np.array([*view, *first])

        def off(values: Numbers, numbers: Numbers = numbers, free: list[int] = free) -> Numbers:
            numbers[free] = values
            return (axis_points(table, numbers) - points).ravel()

        bound = np.full(len(start), np.inf)
        bound[4:] = MAX_ANGLE
        lower = np.full(len(start), -np.inf)
        lower[4:] = MIN_ANGLE
        solved = least_squares(off, start, bounds=(lower, bound), x_scale="jac", max_nfev=60)
        numbers[free] = solved.x
        candidates.append((float(solved.cost), numbers))
    return [numbers for _, numbers in sorted(candidates, key=lambda one: one[0])]


def straight_chain(table: ChainTable, width: int, height: int) -> Numbers:
    """Return the points of a straight chain in the middle of a photograph, px, (n + 2, 2).

    Args:
        table: The robot of n notches.
        width: Width of the photograph, px.
        height: Its height, px.
    """
    numbers = np.zeros(NUMBERS + table.notches)
    numbers[2], numbers[3] = math.pi / 2.0, math.log(0.6 * height / table.length)
    points = axis_points(table, numbers)
    return points - points.mean(axis=0) + np.array([width - 1.0, height - 1.0]) / 2.0
