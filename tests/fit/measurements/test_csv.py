"""Measurements as CSV: what columns mean, what is refused with line and column, round trips."""

from __future__ import annotations

import re

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import notchflex as nf
from notchflex.fit import (
    Measurements,
    read_measurements,
    repeats_of_each,
    simulate_measurements,
    write_measurements,
)
from notchflex.fit.measurements.csv import exactly_in_degrees
from refusals import refused
from shared_data import measured_path

HEADER = "tendon_force_N,notch_1_deg,notch_2_deg"
ROWS = "-0.1,1,2\n0.5,2,\n"


@pytest.fixture(scope="module")
def robot():
    return nf.load_robot("pacheco2021-a")


@pytest.fixture
def read(tmp_path, robot):
    def reader(text, robot=robot, **options):
        file = tmp_path / "data.csv"
        file.write_text(text, encoding="utf-8")
        return read_measurements(file, robot, **options)

    return reader


def test_plain_table(read):
    data = read(f"{HEADER}\n{ROWS}")
    np.testing.assert_array_equal(data.measured_tension, [[-0.1], [0.5]])
    np.testing.assert_array_equal(data.load.tension, [[0.0], [0.5]])
    assert np.isnan(data.load.stroke).all()
    angles = np.degrees(data.observed["notch_angle"])
    np.testing.assert_allclose(angles[:, :2], [[1.0, 2.0], [2.0, np.nan]])
    assert np.isnan(angles[:, 2:]).all()
    assert list(data.observed) == ["notch_angle"]
    assert data.deviation == {}
    assert data.pull == ("1", "1")
    assert data.from_rest


def test_every_kind_of_column(read):
    table = {
        "trial": "up", "tendon_1_force_N": "0.5", "note": "x",
        "tip_force_x_N": "0.1", "tip_moment_z_Nmm": "2", "tip_point_y_mm": "0.3", "following": "1",
        "tip_mass_g": "20", "gravity_z_m_s2": "-9.8", "base_ry_deg": "90",
        "body_2_force_y_N": "0.01", "body_2_point_x_mm": "0.8", "body_2_following": "0",
        "body_3_force_y_N": "0", "notch_2_deg": "4", "notch_2_sd_deg": "0.5",
        "total_deg": "20", "total_sd_deg": "", "tip_z_mm": "9", "tip_z_sd_mm": "0.1",
        "tip_rx_deg": "10", "tendon_1_tip_force_N": "0.4", "axis_2.50_x_mm": "0.2",
        "axis_2.50_x_sd_mm": "0.05", "axis_10_y_mm": "0.1", "axis_0_z_mm": "0",
    }  # fmt: skip
    data = read(f"{','.join(table)}\n{','.join(table.values())}\n", from_rest=False)
    assert data.ignored == ("note",)
    assert data.pull == ("up",)
    assert not data.from_rest
    (load,) = data.load.external
    assert load == nf.LoadPath([[0.5]], [[np.nan]]).loaded(
        tip_force=(0.1, 0.0, 0.0), tip_moment=(0.0, 0.0, 2.0), tip_point=(0.0, 0.3, 0.0),
        following=True, tip_mass=20.0, gravity=(0.0, 0.0, -9.8),
        body_forces=[nf.BodyForce(2, (0.0, 0.01, 0.0), point=(0.8, 0.0, 0.0))],
    ).external[0]  # fmt: skip
    np.testing.assert_allclose(data.load.base_rotation, [0.0, np.pi / 2, 0.0])
    assert np.degrees(data.observed["notch_angle"][0, 1]) == pytest.approx(4.0)
    assert np.degrees(data.deviation["notch_angle"][0, 1]) == pytest.approx(0.5)
    assert np.degrees(data.observed["total_angle"][0]) == pytest.approx(20.0)
    np.testing.assert_array_equal(data.observed["tip_position"], [[np.nan, np.nan, 9.0]])
    np.testing.assert_array_equal(data.deviation["tip_position"], [[np.nan, np.nan, 0.1]])
    assert np.degrees(data.observed["tip_rotation"][0, 0]) == pytest.approx(10.0)
    np.testing.assert_array_equal(data.observed["tip_tension"], [[0.4]])
    np.testing.assert_array_equal(data.axis_at, [0.0, 2.5, 10.0])
    points = data.observed["axis_points"][0]
    assert (points[0, 2], points[1, 0], points[2, 1]) == (0.0, 0.2, 0.1)
    assert np.isnan(points).sum() == 6
    assert data.deviation["axis_points"][0, 1, 0] == 0.05
    assert set(data.deviation) == {"notch_angle", "tip_position", "axis_points"}


def test_spreadsheet_habits_are_taken(tmp_path, robot):
    text = f"# pulled by hand\n{HEADER}\r\n\r\n 0.5 , 1,2\r\n,,\r\n"
    (tmp_path / "data.csv").write_bytes(b"\xef\xbb\xbf" + text.encode())
    assert len(read_measurements(tmp_path / "data.csv", robot)) == 1


@pytest.mark.parametrize(
    "text",
    [
        "0.5,1.25,2\n1,2,",
        "0,5;1,25;2\n1;2;",
        "0.5;1.25;2\n1;2;",
        ";;\n0,5;1,25;2\n1;2;",
        "5e-1;1,25;2\n1;2;",
    ],
)
def test_semicolons_and_decimal_commas_are_read(read, text):
    header = HEADER.replace(",", ";") if ";" in text else HEADER
    data = read(f"# Messung, Wrist 7\n{header}\n{text}\n")
    np.testing.assert_array_equal(data.load.tension[:, 0], [0.5, 1.0])
    np.testing.assert_allclose(np.degrees(data.observed["notch_angle"][:, 0]), [1.25, 2.0])


def test_tension_in_some_rows_and_stroke_in_others(read):
    data = read("tendon_force_N,tendon_displacement_mm,total_deg\n0.5,,9\n,0.2,9\n0.7,0.3,9\n")
    np.testing.assert_array_equal(data.load.tension[:, 0], [0.5, np.nan, 0.7])
    np.testing.assert_array_equal(data.load.stroke[:, 0], [np.nan, 0.2, np.nan])
    assert data.ignored == ()
    only_force = read("tendon_force_N,tendon_displacement_mm,total_deg\n0.5,0.1,9\n")
    assert only_force.ignored == ("tendon_displacement_mm",)


def test_a_hung_weight_needs_no_tendon(read):
    data = read("tip_mass_g,tip_z_mm\n20,9.5\n50,9.1\n")
    assert np.isnan(data.load.tension).all()
    assert [one.tip_mass for one in data.load.external] == [20.0, 50.0]


@pytest.mark.parametrize(
    ("text", "code", "name"),
    [
        ("", "TABLE_ROWS", ""),
        ("\n\n", "TABLE_ROWS", ""),
        (f"{HEADER}\n", "TABLE_ROWS", ""),
        (f"{HEADER}\n1,1\n", "TABLE_ROWS", "line 2"),
        (f"{HEADER},notch_1_deg\n1,1,2,1\n", "TABLE_COLUMNS", "notch_1_deg"),
        (f"{HEADER}\ninf,1,2\n", "NOT_FINITE", "line 2: tendon_force_N"),
        (f"{HEADER}\n1,1e308,2\n", "OUT_OF_RANGE", "line 2: notch_1_deg is 1e308"),
        (HEADER.replace(",", "\t") + "\n1\t1\t2\n", "FILE_FORMAT", "tabs"),
        (
            HEADER.replace(",", ";") + "\n0,5;1;2\n1.5;1;2\n",
            "FILE_FORMAT",
            "0,5 in line 2 and 1.5 in line 3",
        ),
        (HEADER.replace(",", ";") + "\n0,5,5;1;2\n", "NOT_A_NUMBER", "tendon_force_N is '0,5,5'"),
        ("force,notch_1_deg\n1,2\n", "TABLE_COLUMNS", "tendon_force_N or tendon_displacement_mm"),
        (f"{HEADER}\n0.5,1,2\n,1,2\n", "MISSING_VALUE", "line 3: tendon_force_N"),
        (
            "tendon_force_N,tendon_displacement_mm,total_deg\n,,2\n",
            "MISSING_VALUE",
            "line 2: tendon_force_N and tendon_displacement_mm",
        ),
        (f"{HEADER}\n0.5,one,2\n", "NOT_A_NUMBER", "line 2: notch_1_deg is 'one'"),
        (f"{HEADER}\n0.5,NA,2\n", "NOT_A_NUMBER", "empty where there is none"),
        (f"# rig\n{HEADER}\n\n0.5,nan,2\n", "NOT_FINITE", "line 4: notch_1_deg"),
        ("tendon_force_N\n0.5\n", "NO_DATA", "notch_1_deg"),
        ("tendon_force_N,total_deg\n0.5,\n", "NO_DATA", "notch_1_deg"),
        (
            f"{HEADER},notch_6_deg\n1,1,2,3\n",
            "TABLE_COLUMNS",
            "notch_6_deg, but Pacheco 2021, wrist A has notch 1 to 5",
        ),
        (f"{HEADER},notch_0_sd_deg\n1,1,2,3\n", "TABLE_COLUMNS", "notch_0_sd_deg"),
        (f"{HEADER},tendon_2_force_N\n1,1,2,3\n", "TABLE_COLUMNS", "tendon_2_force_N"),
        (f"{HEADER},body_6_force_x_N\n1,1,2,3\n", "TABLE_COLUMNS", "body_6_force_x_N"),
        (f"{HEADER},notch_3_sd_deg\n1,1,2,3\n", "TABLE_COLUMNS", "notch_3_sd_deg"),
        (
            f"{HEADER},notch_1_sd_deg\n1,1,2,3\n1,1,2,0\n",
            "OUT_OF_RANGE",
            "line 3: notch_1_sd_deg is 0",
        ),
        (f"{HEADER},axis_11_x_mm\n1,1,2,3\n", "TABLE_COLUMNS", "axis_11_x_mm"),
        (
            f"{HEADER},axis_2_x_mm,axis_2.0_x_mm\n1,1,2,3,3\n",
            "TABLE_COLUMNS",
            "axis_2_... and axis_2.0_...",
        ),
        (f"{HEADER},tip_mass_g\n1,1,2,3\n1,1,2,-3\n", "NOT_FINITE", "line 3: tip_mass"),
        (f"{HEADER},tip_mass_g\n1,1,2,\n", "NOT_A_NUMBER", "line 2: tip_mass_g"),
        (f"{HEADER},following\n1,1,2,yes\n", "NOT_A_NUMBER", "line 2: following is 'yes'"),
        (f"{HEADER},base_rx_deg\n1,1,2,0\n1,1,2,5\n", "UNSUPPORTED", "line 3: the base"),
        (f"{HEADER},from_rest\n1,1,2,0\n1,1,2,1\n", "UNSUPPORTED", "line 3: from_rest"),
    ],
)
def test_bad_tables_are_told_in_one_sentence(read, text, code, name):
    with refused(code, name) as told:
        read(text)
    assert "data.csv" in str(told.value)
    assert re.search(r"\.$", str(told.value))
    assert ".." not in str(told.value).replace("...", "")


def test_a_table_of_another_encoding_is_refused_with_the_remedy(tmp_path, robot):
    file = tmp_path / "data.csv"
    file.write_bytes("tendon_force_N,total_deg,Prüfer\n1,2,3\n".encode("latin-1"))
    with refused("FILE_UNREADABLE", "save it as CSV in UTF-8"):
        nf.read_measurements(file, robot)


def test_gravity_needs_something_to_act_on(read, robot):
    text = "tendon_force_N,tip_mass_g,gravity_x_m_s2,total_deg\n1,2,9.8,1\n1,0,9.8,1\n"
    assert len(read(text)) == 2
    bare = robot.with_value("material.density", None)
    with refused("UNSUPPORTED", "line 3: gravity"):
        read(text, bare)


def test_a_temperature_needs_the_one_of_the_measured_material(read, robot):
    text = "tendon_force_N,temperature_C,total_deg\n1,37,1\n"
    with refused("UNSUPPORTED", "line 2: temperature has no effect"):
        read(text)
    assert len(read(text, robot.with_value("material.reference_temperature", 22.0))) == 1


def everything(robot: nf.Robot, path: nf.LoadPath, **options) -> Measurements:
    return simulate_measurements(
        robot,
        path,
        observed=(
            "notch_angle", "total_angle", "tip_position", "tip_rotation", "tip_tension",
            "axis_points",
        ),
        deviation={"notch_angle": np.radians(0.3), "tip_rotation": 0.01, "axis_points": 0.1},
        axis_at=[0.0, 1.7, 10.0 / 3.0, 10.0],
        **options,
    )  # fmt: skip


def test_round_trip(tmp_path, robot):
    forces = [nf.BodyForce(2, (0.0, 0.0, 0.01), point=(0.1, 0.0, 0.2), following=True)]
    path = nf.pull(0.1, 1.0, steps=4).loaded(tip_force=(0.01, 0.0, 0.0), body_forces=forces)
    data = everything(robot, path, pull=["a", "a", "b", "b"], from_rest=False)
    write_measurements(data, tmp_path / "all.csv")
    read = read_measurements(tmp_path / "all.csv", robot)
    assert read == data
    assert read.ignored == ()
    assert set(read.deviation) == {"notch_angle", "tip_rotation", "axis_points"}


def test_round_trip_with_gaps_and_strokes(tmp_path, robot):
    text = (
        "# by hand\npull,tendon_force_N,tendon_displacement_mm,notch_3_deg,notch_3_sd_deg,"
        "axis_0.1_y_mm,tip_mass_g,gravity_x_m_s2,base_rz_deg\n"
        "1,-0.003,,5.1,0.3,,1,0,33\n2,,0.25,,,0.7,1,9.81,33\n"
    )
    (tmp_path / "first.csv").write_text(text)
    first = read_measurements(tmp_path / "first.csv", robot)
    write_measurements(first, tmp_path / "again.csv")
    assert read_measurements(tmp_path / "again.csv", robot) == first


@settings(max_examples=50)
@given(st.lists(st.floats(-360.0, 360.0), min_size=1, max_size=20))
def test_angles_read_from_a_file_are_written_as_they_were(degrees):
    angle = np.radians(degrees)
    np.testing.assert_array_equal(np.radians(exactly_in_degrees(angle)), angle)


def test_points_near_the_base_are_written_without_an_exponent(tmp_path, robot):
    load = nf.pull(0.5, 0.5, steps=1)
    data = simulate_measurements(robot, load, observed=["axis_points"], axis_at=[1e-5, 2.5])
    write_measurements(data, tmp_path / "x.csv")
    assert "axis_0.00001_x_mm" in (tmp_path / "x.csv").read_text(encoding="utf-8")
    assert read_measurements(tmp_path / "x.csv", robot) == data


def test_weightless_is_not_the_same_as_hanging(tmp_path, robot):
    path = nf.pull(0.5, 0.5, steps=1).loaded(tip_mass=1.0, gravity=(0.0, 0.0, 0.0))
    data = Measurements("x", path, ("1",), True, {"total_angle": np.array([0.5])})
    write_measurements(data, tmp_path / "x.csv")
    assert read_measurements(tmp_path / "x.csv", robot) == data


@pytest.mark.parametrize(
    ("path", "code", "name"),
    [
        (
            nf.pull(1.0, 1.0, steps=1).loaded(body_forces=[nf.BodyForce(1, (1.0, 0.0, 0.0))] * 2),
            "UNSUPPORTED",
            "body 1",
        ),
        (
            nf.pull(1.0, 1.0, steps=1).loaded(gravity=(0.0, 0.0, 1.0)).then(nf.pull(1, 1, steps=1)),
            "UNSUPPORTED",
            "gravity",
        ),
        (
            nf.pull(1.0, 1.0, steps=1).then(nf.LoadPath([[np.nan]], [[np.nan]])),
            "UNSUPPORTED",
            "tendon 1",
        ),
    ],
)
def test_loads_without_a_place_in_a_table_are_refused(tmp_path, path, code, name):
    rows = len(path)
    data = Measurements("x", path, ("1",) * rows, True, {"total_angle": np.ones(rows)})
    with refused(code, name):
        write_measurements(data, tmp_path / "x.csv")
    assert not (tmp_path / "x.csv").exists()


@pytest.mark.parametrize(
    ("wrist", "points", "notches", "total"),
    [("A", 68, (0.7, 0.9), 3.3), ("B", 75, (0.25, 0.32), 1.0), ("C", 83, (0.5, 0.8), 1.6)],
)
def test_noise_floor_of_the_measured_wrists(wrist, points, notches, total):
    """Standard deviation between pulls at equal force, as the README of the data tells it."""
    robot = nf.load_robot(f"pacheco2021-{wrist.lower()}")
    data = read_measurements(measured_path(f"pacheco2021_wrist_{wrist}_measured.csv"), robot)
    assert len(data) == points
    found = repeats_of_each(data)
    each = np.degrees(found["notch_angle"])
    assert notches[0] - 0.05 < each.min() < each.max() < notches[1] + 0.05
    assert np.degrees(found["total_angle"]) == pytest.approx(total, abs=0.1)
