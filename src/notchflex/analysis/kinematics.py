"""Kinematics without forces: the tip of given notch angles, and the kinematic model of a stroke."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from jaxtyping import Array, Float, Int
from numpy.typing import ArrayLike, NDArray

from notchflex._arrays import xp
from notchflex._jax import constant, jax, jit, jnp
from notchflex.errors import InputError
from notchflex.mechanics.chain import Chain, assemble
from notchflex.mechanics.flexure import relative_pose
from notchflex.mechanics.motion import Motion
from notchflex.robot import Robot
from notchflex.solver.programs.prepare import prepare
from notchflex.solver.residual import body_poses

if TYPE_CHECKING:
    from notchflex.results.path import EquilibriumPath

Numbers = NDArray[np.float64]
"""Numbers of any shape."""


def bodies_from_angles(robot: Robot, notch_angle: Numbers) -> tuple[Numbers, Numbers]:
    """Return the poses of all bodies for given notch angles (Pacheco 2021, eq. 1-2).

    Args:
        robot: The robot, n notches.
        notch_angle: Angle of every notch, base to tip, precurvature included, rad, (s, n).

    Returns:
        Origins (mm, (s, n + 1, 3)) and rotations ((s, n + 1, 3, 3)) of the bodies, base first,
        in the frame of the base.

    Raises:
        InputError: Not one finite angle per notch.

    Example:
        >>> from notchflex import load_robot
        >>> position, _ = bodies_from_angles(load_robot("pacheco2021-a"), np.zeros((1, 5)))
        >>> position[0, :, 2].round(9).tolist()
        [0.0, 0.8, 2.8, 4.8, 6.8, 8.8]
    """
    angles = np.atleast_2d(np.asarray(notch_angle, float))
    if angles.ndim != 2 or angles.shape[1] != robot.number_of_notches:
        raise InputError.WRONG_SHAPE(
            f"{robot.name} has {robot.number_of_notches} notches; got angles of shape "
            f"{np.shape(notch_angle)}, give one column per notch"
        )
    if not np.isfinite(angles).all():
        raise InputError.NOT_FINITE("a notch angle is not finite; give angles in rad")
    position, rotation = _bodies(prepare(robot, flat=False).chain, angles)
    return np.asarray(position), np.asarray(rotation)


def tip_from_angles(robot: Robot, notch_angle: Numbers) -> tuple[Numbers, Numbers]:
    """Return the tip pose for given notch angles (Pacheco 2021, eq. 1-2).

    Args:
        robot: The robot, n notches.
        notch_angle: Angle of every notch, base to tip, precurvature included, rad, (s, n).

    Returns:
        Tip position on the tube axis (mm, (s, 3)) and tip rotation ((s, 3, 3)), in the frame
        of the base.

    Raises:
        InputError: Not one finite angle per notch.

    Example:
        >>> from notchflex import load_robot
        >>> position, _ = tip_from_angles(load_robot("pacheco2021-a"), np.zeros((1, 5)))
        >>> position.round(9).tolist()
        [[0.0, 0.0, 10.0]]
    """
    position, rotation = bodies_from_angles(robot, notch_angle)
    along = rotation[:, -1, :, 2] * robot.notches[-1].spacing(None)
    return position[:, -1] + along, rotation[:, -1]


@jit
def _bodies(chain: Chain, angles: Float[Array, "s n"]) -> tuple[Array, Array]:
    rods = chain.rods
    # The first mode of a notch turns its distal body by its amplitude, from the free notch on.
    free = jnp.sum(rods.length * rods.reference_strain[..., 1], axis=-1)

    def shape(angle: Float[Array, " n"]) -> Motion:
        modes = jnp.zeros_like(chain.stiffness).at[:, 0].set(angle - free)
        return body_poses(jax.vmap(relative_pose)(rods, modes))

    poses: Motion = jax.lax.map(shape, angles)
    return poses.translation, poses.rotation


class SharedStroke(NamedTuple):
    """Notch angles and lost stroke of the kinematic model.

    Attributes:
        notch_angle: Angle of every notch, base to tip, rad, (s, n).
        stroke_lost: Part of the stroke that closed notches do not take up, mm, (s,).
    """

    notch_angle: Numbers
    stroke_lost: Numbers


def equal_stroke(robot: Robot, stroke: Numbers) -> SharedStroke:
    """Share a stroke equally between all notches: the kinematic model of Pacheco 2021, eq. 1-3.

    Every notch bends by its share over its moment arm r_i + ybar, from its precurvature on and
    at most until it closes; the rest of its share is lost. No force, material or friction
    enters; it is the paper's model (iii), for comparison.

    Args:
        robot: A robot whose first tendon runs along the wall.
        stroke: Tendon drawn out at the base, mm, (s,).

    Returns:
        Notch angles and lost stroke; there is always an answer.

    Raises:
        InputError: The first tendon does not run along the wall over every notch toward its
            bend, or a stroke is not finite.

    Example:
        >>> from notchflex import load_robot
        >>> shared = equal_stroke(load_robot("pacheco2021-a"), np.array([0.25, 4.0]))
        >>> print(f"{np.degrees(shared.notch_angle[0, 0]):.8f} deg, {shared.stroke_lost[1]:.3f} mm")
        2.06615233 deg, 0.294 mm
    """
    strokes = np.atleast_1d(np.asarray(stroke, float))
    if not np.isfinite(strokes).all():
        raise InputError.NOT_FINITE("a stroke is not finite; give strokes in mm")
    chain = assemble(robot, flat=False)
    first = next(group for group in chain.groups if 0 in group.numbers)
    if first.fibre is None:
        raise InputError.UNSUPPORTED(
            'the kinematic model needs a first tendon with path = "wall-arc"; '
            f"that of {robot.name} has another: leave the model out, or set tendon[1].path"
        )
    column = first.numbers.index(0)
    arm = np.asarray(first.fibre[:, column, 0])
    if not (np.asarray(first.present[:, column]) * arm > 0.0).all():
        raise InputError.UNSUPPORTED(
            "the kinematic model needs a first tendon that crosses every notch on the side to "
            f"which it bends; that of {robot.name} does not"
        )
    share = strokes[:, None] / chain.flexures
    free, closing = robot.geometry.free_angle, robot.geometry.closing_angle
    angle = np.clip(free + share / arm, free, closing)
    lost = np.maximum(share - arm * (angle - free), 0.0)
    # A share that is taken up completely loses nothing, whatever rounding says.
    lost = np.where(angle < closing, 0.0, lost)
    return SharedStroke(angle, lost.sum(axis=1))


# Points on the tube axis, given by their distance from the base on the straight robot.
#
# A point on a rigid piece moves with it. Across a notch the axis is a cubic from face to face, at
# right angles to both. Where the two faces lie on one arc, the length of its tangents fits it to
# the arc within 5e-6 of its radius up to 45 degrees. It depends only on the poses of the bodies.

# Tolerance of a position beyond the robot, relative to its length, for rounded tips.
_BEYOND = 1e-6
# Its square is far below rounding, its product with a change of any size is no denormal.
_COMPLEX_STEP = 1e-30


class AxisPlaces(NamedTuple):
    """Positions of m points on a straight robot."""

    body: Int[np.ndarray, " m"]  # that each is on, or the one before its notch
    along: Float[np.ndarray, " m"]  # distance from that body's proximal face, mm
    after: Int[np.ndarray, " m"]  # the body beyond its notch
    length: Float[np.ndarray, " m"]  # of the body before, mm
    fraction: Float[np.ndarray, " m"]  # across the notch, 0 to 1; -1 on a body


def axis_places(robot: Robot, axis_at: ArrayLike) -> AxisPlaces:
    """Locate points on the axis of the straight robot by their distances from the base, mm."""
    distance = np.atleast_1d(np.asarray(axis_at, float))
    start, length = robot.geometry.body_start, robot.geometry.body_length
    tip = robot.geometry.length
    wrong = distance[~((distance >= -_BEYOND * tip) & (distance <= (1.0 + _BEYOND) * tip))]
    if len(wrong):
        raise InputError.OUT_OF_RANGE(
            f"there is no point on the axis {wrong[0]:g} mm from the base: {robot.name} is "
            f"{tip:.6g} mm long; give 0 to {tip:.6g} mm"
        )
    # A point on a face belongs to the body, in spite of rounding.
    body = np.searchsorted(start - _BEYOND * tip, distance, side="right") - 1
    body = np.maximum(body, 0)
    along = distance - start[body]
    after = np.minimum(body + 1, len(start) - 1)
    gap = start[after] - start[body] - length[body]
    across = along - length[body]
    inside = (after > body) & (across > _BEYOND * tip) & (gap > 0.0)
    fraction = np.where(inside, across / np.where(gap > 0.0, gap, 1.0), -1.0)
    return AxisPlaces(body, along, after, length[body], fraction)


def points_on_axis(
    positions: AxisPlaces,
    body_position: Float[Array, "*s bodies 3"],
    body_rotation: Float[Array, "*s bodies 3 3"],
) -> Float[Array, "*s m 3"]:
    """Return points on the axis of a bent robot, mm, in the frame of its bodies."""
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
    """Differentiate the points on the axis along k changes of the bodies and of their lengths."""
    # By a complex step: `points_on_axis` is analytic, so the derivative is exact to rounding. It
    # takes one evaluation; `jax.jvp` takes a compilation for every shape.
    step = _COMPLEX_STEP * 1j
    grown = step * np.broadcast_to(lengths, changes[0].shape[:-1])[..., places.body]
    at_tip = np.arange(len(places.body)) == len(places.body) - 1
    moved = places._replace(along=places.along + at_tip * grown, length=places.length + grown)
    poses = (pose + step * change for pose, change in zip(bodies, changes, strict=True))
    points: Any = points_on_axis(moved, *poses)  # pyright: ignore[reportArgumentType]
    return points.imag / _COMPLEX_STEP


def axis_points(path: EquilibriumPath, axis_at: ArrayLike) -> Numbers:
    """Return points on the tube axis by their distances, mm, in every state, in the world."""
    positions = axis_places(path.robot, axis_at)
    return np.asarray(
        points_on_axis(positions, constant(path.body_position), constant(path.body_rotation))
    )
