"""Points on the tube axis, given by their distance from the base on the straight robot.

A point on a rigid piece moves with it. Across a notch the axis is a cubic from face to face, at
right angles to both. Where the two faces lie on one arc, the length of its tangents fits it to the
arc within 5e-6 of its radius up to 45 degrees. It depends only on the poses of the bodies.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import lru_cache
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from jaxtyping import Array, Float, Int
from numpy.typing import ArrayLike, NDArray

from notchflex._arrays import xp
from notchflex._jax import constant
from notchflex.analysis.kinematics import bodies_from_angles
from notchflex.errors import InputError
from notchflex.mechanics.chain.mass import body_lengths
from notchflex.robot import Robot

if TYPE_CHECKING:
    from notchflex.results.path import EquilibriumPath

# Tolerance of a position beyond the robot, relative to its length, for rounded tips.
_BEYOND = 1e-6
# Its square is far below rounding, its product with a change of any size is no denormal.
_COMPLEX_STEP = 1e-30


class AxisPlaces(NamedTuple):
    """Positions of m points on a straight robot of n notches.

    Attributes:
        body: The body that each point is on, or the one before its notch, (m,).
        along: Its distance from that body's proximal face along the axis, mm, (m,).
        after: The body beyond its notch, or any other where it is on a body, (m,).
        length: Length of the body before, mm, (m,).
        fraction: Position across its notch, 0 to 1; -1 where it is on a body, (m,).
    """

    body: Int[np.ndarray, " m"]
    along: Float[np.ndarray, " m"]
    after: Int[np.ndarray, " m"]
    length: Float[np.ndarray, " m"]
    fraction: Float[np.ndarray, " m"]


def axis_places(robot: Robot, axis_at: ArrayLike) -> AxisPlaces:
    """Locate points on the axis of the straight robot.

    Args:
        robot: The robot.
        axis_at: Distances from the base when the robot is straight, mm, (m,).

    Returns:
        The positions, for `points_on_axis`.

    Raises:
        InputError: A distance is not finite, negative or beyond the tip.

    Example:
        >>> from notchflex import load_robot
        >>> axis_places(load_robot("pacheco2021-a"), [0.4, 1.3]).fraction.round(9).tolist()
        [0.5, -1.0]
    """
    at = np.atleast_1d(np.asarray(axis_at, float))
    start, length = _straight(robot)
    tip = float(start[-1] + length[-1])
    wrong = at[~((at >= -_BEYOND * tip) & (at <= (1.0 + _BEYOND) * tip))]
    if len(wrong):
        raise InputError.OUT_OF_RANGE(
            f"there is no point on the axis {wrong[0]:g} mm from the base: {robot.name} is "
            f"{tip:.6g} mm long; give 0 to {tip:.6g} mm"
        )
    # A point on a face belongs to the body, in spite of rounding.
    body = np.searchsorted(start - _BEYOND * tip, at, side="right") - 1
    body = np.maximum(body, 0)
    along = at - start[body]
    after = np.minimum(body + 1, len(start) - 1)
    gap = start[after] - start[body] - length[body]
    across = along - length[body]
    inside = (after > body) & (across > _BEYOND * tip) & (gap > 0.0)
    fraction = np.where(inside, across / np.where(gap > 0.0, gap, 1.0), -1.0)
    return AxisPlaces(body, along, after, length[body], fraction)


@lru_cache(maxsize=8)
def _straight(
    robot: Robot,
) -> tuple[Float[np.ndarray, " bodies"], Float[np.ndarray, " bodies"]]:
    """Return start and length of the bodies of the straight robot, mm."""
    straight, _ = bodies_from_angles(robot, np.zeros((1, robot.number_of_notches)))
    return straight[0, :, 2], body_lengths(robot.tube, robot.notches)


def points_on_axis(
    positions: AxisPlaces,
    body_position: Float[Array, "*s bodies 3"],
    body_rotation: Float[Array, "*s bodies 3 3"],
) -> Float[Array, "*s m 3"]:
    """Return points on the axis of a bent robot.

    Args:
        positions: Their positions on the straight robot.
        body_position: Origins of the bodies, base first, mm; plain or traced numbers.
        body_rotation: Their rotations.

    Returns:
        The points, mm, in the frame in which the bodies are given.

    Example:
        >>> from notchflex import load_robot
        >>> robot = load_robot("pacheco2021-a")
        >>> bodies = bodies_from_angles(robot, np.zeros((1, 5)))
        >>> points_on_axis(axis_places(robot, [0.4, 9.0]), *bodies)[0, :, 2].round(9).tolist()
        [0.4, 9.0]
    """
    axis = body_rotation[..., :, 2]
    first, last = axis[..., positions.body, :], axis[..., positions.after, :]
    origin = body_position[..., positions.body, :]
    on_body = origin + positions.along[..., None] * first
    near = origin + positions.length[..., None] * first
    far = body_position[..., positions.after, :]
    inside = positions.fraction >= 0.0
    # Length of the tangents: 2 c / (1 + cos(turn / 2)) with the chord c, which makes the cubic meet
    # an arc in the middle too. Where a point is on a body there may be no chord.
    chord = xp.where(inside[:, None], far - near, np.ones(3))
    between = xp.where(inside, xp.sum(first * last, axis=-1), 1.0)
    half = xp.sqrt(0.5 * (1.0 + between))
    reach = (2.0 * xp.sqrt(xp.sum(chord**2, axis=-1)) / (1.0 + half))[..., None]
    u = xp.where(inside, positions.fraction, 0.0)[:, None]
    across = (
        (1.0 + 2.0 * u) * (1.0 - u) ** 2 * near
        + u**2 * (3.0 - 2.0 * u) * far
        + reach * (u * (1.0 - u) ** 2 * first - u**2 * (1.0 - u) * last)
    )
    return xp.where(inside[:, None], across, on_body)


def axis_point_changes(
    places: AxisPlaces,
    bodies: Sequence[Float[np.ndarray, ...]],
    changes: Sequence[Float[np.ndarray, ...]],
    lengths: Float[np.ndarray, "k bodies"] | float = 0.0,
) -> Float[np.ndarray, "k *s m 3"]:
    """Differentiate the points on the axis along k changes of the bodies.

    By a complex step: `points_on_axis` is analytic, so the derivative is exact to rounding. It
    takes one evaluation; `jax.jvp` takes a compilation for every shape.

    Args:
        places: Where the points lie on the straight robot.
        bodies: Origins of the bodies, mm, (*s, bodies, 3), and their rotations, (*s, bodies, 3, 3).
        changes: Changes of both, with k in front.
        lengths: Changes of the lengths of the bodies; the last point, the tip, moves with its end.

    Returns:
        The changes of the points.

    Example:
        >>> from notchflex import load_robot
        >>> robot = load_robot("pacheco2021-a")
        >>> bodies = [pose[0] for pose in bodies_from_angles(robot, np.zeros((1, 5)))]
        >>> along_z = np.tile([0.0, 0.0, 1.0], (1, 6, 1)), np.zeros((1, 6, 3, 3))
        >>> print(axis_point_changes(axis_places(robot, [0.4]), bodies, along_z)[0, 0].round(9))
        [0. 0. 1.]
    """
    step = _COMPLEX_STEP * 1j
    grown = step * np.broadcast_to(lengths, changes[0].shape[:-1])[..., places.body]
    at_tip = np.arange(len(places.body)) == len(places.body) - 1
    moved = places._replace(along=places.along + at_tip * grown, length=places.length + grown)
    poses = (pose + step * change for pose, change in zip(bodies, changes, strict=True))
    points: Any = points_on_axis(moved, *poses)  # pyright: ignore[reportArgumentType]
    return points.imag / _COMPLEX_STEP


def axis_points(path: EquilibriumPath, axis_at: ArrayLike) -> NDArray[np.float64]:
    """Return points on the tube axis of every state of a path, in the world.

    Args:
        path: The states, s steps.
        axis_at: Distances of the points from the base when the robot is straight, mm, (m,).

    Returns:
        The points, mm, (s, m, 3).

    Raises:
        InputError: A distance is beyond the tip.

    Example:
        >>> from notchflex import load_robot, pull, simulate
        >>> path = simulate(load_robot("pacheco2021-a"), pull(1.0, 1.0, steps=1))
        >>> bool(np.allclose(axis_points(path, [10.0])[0, 0], path.tip_position[0]))
        True
    """
    positions = axis_places(path.robot, axis_at)
    return np.asarray(
        points_on_axis(positions, constant(path.body_position), constant(path.body_rotation))
    )
