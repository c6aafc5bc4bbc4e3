"""The total angle is one continuous, signed number; the angle between two axes is another."""

from __future__ import annotations

import dataclasses

import jax
import jax.numpy as jnp
import numpy as np
import pytest

import notchflex as nf

PULL = nf.Load(tension=3.0)


def of_notches(wrist: nf.Robot, count: int) -> nf.Robot:
    """Wrist A with another number of notches, pulled at the last body."""
    tendon = dataclasses.replace(wrist.tendon[0], end_body=None)
    return wrist.replace(notch=[wrist.notches[0]] * count, tendon=[tendon])


def seven(wrist: nf.Robot, direction: float, notch: int = 2) -> nf.Robot:
    """Wrist A with seven notches, of which one is cut on another side."""
    return of_notches(wrist, 7).with_value(f"notch[{notch}].direction_deg", direction)


def test_it_does_not_leap_where_a_notch_leaves_the_plane(wrist: nf.Robot):
    """Three tenths of a degree beside the plane changed 214 deg to 146 deg."""
    straight, *beside = (
        nf.solve(seven(wrist, direction), PULL) for direction in (0.0, 0.2, 0.3, 1.0, 3.0)
    )
    assert np.degrees(straight.total_angle) > 210.0
    for state in beside:
        assert abs(state.total_angle - straight.total_angle) < np.radians(0.5)
    axis = beside[-1].tip_rotation[:, 2]
    assert np.isclose(beside[-1].tip_axis_angle, np.arccos(axis[2]), atol=1e-9)


@pytest.mark.parametrize("directions", [(0.0, 0.0, 0.0), (30.0, 210.0, 30.0), (0.0, 180.0, 0.0)])
def test_in_one_plane_it_is_the_sum_to_the_last_digit(wrist: nf.Robot, directions):
    robot = of_notches(wrist, 3)
    robot = robot.with_values((f"notch[{k}].direction_deg", d) for k, d in enumerate(directions, 1))
    load = nf.Load(tip_moment=(0.1, 0.2, 0.0), tip_force=(0.01, 0.0, 0.0))
    for state in (nf.solve(robot, load), nf.solve(robot, nf.Load(tension=0.5))):
        sides = np.where(np.array(directions) == directions[0], 1.0, -1.0)
        total = float(state.notch_angle @ sides)
        assert abs(state.total_angle - total) <= 2.0 * np.spacing(abs(total))  # order of the sum


@pytest.mark.parametrize("base", [(0.0, 0.0, 0.0), (0.3, -1.2, 0.5)])
def test_the_angle_between_the_axes(wrist: nf.Robot, base):
    """Of wrist A it is the total angle up to half a turn, and that of a full turn less beyond."""
    loads = nf.LoadPath(np.linspace(0.0, 3.0, 4)[:, None], np.full((4, 1), np.nan), np.array(base))
    path = nf.simulate(seven(wrist, 0.0), loads)
    total = path.total_angle
    folded = np.minimum(total, 2.0 * np.pi - total)
    assert (total > np.pi).any()
    np.testing.assert_allclose(path.tip_axis_angle, folded, rtol=0, atol=1e-12)
    batch = nf.solve_batch(seven(wrist, 0.0), loads, outputs=("tip_axis_angle", "total_angle"))
    each = nf.solve_each(seven(wrist, 0.0), loads)
    np.testing.assert_allclose(batch["tip_axis_angle"], each.tip_axis_angle, rtol=0, atol=1e-12)


def test_a_wrist_of_two_sides_keeps_its_sign(wrist: nf.Robot):
    """Bent to the other side it has a negative angle, also half a degree beside the plane."""
    robot = of_notches(wrist, 3)
    two_sided = robot.with_value("notch[2].direction_deg", 179.5)
    to_either_side = [
        nf.solve(two_sided, nf.Load(tip_moment=(0.0, moment, 0.0))) for moment in (1.0, -1.0)
    ]
    first, second = (state.total_angle for state in to_either_side)
    assert first > 0.01
    assert second < -0.01


@pytest.mark.nightly
def test_its_slopes_at_rest_in_space(margin):
    """A norm would have no slope where the robot is straight."""
    robot, load = nf.load_robot("two-axis-wrist"), nf.Load(tip_moment=(0.0, 0.0, 0.0))
    bend = nf.differentiable(robot, load, "tip_moment", outputs=("total_angle",))
    at_rest = {"tip_moment": jnp.zeros((1, 3))}
    slopes = jax.jacobian(lambda values: bend(values)["total_angle"])(at_rest)["tip_moment"]
    step = 1e-3
    for axis in range(3):
        ends = [
            nf.solve(robot, nf.Load(tip_moment=tuple(side * step * np.eye(3)[axis])))
            for side in (1.0, -1.0)
        ]
        difference = (ends[0].total_angle - ends[1].total_angle) / (2.0 * step)
        margin.within("slope", float(slopes[0, 0, axis]) - difference, 1e-6, "rad/(N mm)")
    assert abs(float(slopes[0, 0, 1])) > 1e-3
