"""Target curves: their points, and how far these are from the axis of a bent robot."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from jaxtyping import Float
from scipy.interpolate import CubicSpline

from notchflex._jax import constant
from notchflex.analysis.axis_points import (
    AxisPlaces,
    axis_places,
    axis_point_changes,
    points_on_axis,
)
from notchflex.designing.model.reading import Reading
from notchflex.designing.specification.asked import TargetCurve
from notchflex.robot import Robot

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
    total = float(_length(robot))
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


def _length(robot: Robot) -> float:
    from notchflex.designing.model.quantities import OF_ROBOTS

    return float(OF_ROBOTS["length"].formula(robot)[0])
