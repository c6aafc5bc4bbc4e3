"""The solid of a bent robot: every point of the straight one moves with the model.

A point of a flexure moves with the section of the rod that it lies in, from its place in the
straight tube to that in the state; all others move with their rigid body. The triangles stay those
of the straight solid, refined, so that the surface stays closed.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from notchflex.export.cuts import RobotCuts
from notchflex.plotting.shapes.interpolation import rotation_of
from notchflex.plotting.shapes.robot_shape import RobotShape, shape_at, shape_from_angles

if TYPE_CHECKING:
    from manifold3d import Manifold

    from notchflex.export.document import Subject

Points = NDArray[np.float64]

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
        before = int(np.clip(np.searchsorted(self.places, height) - 1, 0, len(self.places) - 2))
        step = self.places[before + 1] - self.places[before]
        part = float(np.clip((height - self.places[before]) / step, 0.0, 1.0))
        first, second = self.turns[before], self.turns[before + 1]
        turn = first @ rotation_of(part * Rotation.from_matrix(first.T @ second).as_rotvec())
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


def is_bent(subject: Subject) -> bool:
    """Return whether the robot of a solid is bent, under loads or without any."""
    curved = any(notch.precurvature_deg for notch in subject.robot.notches)
    return subject.path is not None or curved


def state_shape(subject: Subject, pieces: int = PIECES) -> RobotShape:
    """Return the shape of a robot in its state, without loads where there is none."""
    if subject.path is not None:
        return shape_at(subject.path, subject.step, pieces)
    free = np.radians([notch.precurvature_deg for notch in subject.robot.notches])
    return shape_from_angles(subject.robot, free, pieces)


class DeformationMap:
    """Map from points of the straight tube to their positions in a state."""

    def __init__(self, subject: Subject, cuts: RobotCuts) -> None:
        """Take the shapes of the straight tube and of the state."""
        robot = subject.robot
        level = "tendons" if subject.path is None else subject.path.chain.level
        straight = np.zeros(robot.number_of_notches)
        rest = shape_from_angles(robot, straight, PIECES, level)
        self.shape = state_shape(subject)
        self.zones = [
            _zone(rest, self.shape, cuts, notch) for notch in range(robot.number_of_notches)
        ]
        turns = self.shape.rotation @ np.swapaxes(rest.rotation, 1, 2)
        self._bodies = turns, self.shape.position - _turned(turns, rest.position)

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
    if float(np.asarray(rest.chain.rods.has_closure)[notch]) > 0.0:  # a spine along the tube
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
