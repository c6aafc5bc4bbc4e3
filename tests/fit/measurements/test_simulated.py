"""Measurements made from the model: exact without noise, Gaussian with it."""

from __future__ import annotations

import numpy as np
import pytest

import notchflex as nf
from notchflex.analysis import axis_points
from notchflex.fit import repeats, simulate_measurements
from refusals import refused


@pytest.fixture(scope="module")
def robot():
    return nf.load_robot("pacheco2021-a")


def test_without_noise_it_is_the_model(robot):
    load = nf.pull(0.2, 1.0, steps=3).release()
    names = ("total_angle", "tip_rotation", "tip_tension", "tip_position", "axis_points")
    data = simulate_measurements(robot, load, observed=names, from_rest=False, axis_at=[3.0, 7.5])
    path = nf.simulate(robot, load)
    seen = data.observed
    np.testing.assert_allclose(seen["total_angle"], path.total_angle, rtol=1e-13)
    np.testing.assert_allclose(seen["tip_rotation"][:, 1], path.total_angle, rtol=1e-9)
    np.testing.assert_allclose(seen["tip_rotation"][:, ::2], 0.0, atol=1e-12)
    np.testing.assert_array_equal(seen["tip_tension"], path.span_tension[..., -1])
    np.testing.assert_array_equal(seen["tip_position"], path.tip_position)
    np.testing.assert_array_equal(seen["axis_points"], axis_points(path, [3.0, 7.5]))
    assert data.deviation == {}
    # friction: letting go, the robot is not where it was
    assert seen["total_angle"][0] < seen["total_angle"][-1]


def test_each_pull_is_a_path_of_its_own(robot):
    load = nf.pull(0.2, 1.0, steps=3).release()
    twice = load.then(load)
    labels = ["a"] * 6 + ["b"] * 6
    data = simulate_measurements(
        robot, twice, observed=["total_angle"], from_rest=False, pull=labels
    )
    angles = data.observed["total_angle"].reshape(2, 6)
    np.testing.assert_array_equal(angles[0], angles[1])
    rest = simulate_measurements(robot, twice, observed=["total_angle"], pull=labels)
    angles = rest.observed["total_angle"].reshape(2, 6)
    np.testing.assert_allclose(angles[0], angles[0, ::-1], rtol=1e-12)


def test_noise(robot):
    load = nf.LoadPath(np.full((400, 1), 0.5), np.full((400, 1), np.nan))
    noise = {"notch_angle": 0.01}
    data = simulate_measurements(robot, load, deviation=noise, seed=3)
    again = simulate_measurements(robot, load, deviation=noise, seed=3)
    assert data == again
    assert data != simulate_measurements(robot, load, deviation=noise, seed=4)
    # 5 times 399 degrees of freedom: 1.6 % of the deviation
    assert repeats(data)["notch_angle"] == pytest.approx(0.01, rel=0.06)
    np.testing.assert_allclose(data.deviation["notch_angle"], 0.01)


@pytest.mark.parametrize(
    ("options", "code", "name"),
    [
        ({"observed": ["angle"]}, "UNKNOWN_NAME", "`angle`"),
        ({"deviation": {"total_angle": 0.1}}, "OUT_OF_RANGE", "total_angle"),
        ({"deviation": {"notch_angle": 0.0}}, "OUT_OF_RANGE", "notch_angle"),
        ({"pull": ["a"]}, "WRONG_SHAPE", "2 steps"),
        ({"observed": ["axis_points"], "axis_at": [11.0]}, "OUT_OF_RANGE", "10 mm"),
    ],
)
def test_what_cannot_be_made_is_refused(robot, options, code, name):
    with refused(code, name):
        simulate_measurements(robot, nf.pull(0.2, 0.5, steps=2), **options)
