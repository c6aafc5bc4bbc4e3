"""What a design reads of a solved robot: quantities and target curves, with slopes."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
from jaxtyping import Float
from scipy.interpolate import CubicSpline

from notchflex import Robot
from notchflex.analysis.kinematics import axis_places, axis_point_changes, points_on_axis
from notchflex.designing.specification import TargetCurve
from notchflex.support import DEGREES, QUANTITIES

OF_STATES = {
    name: one
    for name, one in QUANTITIES.items()
    if one.kind is float
    and one.title
    and one.source in ("solve", "state", "derived")
    and one.per in ((), ("notch",), ("tendon",), ("axis",))
}
"""Quantities of solved states that can be differentiated."""

CLOSING, COMPLIANCE, CURVE = "closing_tension", "tip_compliance", "curve."


@dataclass(frozen=True)
class OfRobot:
    """A quantity of the robot alone.

    Attributes:
        unit: Its unit.
        title: What it is.
        formula: From a robot to its numbers, in that unit.
        by_notch: Whether there is one for every notch.
    """

    unit: str
    title: str
    formula: Callable[[Robot], Float[np.ndarray, " k"]]
    by_notch: bool = False


def _closed_length(robot: Robot) -> np.ndarray:
    # A closed notch bends about its lips on the outer surface, at the outer radius from the axis.
    geometry = robot.geometry
    travel = geometry.closing_angle - geometry.free_angle
    return np.array([geometry.body_length.sum() + robot.tube.outer_radius * travel.sum()])


def _spine(robot: Robot) -> np.ndarray:
    cuts = [notch.spine_cut for notch in robot.notches]
    return np.array([np.nan if cut is None else robot.tube.outer_diameter - cut[0] for cut in cuts])


OF_ROBOTS: dict[str, OfRobot] = {
    "length": OfRobot(
        "mm", "length of the straight robot", lambda robot: np.array([robot.geometry.length])
    ),
    "closing_angle": OfRobot(
        "deg",
        "angle at which a notch closes",
        lambda robot: DEGREES * robot.geometry.closing_angle,
        True,
    ),
    "closed_length": OfRobot(
        "mm", "length of the tube axis with all notches closed", _closed_length
    ),
    "spine": OfRobot("mm", "width of the spine, outer diameter less depth", _spine, True),
    "web": OfRobot(
        "mm",
        "length of the rigid piece behind a notch",
        lambda robot: robot.geometry.body_length[1:],
        True,
    ),
    "free_bore": OfRobot(
        "mm",
        "diameter of the bore on the axis that is free of tendons",
        lambda robot: (
            2.0 * np.array([min(robot.tube.inner_radius, *(one.radius for one in robot.tendon))])
        ),
    ),
}
"""Quantities of the robot alone, by name."""


def quantity_names() -> list[str]:
    """Return every name that a design file may give as `quantity`, beside paths of robot files."""
    return [*OF_STATES, CLOSING, COMPLIANCE, *OF_ROBOTS]


@dataclass(frozen=True, eq=False)
class Reading:
    """Numbers of a robot, and how they change with what varies.

    Attributes:
        table: A row for every number: the number, then its slopes, none where only values are read.
    """

    table: Float[np.ndarray, "k 1+v"]

    @classmethod
    def of(cls, values: np.ndarray, slopes: Iterable[np.ndarray] = ()) -> Reading:
        """Return a quantity of any shape with its slopes, those by one variable after the other."""
        table = np.stack([values, *slopes])
        return cls(table.reshape(len(table), -1).T)

    @property
    def values(self) -> Float[np.ndarray, " k"]:
        """The numbers."""
        return self.table[:, 0]

    @property
    def slopes(self) -> Float[np.ndarray, "k v"]:
        """Their slopes."""
        return self.table[:, 1:]

    def map(self, matrix: Float[np.ndarray, "m k"]) -> Reading:
        """Return linear combinations."""
        return Reading(matrix @ self.table)

    def pick(self, rows: np.ndarray) -> Reading:
        """Return some of the numbers."""
        return Reading(self.table[rows])

    def scaled(self, factor: float) -> Reading:
        """Return the numbers in another unit."""
        return Reading(factor * self.table)

    def minus(self, other: Reading) -> Reading:
        """Return the difference."""
        return Reading(self.table - other.table)


def taken(reading: Reading, take: str) -> Reading:
    """Make several numbers one; `each` leaves them, `steps` takes each from the next."""
    if take == "each":
        return reading
    return reading.map(np.atleast_2d(_weights(reading.values, take)))


def _weights(values: Float[np.ndarray, " k"], take: str) -> np.ndarray:
    count = len(values)
    unit = np.eye(count)
    match take:
        case "steps":
            return unit[1:] - unit[:-1]
        case "pairs":  # each less every other one
            first, second = np.nonzero(1.0 - unit)
            return unit[first] - unit[second]
        case "sum":
            return np.ones(count)
        case "mean":
            return np.full(count, 1.0 / count)
        case "rms":
            size = np.sqrt(np.mean(values**2))
            return values / (count * size if size > 0.0 else 1.0)
        case "range":
            return unit[np.argmax(values)] - unit[np.argmin(values)]
        case _:
            return unit[np.argmax(values) if take == "largest" else np.argmin(values)]


# Stations of the axis between which the nearest point is searched.
_STATIONS = 481
# Points of a curve that is given by its curvature, and steps of its integration between two.
_POINTS, _FINE = 20, 50
# How far to both sides of a point the direction of the axis is taken, mm.
_ASIDE = 1e-3


def target_points(curve: TargetCurve) -> Float[np.ndarray, "m 3"]:
    """Return the points of a target curve, mm, in the frame of the base."""
    if curve.points is not None:
        return np.array(curve.points)
    given = np.array(curve.curvature)
    s = np.linspace(0.0, given[-1, 0], _POINTS * _FINE + 1)
    curvature = np.interp(s, given[:, 0], given[:, 1])
    # The turning is the exact integral of straight lines; the points follow to 1e-6.
    turning = np.concatenate(
        [[0.0], np.cumsum(np.diff(s) * 0.5 * (curvature[1:] + curvature[:-1]))]
    )
    line = [CubicSpline(s, one).antiderivative()(s) for one in (np.sin(turning), np.cos(turning))]
    points = np.stack([line[0], np.zeros_like(s), line[1]], axis=1)
    return points[_FINE::_FINE]


class Bodies(NamedTuple):
    """Poses of the bodies, or their slopes with what varies as leading axis."""

    position: Float[np.ndarray, "*v bodies 3"]  # mm
    rotation: Float[np.ndarray, "*v bodies 3 3"]


def offsets(
    robot: Robot,
    bodies: Bodies,
    points: Float[np.ndarray, "m 3"],
    slopes: Bodies | None,
    lengths: Float[np.ndarray, "v bodies"],
) -> Reading:
    """Return the vector from each point to the nearest of the axis, from the last one to the tip.

    Args:
        robot: The robot.
        bodies: Where it is.
        points: The points.
        slopes: Slopes of where it is; None for values only.
        lengths: Slopes of the lengths of its bodies.

    Returns:
        The vectors one after the other, mm; their slopes across the axis, as the nearest point
        slides along.
    """
    poses: Any = bodies

    def axis(stations: np.ndarray) -> np.ndarray:
        return np.asarray(points_on_axis(axis_places(robot, stations), *poses))

    stations = np.linspace(0.0, robot.geometry.length, _STATIONS)
    line = axis(stations)
    # The nearest point of each straight piece between two stations, and of these the nearest.
    piece = np.diff(line, axis=0)
    part = np.sum((points[:, None] - line[:-1]) * piece, axis=-1) / np.sum(piece**2, axis=-1)
    part = np.clip(part, 0.0, 1.0)
    far = np.linalg.norm(line[:-1] + part[..., None] * piece - points[:, None], axis=-1)
    place = far.argmin(axis=1), np.arange(len(points))
    nearest = stations[place[0]] + part[place[1], place[0]] * stations[1]
    nearest[-1] = stations[-1]
    off = axis(nearest) - points
    if slopes is None:
        return Reading.of(off)
    before, after = (np.clip(nearest + side, 0.0, stations[-1]) for side in (-_ASIDE, _ASIDE))
    along = axis(after) - axis(before)
    along /= np.linalg.norm(along, axis=1)[:, None]
    along[-1] = 0.0  # the tip does not slide
    moved = axis_point_changes(axis_places(robot, nearest), bodies, slopes, lengths)
    return Reading.of(off, moved - np.sum(moved * along, axis=-1)[..., None] * along)


def distances(off: Reading) -> Reading:
    """Return the lengths of the vectors of `offsets`, mm."""
    vectors = off.values.reshape(-1, 3)
    size = np.linalg.norm(vectors, axis=1)
    toward = vectors / np.where(size > 0.0, size, 1.0)[:, None]
    return Reading(np.einsum("ma,mav->mv", toward, off.table.reshape(len(size), 3, -1)))
