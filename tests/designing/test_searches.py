"""Searches: known optima, closed forms, curves, and wishes that cannot be met."""

from __future__ import annotations

import re

import numpy as np
import pytest

import notchflex as nf
from design_wishes import bend, s_curve, s_wrist, tip_first, wide_wrist
from notchflex.analysis.kinematics import axis_points, tip_from_angles
from notchflex.designing import target_points


def test_constant_curvature_synthesis():
    """The formulas of constant curvature are a special wish (h = k l (r_o + y)/n, u = ...)."""
    robot = nf.load_robot("pacheco2021-a")
    curvature, length, count = 1.0 / 6.0, 9.0, robot.number_of_notches
    angle = np.degrees(curvature * length / count)
    made = nf.design(
        {
            "robot": "pacheco2021-a",
            "variable": [
                {"value": "notch.height", "lower": 0.2, "upper": 2.0},
                {"value": "notch.uncut_length", "lower": 0.1, "upper": 3.0},
            ],
            "constraint": [
                {"quantity": "closing_angle", "notch": 1, "equal": float(angle)},
                {"quantity": "closed_length", "equal": length},
            ],
            "search": {"starts": 1},
        }
    )
    assert made.converged, made.reason
    outer, notch = robot.tube.outer_radius, made.robot.notches[0]
    centroid = robot.notches[0].height / nf.closing(robot).angle[0] - outer
    assert notch.height == pytest.approx(
        curvature * length * (outer + centroid) / count, rel=0, abs=1e-9
    )
    assert notch.uncut_length == pytest.approx(
        (length - curvature * length * outer) / count, rel=0, abs=1e-9
    )


@pytest.mark.nightly
def test_tip_closes_first_at_least_height():
    made = nf.design(tip_first() | {"search": {"starts": 2, "candidates": 16}}, robot=wide_wrist())
    assert made.converged, made.reason
    found = nf.closing(made.robot)
    assert (np.diff(found.tension) <= -0.02 + 1e-6).all()
    assert found.tension.min() >= 1.4
    assert found.tension.max() <= 1.6 + 1e-6
    assert found.outer_strain.max() <= 0.06 + 1e-7
    # The angle holds the height; the strain of the first notch holds the depths.
    assert made.explanation[0].startswith("total_angle at closed stands at its least value, 90 deg")
    assert any("outer_strain at closed, notch 1" in one for one in made.explanation)
    # The cost of the angle is that of another design with 2 degrees less.
    less = tip_first() | {"search": {"starts": 1}}
    less["constraint"][3]["lower"] = 88.0
    other = nf.design(less, robot=made.robot)
    saved = made.robot.notches[0].height - other.robot.notches[0].height
    told = re.search(r"2 deg less would save ([\d.]+) mm", made.explanation[0])
    assert told is not None
    assert float(told[1]) == pytest.approx(saved, rel=0.01)


@pytest.mark.nightly
def test_a_wish_that_cannot_be_met_is_explained():
    spec = tip_first() | {"search": {"starts": 2, "candidates": 8}}
    spec["constraint"][2]["upper"] = 0.02
    made = nf.design(spec, robot=wide_wrist())
    assert not made.converged
    assert not made.met
    assert [one.met for one in made.wishes].count(False) >= 1
    assert "contradict each other" in made.explanation[0] or "cannot be met" in made.explanation[0]
    with pytest.raises(nf.ConvergenceError):
        made.raise_if_failed()


def test_the_robot_is_left_as_it_is_where_it_does_what_is_asked():
    robot = nf.load_robot("pacheco2021-a")
    made = nf.design(
        {
            "robot": "pacheco2021-a",
            "variable": [{"value": "notch.height", "lower": 0.2, "upper": 2.0}],
            "constraint": [{"quantity": "length", "upper": 11.0}],
            "search": {"starts": 1},
        }
    )
    assert made.converged, made.reason
    assert made.robot.notches[0].height == pytest.approx(robot.notches[0].height, abs=1e-6)


def test_sizes_alone_are_chosen():
    """Without variables the best of all forms is found, and what none of them meets is said."""
    length = {"quantity": "length", "goal": "minimise"}
    angle = {"quantity": "closing_angle", "take": "sum", "lower": 120.0}
    spec = {"robot": "pacheco2021-a", "number_of_notches": [3, 4, 5], "objective": [length]}
    made = nf.design(spec | {"constraint": [angle]})
    assert made.converged, made.reason
    # Each notch closes at 30.6 degrees.
    assert made.robot.number_of_notches == 4
    missed = nf.design(spec | {"constraint": [angle | {"lower": 200.0}]})
    assert not missed.met
    assert missed.robot.number_of_notches == 5
    assert missed.explanation[-2].startswith("sum closing_angle is 153.1 deg, 46.8")


@pytest.mark.nightly
def test_number_of_notches_and_stock():
    made = nf.design(
        {
            "robot": "pacheco2021-a",
            "number_of_notches": [3, 4, 5],
            "stock": [
                {
                    "values": ["tube.outer_diameter", "tube.inner_diameter", "tendon.radius"],
                    "sizes": [[1.70, 1.50, 0.75], [1.62, 1.40, 0.70]],
                }
            ],
            "variable": [{"value": "notch.height", "lower": 0.2, "upper": 1.2}],
            "objective": [{"quantity": "length", "goal": "minimise"}],
            "constraint": [{"quantity": "closing_angle", "take": "sum", "equal": 120.0}],
        }
    )
    # By hand: height of all notches together is 120 deg (r_o + y), whatever their number.
    assert made.converged, made.reason
    assert made.robot.number_of_notches == 3
    assert made.robot.tube.outer_diameter == 1.62
    assert made.robot.tendon[0].end_body == 3
    centroid = nf.annular_sector(0.81, 0.70, 1.40).centroid
    height = made.robot.notches[0].height
    assert 3.0 * height == pytest.approx(np.radians(120.0) * (0.81 + centroid), rel=1e-6)


@pytest.mark.nightly
@pytest.mark.parametrize(("spec", "robot"), [(bend(), None), (s_curve(), s_wrist())])
def test_target_curves(spec, robot):
    made = nf.design(spec, robot=robot)
    assert made.converged, made.reason
    assert made.wishes[0].achieved[0] <= 0.2
    # Measured anew: the axis of the robot, and the points of the curve.
    (curve,) = made.spec.curve
    points = target_points(curve)
    assert len(points) == 20
    tip = tip_from_angles(made.robot, np.zeros((1, made.robot.number_of_notches)))[0][0, 2]
    every = axis_points(made.path, np.linspace(0.0, tip, 2001))[-1]
    far = [np.linalg.norm(every - point, axis=1).min() for point in points]
    assert np.sqrt(np.mean(np.square(far))) <= 0.2


@pytest.mark.nightly
def test_points_out_of_reach_are_named():
    spec = bend()
    spec["variable"] = spec["variable"][3:]
    spec["curve"][0]["points"] = [[x, 0.0, 2.0 * z] for x, _, z in spec["curve"][0]["points"]]
    made = nf.design(spec | {"search": {"starts": 1}})
    assert not made.converged
    assert "curve.bend is not reached at" in made.explanation[0]


@pytest.mark.nightly
def test_front(tmp_path):
    spec = {
        "robot": "pacheco2021-a",
        "variable": [
            {"value": "notch.depth", "lower": 1.2, "upper": 1.38},
            {"value": "notch.height", "lower": 0.5, "upper": 1.0},
        ],
        "load": {"pulled": {"tension": 1.5}},
        "objective": [
            {"quantity": "total_angle", "load": "pulled", "goal": "maximise"},
            {"quantity": "peak_strain", "load": "pulled", "take": "largest", "goal": "minimise"},
        ],
        "constraint": [{"quantity": "total_angle", "load": "pulled", "lower": 20.0}],
    }
    front = nf.design_front(spec, points=5, generations=4)
    values = front.objectives
    assert len(front.points) >= 3
    # More angle costs more strain, from point to point.
    order = np.argsort(values[:, 0])
    assert (np.diff(values[order, 1]) > 0.0).all()
    for point, (angle, strain) in zip(front.points, values, strict=True):
        state = nf.solve(point.robot, nf.Load(tension=1.5))
        assert np.degrees(state.total_angle) == pytest.approx(angle, abs=1e-4)
        assert state.peak_strain.max() == pytest.approx(strain, abs=1e-6)
    files = front.save(tmp_path / "front")
    assert files[0].name == "point_01.toml"
    assert nf.load_robot(files[0]) == front.points[0].robot
