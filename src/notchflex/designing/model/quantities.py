"""What a design reads of a solved robot: quantities and target curves, with slopes."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
from jaxtyping import Float
from scipy.interpolate import CubicSpline

from notchflex import Robot
from notchflex._jax import constant
from notchflex.analysis.kinematics import (
    AxisPlaces,
    axis_places,
    axis_point_changes,
    points_on_axis,
)
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


def edge_unit(name: str) -> tuple[str, float]:
    """Return the unit of a quantity of states at the edges, and the factor to it."""
    one: Any = OF_STATES[name]
    return one.unit, one.scale


class Reading(NamedTuple):
    """Numbers of a robot, and how they change with the variables of a design.

    Attributes:
        values: The numbers, (k,).
        slopes: Their derivatives by every variable, (k, variables); None where not asked.
    """

    values: Float[np.ndarray, " k"]
    slopes: Float[np.ndarray, "k v"] | None

    def map(self, matrix: Float[np.ndarray, "m k"]) -> Reading:
        """Return linear combinations."""
        return Reading(matrix @ self.values, None if self.slopes is None else matrix @ self.slopes)

    def pick(self, rows: np.ndarray) -> Reading:
        """Return some of the numbers."""
        return Reading(self.values[rows], None if self.slopes is None else self.slopes[rows])

    def scaled(self, factor: float) -> Reading:
        """Return the numbers in another unit."""
        return Reading(factor * self.values, None if self.slopes is None else factor * self.slopes)

    def minus(self, other: Reading) -> Reading:
        """Return the difference."""
        slopes = None
        if self.slopes is not None and other.slopes is not None:
            slopes = self.slopes - other.slopes
        return Reading(self.values - other.values, slopes)


def differences(count: int) -> Float[np.ndarray, "m k"]:
    """Return the matrix that takes each number from the next.

    Example:
        >>> differences(3) @ np.array([1.0, 3.0, 7.0])
        array([2., 4.])
    """
    return np.eye(count)[1:] - np.eye(count)[:-1]


def pairs(count: int) -> Float[np.ndarray, "m k"]:
    """Return the matrix that takes each number from every other one.

    Example:
        >>> pairs(2) @ np.array([1.0, 3.0])
        array([-2.,  2.])
    """
    eye = np.eye(count)
    rows = [eye[i] - eye[j] for i in range(count) for j in range(count) if i != j]
    return np.array(rows).reshape(-1, count)


def taken(reading: Reading, take: str) -> Reading:
    """Make several numbers one; `each` leaves them, `steps` takes each from the next."""
    count = len(reading.values)
    if take == "each":
        return reading
    if take == "steps":
        return reading.map(differences(count))
    if take in ("sum", "mean"):
        return reading.map(np.full((1, count), 1.0 if take == "sum" else 1.0 / count))
    if take == "rms":
        size = float(np.sqrt(np.mean(reading.values**2)))
        by = reading.values / (count * size) if size > 0.0 else np.zeros(count)
        slopes = None if reading.slopes is None else by[None] @ reading.slopes
        return Reading(np.array([size]), slopes)
    high, low = int(np.argmax(reading.values)), int(np.argmin(reading.values))
    if take == "range":
        row = np.zeros((1, count))
        row[0, high] += 1.0
        row[0, low] -= 1.0
        return reading.map(row)
    return reading.pick(np.array([high if take == "largest" else low]))


# Points of the axis among which the nearest is searched, and how often the search narrows.
_STATIONS, _ROUNDS = 241, 4
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
    """Poses of the bodies, and their changes with every variable.

    Attributes:
        position: Origins, mm, (bodies, 3).
        rotation: Rotations, (bodies, 3, 3).
        positions: Their changes, (variables, bodies, 3); None where not asked.
        rotations: Changes of the rotations, (variables, bodies, 3, 3).
    """

    position: np.ndarray
    rotation: np.ndarray
    positions: np.ndarray | None = None
    rotations: np.ndarray | None = None


def offsets(
    robot: Robot,
    bodies: Bodies,
    points: Float[np.ndarray, "m 3"],
    lengths: Float[np.ndarray, "variables bodies"] | None,
) -> Reading:
    """Return the vector from each point to the nearest of the axis, from the last one to the tip.

    Args:
        robot: The robot.
        bodies: Where it is.
        points: The points.
        lengths: Changes of the lengths of the bodies with every variable; None for values only.

    Returns:
        The vectors one after the other, mm; their slopes across the axis, as the nearest point
        slides along.
    """
    stations = _nearest(robot, bodies, points)
    places = axis_places(robot, stations)
    off = _axis(places, bodies.position, bodies.rotation) - points
    if lengths is None or bodies.positions is None or bodies.rotations is None:
        return Reading(off.ravel(), None)
    near = np.clip(stations + np.array([[-_ASIDE], [_ASIDE]]), 0.0, stations[-1])
    ends = [_axis(axis_places(robot, at), bodies.position, bodies.rotation) for at in near]
    along = ends[1] - ends[0]
    along /= np.linalg.norm(along, axis=1)[:, None]
    along[-1] = 0.0  # the tip does not slide
    changes = bodies.positions, bodies.rotations
    moved = axis_point_changes(places, bodies[:2], changes, lengths)
    across = moved - np.sum(moved * along, axis=-1)[..., None] * along
    return Reading(off.ravel(), across.reshape(-1, off.size).T)


def distances(off: Reading) -> Reading:
    """Return the lengths of the vectors of `offsets`, mm."""
    vectors = off.values.reshape(-1, 3)
    size = np.linalg.norm(vectors, axis=1)
    if off.slopes is None:
        return Reading(size, None)
    toward = vectors / np.where(size > 0.0, size, 1.0)[:, None]
    slopes = off.slopes.reshape(len(size), 3, -1)
    return Reading(size, np.einsum("ma,mav->mv", toward, slopes))


def _nearest(
    robot: Robot, bodies: Bodies, points: Float[np.ndarray, "m 3"]
) -> Float[np.ndarray, " m"]:
    """Return how far from the base, along the straight robot, the nearest points lie."""
    total = robot.geometry.length
    low, high = np.zeros(len(points)), np.full(len(points), total)
    for number in range(_ROUNDS):
        count = _STATIONS if number == 0 else 21
        part = np.linspace(0.0, 1.0, count)
        at = low[:, None] + part * (high - low)[:, None]
        every = at[0] if number == 0 else at.ravel()
        axis = _axis(axis_places(robot, every), bodies.position, bodies.rotation)
        axis = np.broadcast_to(axis.reshape(-1, count, 3), (len(points), count, 3))
        best = np.argmin(np.sum((axis - points[:, None]) ** 2, axis=-1), axis=1)
        rows = np.arange(len(points))
        low, high = at[rows, np.maximum(best - 1, 0)], at[rows, np.minimum(best + 1, count - 1)]
    nearest = 0.5 * (low + high)
    nearest[-1] = total
    return nearest


def _axis(places: AxisPlaces, position: np.ndarray, rotation: np.ndarray) -> np.ndarray:
    return np.asarray(points_on_axis(places, constant(position), constant(rotation)))
