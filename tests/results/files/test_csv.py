"""The CSV table of a path."""

import csv

import numpy as np

from fake_path import fake_path
from notchflex.results.tables import path_columns, write_csv, write_path_csv


def test_table_has_a_row_for_every_step(tmp_path):
    path = fake_path(4)
    file = tmp_path / "path.csv"
    write_path_csv(file, path)
    rows = list(csv.DictReader(file.read_text(encoding="utf-8").splitlines()))
    assert len(rows) == 8
    assert float(rows[1]["tendon_force_N"]) == 1.0
    assert np.isclose(float(rows[1]["notch_1_deg"]), np.degrees(path.notch_angle[1, 0]))
    assert np.isclose(float(rows[1]["total_deg"]), np.degrees(path.total_angle[1]))
    assert rows[0]["notch_1_closed"] == "0"
    assert rows[3]["notch_1_closed"] == "1"
    assert float(rows[1]["tendon_gap_5_N"]) == path.span_tension[1, 0, 9]


def test_several_tendons_are_numbered():
    path = fake_path(2)
    for name in ("tension", "stroke", "span_tension", "tendon_work", "front_contact", "front_eta"):
        path.columns[name] = np.repeat(path.columns[name], 2, axis=1)
    path.robot = path.robot.replace(tendon=path.robot.tendon * 2)
    path.columns["base_force"] = np.array([[1.0, 2.0, 3.0]] * 4)
    columns = path_columns(path)
    assert "tendon_1_force_N" in columns
    assert "tendon_2_gap_5_N" in columns
    assert "tendon_2_front_m" in columns
    assert list(columns["base_force_y_N"]) == [2.0] * 4
    assert not any("chord" in name for name in columns)
    assert "tendon_force_N" not in columns


def test_missing_numbers_are_empty_fields(capsys):
    write_csv("-", ["a", "b", "c"], [[float("nan"), None, True], [1.5, "x, y", np.float64(2)]])
    assert capsys.readouterr().out == 'a,b,c\n,,1\n1.5,"x, y",2.0\n'
