"""Points on the tube axis: straight on a straight robot, on the arc of a bent notch."""

from __future__ import annotations

import numpy as np
import pytest

import notchflex as nf
from notchflex._jax import jax, jnp
from notchflex.analysis import axis_places, axis_points, bodies_from_angles, points_on_axis
from notchflex.analysis.kinematics import axis_point_changes
from notchflex.errors import ErrorCode
from refusals import refused

ROBOTS = ("pacheco2021-a", "liu2022", "gao2017", "two-axis-wrist")


def bent(name: str, angle: float):
    robot = nf.load_robot(name)
    angles = np.full((1, robot.number_of_notches), angle)
    return robot, bodies_from_angles(robot, angles)


def length_of(robot: nf.Robot) -> float:
    return float(nf.tip_from_angles(robot, np.zeros((1, robot.number_of_notches)))[0][0, 2])


@pytest.mark.parametrize("name", ["pacheco2021-a", "liu2022"])
def test_straight_robots_have_straight_points(name):
    robot, bodies = bent(name, 0.0)
    at = np.linspace(0.0, length_of(robot), 301)
    points = points_on_axis(axis_places(robot, at), *bodies)[0]
    np.testing.assert_allclose(points[:, 2], at, atol=1e-12)
    np.testing.assert_allclose(points[:, :2], 0.0, atol=1e-12)


@pytest.mark.parametrize("name", ROBOTS)
def test_bent_robots_have_one_smooth_line(name):
    angle = 0.01
    robot, bodies = bent(name, angle)
    length = length_of(robot)
    at = np.linspace(0.0, length, 2001)
    points = points_on_axis(axis_places(robot, at), *bodies)[0]
    steps = np.diff(points, axis=0)
    pace = np.linalg.norm(steps, axis=1) / np.diff(at)
    # No jump anywhere, and the length of the straight robot but for what its neutral axes lie off
    # the tube axis: ybar theta of a notch of Pacheco's, 0.9 %.
    assert (np.abs(pace - 1.0) < 0.01).all()
    # At right angles to the faces; the next body of a link or a strip is swung aside as well, so
    # that the line turns there and back within an opening, up to 7.5 times as fast as an arc.
    direction = steps / np.linalg.norm(steps, axis=1)[:, None]
    turn = np.linalg.norm(np.diff(direction, axis=0), axis=1)
    assert turn.max() < 8.0 * angle * (at[1] - at[0]) / _smallest_notch(robot)
    tip, _ = nf.tip_from_angles(robot, np.full((1, robot.number_of_notches), angle))
    np.testing.assert_allclose(points[-1], tip[0], atol=1e-12)


def _smallest_notch(robot: nf.Robot) -> float:
    return min(notch.height for notch in robot.notches)


@pytest.mark.parametrize("degrees", [5.0, 30.0, 45.0])
def test_an_arc_notch_is_followed_within_what_is_said(degrees):
    angle = np.radians(degrees)
    robot = nf.load_robot("pacheco2021-a")
    bodies = bodies_from_angles(robot, np.full((1, 5), angle))
    part = np.linspace(0.02, 0.98, 49)
    first = points_on_axis(axis_places(robot, 0.8 * part), *bodies)[0]
    # Pacheco 2021, eq. 1-3: s = h - ybar theta on the tube axis, radius s / theta.
    ybar = nf.annular_sector(0.81, 0.70, 1.40).centroid
    radius = (0.8 - ybar * angle) / angle
    off = np.hypot(first[:, 0] - radius, first[:, 2]) - radius
    assert np.abs(off).max() < 5e-6 * radius
    # and the points move along it evenly, to a hundredth of a notch at 45 degrees
    along = np.arctan2(first[:, 2], radius - first[:, 0]) / angle
    assert np.abs(along - part).max() < 4e-3 * (degrees / 45.0) ** 2


def test_points_turn_with_the_base():
    robot = nf.load_robot("pacheco2021-a")
    at = [0.0, 0.3, 5.0, 10.0]
    load = nf.Load(tension=1.0)
    turned = nf.Load(tension=1.0, base_rotation=(0.0, 0.0, np.pi / 2))
    plain = axis_points(nf.simulate(robot, [load]), at)
    other = axis_points(nf.simulate(robot, [turned]), at)
    about_z = np.array([[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]])
    np.testing.assert_allclose(other, plain @ about_z.T, atol=1e-9)


def test_changes_are_those_of_jax():
    robot, bodies = bent("liu2022", 0.3)
    places = axis_places(robot, np.linspace(0.0, length_of(robot), 40))
    poses = [np.asarray(one)[0] for one in bodies]
    random = np.random.default_rng(2)
    changes = [random.normal(size=(3, *one.shape)) for one in poses]
    lengths = random.normal(size=(3, len(poses[0])))
    tip = np.arange(40) == 39

    def points(position, rotation, longer):
        more = longer[places.body]
        moved = places._replace(length=places.length + more, along=places.along + tip * more)
        return points_on_axis(moved, position, rotation)

    start = (*map(jnp.asarray, poses), jnp.zeros(len(poses[0])))
    found = axis_point_changes(places, poses, changes, lengths)
    for one, *moves in zip(found, *changes, lengths, strict=True):
        expected = jax.jvp(points, start, tuple(map(jnp.asarray, moves)))[1]
        np.testing.assert_allclose(one, expected, atol=1e-13 * np.abs(expected).max())


@pytest.mark.parametrize("wrong", [-0.1, 10.1, np.nan, np.inf])
def test_places_beyond_the_robot_are_refused(wrong):
    with refused(ErrorCode.OUT_OF_RANGE):
        axis_places(nf.load_robot("pacheco2021-a"), [1.0, wrong])
