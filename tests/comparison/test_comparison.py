"""Comparisons: of whatever was measured, along paths and from rest, in the world."""

from __future__ import annotations

import json

import numpy as np
import pytest

import notchflex as nf
from notchflex.comparison import compare_kinematics, comparison_document, errors_document
from notchflex.results.tables import json_text
from refusals import refused

WRIST = nf.load_robot("pacheco2021-a")
LOOP = nf.pull(0.2, 1.6, steps=8).release()


def seen(*observed, load=LOOP, from_rest=False, **options):
    return nf.simulate_measurements(WRIST, load, observed=observed, from_rest=from_rest, **options)


def document(found):
    return json.loads(json_text(errors_document(found)))


def test_a_path_has_no_error_as_a_path_and_is_said_to_be_one_from_rest():
    loop = seen("total_angle")
    assert nf.compare(WRIST, loop).rmse_total == pytest.approx(0.0, abs=1e-9)
    assert not nf.compare(WRIST, loop).diagnosis
    wrong = nf.Measurements("mine", loop.load, loop.pull, True, loop.observed)
    found = nf.compare(WRIST, wrong)
    assert np.degrees(found.rmse_total) > 3.0
    (said,) = found.diagnosis
    off = np.degrees(found.measured_total_angle - found.total_angle)
    assert said.startswith(f"Unloading rows of mine are {off[8:].mean():.2g} deg above the model")
    assert "--path" in said
    assert said in repr(found)


def test_totals_alone_are_compared():
    found = nf.compare(WRIST, seen("total_angle"))
    assert np.isnan(found.rmse_notches).all()
    assert np.isnan(found.rmse_tip)
    rest = document(found)
    assert rest["rmse_deg"]["notches"] is None
    assert rest["rmse_deg"]["total"] == pytest.approx(0.0, abs=1e-7)
    assert rest["tip_rmse_mm"] is None
    assert rest["points"] == 16


def test_tips_alone_are_compared_over_their_measured_coordinates():
    data = seen("tip_position")
    data.observed["tip_position"][:, 0] += 0.3
    data.observed["tip_position"][:, 1] = np.nan
    data.observed["tip_position"][:, 2] += 0.4
    data.observed["tip_position"][3] = np.nan
    found = nf.compare(WRIST, data)
    assert found.rmse_tip == pytest.approx(0.5, abs=1e-8)
    assert np.isnan(found.tip_error[3])
    assert document(found)["rmse_deg"] == {"notches": None, "total": None}


def test_some_notches_and_their_sum():
    data = seen("notch_angle")
    data.observed["notch_angle"][:, 0] += 0.01
    data.observed["notch_angle"][4, 2] = np.nan
    found = nf.compare(WRIST, data)
    np.testing.assert_allclose(found.rmse_notches, [0.01, 0.0, 0.0, 0.0, 0.0], atol=1e-9)
    assert np.flatnonzero(np.isnan(found.measured_total_angle)).tolist() == [4]
    assert found.rmse_total == pytest.approx(0.01, abs=1e-8)
    assert np.flatnonzero(np.isnan(found.tip_error)).tolist() == [4]
    # a measured tip goes before the forward kinematics of the angles
    tip = {**data.observed, "tip_position": np.zeros((16, 3))}
    other = nf.compare(WRIST, nf.Measurements("x", data.load, data.pull, False, tip))
    np.testing.assert_allclose(other.tip_error, np.linalg.norm(other.tip, axis=1))


def test_the_tip_on_a_turned_base_is_in_the_world():
    load = nf.pull(0.4, 1.2, steps=3)
    turned = nf.LoadPath(load.tension, load.stroke, np.array([0.3, -0.2, 0.5]))
    data = seen("notch_angle", load=turned, from_rest=True)
    found = nf.compare(WRIST, data)
    assert found.rmse_tip == pytest.approx(0.0, abs=1e-9)
    assert compare_kinematics(found).rmse_tip < 0.5
    moved = {"tip_position": found.tip + np.array([0.0, 0.5, 0.0])}
    other = nf.compare(WRIST, nf.Measurements("x", turned, data.pull, True, moved))
    assert other.rmse_tip == pytest.approx(0.5)
    straight = nf.compare(WRIST, seen("notch_angle", load=load, from_rest=True))
    assert np.abs(found.tip - straight.tip).max() > 1.0


def test_what_else_was_measured_has_its_error():
    names = ("tip_rotation", "tip_tension", "axis_points")
    data = seen(*names, axis_at=[3.0, 8.0])
    assert nf.compare(WRIST, data).others == pytest.approx(dict.fromkeys(names, 0.0), abs=1e-7)
    data.observed["tip_rotation"][:, 1] += 0.1
    data.observed["tip_tension"][:] += 0.2
    data.observed["axis_points"][..., 2] -= 0.3
    others = nf.compare(WRIST, data).others
    assert others == pytest.approx({names[0]: 0.1, names[1]: 0.2, names[2]: 0.3}, rel=1e-6)
    told = document(nf.compare(WRIST, data))["rmse_others"]
    assert told["tip_rotation_deg"] == pytest.approx(np.degrees(0.1))
    assert told["axis_points_mm"] == pytest.approx(0.3)


def test_kinematics_takes_the_stroke_of_the_model_where_none_was_measured():
    by_force = nf.compare(WRIST, seen("notch_angle", load=nf.pull(0.2, 1.2, steps=4)))
    shared = compare_kinematics(by_force)
    np.testing.assert_allclose(shared.total_angle, by_force.total_angle, rtol=1e-6)
    assert errors_document(shared)["stroke_from"] == "model"
    by_stroke = nf.compare(WRIST, seen("notch_angle", load=nf.stroke_path(0.2, 1.2, steps=4)))
    assert errors_document(compare_kinematics(by_stroke))["stroke_from"] == "measurement"
    assert "stroke_from" not in errors_document(by_stroke)


def test_it_prints_a_few_lines():
    data = seen("notch_angle", "tip_tension")
    found = nf.compare(WRIST, data)
    lines = repr(found).splitlines()
    assert lines[:2] == [
        "Pacheco 2021, wrist A beside synthetic",
        "16 of 16 rows solved, each pull one path",
    ]
    assert any(line.startswith("  tip          ") and line.endswith(" mm") for line in lines)
    assert any(line.startswith("  tension at the tip  ") for line in lines)
    assert found._repr_html_() == f"<pre>{found!r}</pre>"
    assert comparison_document(found)["data"] == "synthetic"


def test_what_cannot_be_compared_is_refused():
    with refused("WRONG_TYPE", "read_measurements"):
        nf.compare(WRIST, "my.csv")
    with refused("WRONG_SHAPE", "5 notches", "wrist C has 4"):
        nf.compare(nf.load_robot("pacheco2021-c"), seen("notch_angle"))


@pytest.mark.parametrize("name", ["liu2022", "gao2017", "pacheco2021-a"])
def test_measurements_without_noise_have_no_error(name, margin):
    """Strips and U-links are no arcs: their measured tip is rebuilt with the shape of the model."""
    robot = nf.load_robot(name)
    load = nf.pull(0.3, 1.5, steps=3) if name == "pacheco2021-a" else nf.pull(0.5, 4.0, steps=4)
    found = nf.compare(robot, nf.simulate_measurements(robot, load))
    margin.within("tip", found.rmse_tip, 1e-11, "mm")
