"""The JSON document of a path: its keys, its numbers, and no NaN."""

import json
import math

import numpy as np
import pytest

from fake_path import fake_path
from notchflex import load_robot
from notchflex.loads.load import NOTHING, BodyForce, ExternalLoad
from notchflex.results.tables import json_text, path_document, write_json


def test_document_is_strict_json_and_holds_every_step():
    path = fake_path(5)
    document = json.loads(json_text(path_document(path)), parse_constant=pytest.fail)
    assert document["name"] == "Pacheco 2021, wrist A"
    assert document["converged"] is True
    assert document["reason"] == ""
    assert len(document["steps"]) == 10
    assert document["units"]["notch_angle_deg"] == "deg"
    assert document["robot"]["tube"]["outer_diameter"] == 1.62


def test_step_holds_lists_per_tendon_and_degrees():
    path = fake_path(5)
    step = json.loads(json_text(path_document(path)))["steps"][2]
    assert step["load"] == {"tension_N": [1.5], "stroke_mm": [None]}
    assert step["tendon_tension_N"] == [1.5]
    assert step["notch_angle_deg"] == pytest.approx(np.degrees(path.notch_angle[2]).tolist())
    assert step["total_angle_deg"] == pytest.approx(math.degrees(path.total_angle[2]))
    assert np.shape(step["tip_rotation"]) == (3, 3)
    assert len(step["span_tension_N"][0]) == 10
    assert len(step["contacts"][0]) == 9
    assert step["contacts"][0][1]["state"] == "slip toward base"
    assert set(step["contacts"][0][0]) == {"log_ratio", "slid_mm", "turning_deg", "state"}
    assert step["closed"] == [bool(closed) for closed in path.closed[2]]
    assert type(step["iterations"]) is int


def test_loads_from_outside_are_told_of_every_step_where_there_are_any():
    path = fake_path(2)
    side = BodyForce(2, (0.1, 0.0, 0.0), point=(0.8, 0.0, 0.0))
    one = ExternalLoad(tip_force=(0.0, 0.0, -0.2), tip_mass=5.0, body_forces=[side])
    path.columns["external"] = (NOTHING, one, NOTHING, NOTHING)
    document = json.loads(json_text(path_document(path)))
    nothing, told = (step["load"] for step in document["steps"][:2])
    assert told["tension_N"] == [3.0]
    assert told["tip_force_N"] == [0.0, 0.0, -0.2]
    assert told["tip_mass_g"] == 5.0
    assert told["gravity_m_s2"] is None
    assert told["body_forces"] == [
        {
            "body": 2,
            "force_N": [0.1, 0.0, 0.0],
            "moment_Nmm": [0.0, 0.0, 0.0],
            "point_mm": [0.8, 0.0, 0.0],
            "following": False,
        }
    ]
    assert nothing.keys() == told.keys()
    assert nothing["tip_force_N"] == [0.0, 0.0, 0.0]
    units = document["units"]
    assert {key.partition(".")[2] for key in units if key.startswith("load.")} >= {
        key for key in told if key not in ("following", "body_forces")
    }


def test_spans_end_where_the_tendon_ends():
    short = fake_path(2).robot.with_value("tendon.end_body", 3)
    step = path_document(fake_path(2, robot=short))["steps"][0]
    assert len(step["span_tension_N"][0]) == 6
    assert len(step["contacts"][0]) == 5


def test_nan_becomes_null():
    assert json_text({"a": [float("nan"), np.float64("nan"), 1]}) == '{"a": [null, null, 1]}\n'
    assert json_text({"a": np.array([[np.nan, 2.0]])}) == '{"a": [[null, 2.0]]}\n'


def test_dash_is_standard_output(capsys):
    write_json("-", {"a": 1})
    assert capsys.readouterr().out == '{"a": 1}\n'


def test_angles_of_contacts_and_the_front():
    path = fake_path(3)
    path.columns["front_eta"][4] = np.nan
    step = json.loads(json_text(path_document(path)))["steps"][4]
    assert step["contacts"][0][2]["turning_deg"] == pytest.approx(3.0)
    assert step["front"] == {"m": [2.0], "eta": [None]}
    assert step["base_moment_Nmm"] == pytest.approx([0.0, 0.7 * 1.5, 0.0])


def test_chord_angles_are_told_where_there_are_any():
    assert "chord_angle_deg" not in path_document(fake_path(2))["steps"][0]
    strip, arc = load_robot("liu2022"), load_robot("pacheco2021-a").notch[0]
    count = strip.number_of_notches
    path = fake_path(2, robot=strip.replace(notch=(*strip.notch, arc)))
    path.columns["chord_angle"][:, :count] = 0.5
    step = json.loads(json_text(path_document(path)))["steps"][0]
    angles = step["chord_angle_deg"]
    assert angles[:count] == pytest.approx([np.degrees(0.5)] * count)
    assert not any(angles[count:])
    assert "total_chord_angle_deg" not in step
