"""`notchflex compare`: a computed table compared as if it had been measured."""

import csv
import json
from pathlib import Path

import numpy as np
import pytest

import notchflex as nf


@pytest.fixture
def loop(call):
    """A computed loop, written as a table that `compare` reads."""
    assert (
        call("simulate", "pacheco2021-b", "--tension", "0:1.5:9,1.5:0:9", "--csv", "b.csv")[0] == 0
    )
    return "b.csv"


def test_path_compared_with_itself_has_no_error(call, loop):
    code, out, _ = call("compare", "pacheco2021-b", loop, "--path", "--json", "-")
    assert code == 0
    found = json.loads(out)
    assert found["points"] == 18
    assert found["rmse_deg"]["notches"] == pytest.approx([0.0] * 5, abs=1e-7)
    assert found["rmse_deg"]["total"] == pytest.approx(0.0, abs=1e-7)
    assert found["tip_rmse_mm"] == pytest.approx(0.0, abs=1e-8)
    assert found["converged"] is True


@pytest.mark.nightly
def test_angles_of_a_table_are_compared_as_edge_angles(call, tmp_path):
    call("simulate", "pacheco2021-b-true", "--tension", "0:1.2:3", "--csv", "b.csv")
    rows = list(csv.DictReader((tmp_path / "b.csv").read_text().splitlines()))
    with (tmp_path / "seen.csv").open("w") as file:
        print("tendon_force_N", *(f"notch_{n}_deg" for n in range(1, 6)), sep=",", file=file)
        for row in rows:
            edges = (row[f"notch_{n}_edge_deg"] for n in range(1, 6))
            print(row["tendon_force_N"], *edges, sep=",", file=file)
    options = ("compare", "pacheco2021-b-true", "seen.csv", "--from-rest")
    code, out, _ = call(*options, "--measured", "edge", "--json", "edge.json")
    assert code == 0
    assert "edge angles, between the faces of the notches" in out
    found = json.loads((tmp_path / "edge.json").read_text())
    assert found["rmse_deg"]["notches"] == pytest.approx([0.0] * 5, abs=1e-6)
    assert found["tip_rmse_mm"] == pytest.approx(0.0, abs=1e-6)
    assert "edge_angle_deg" in found["rows"][0]["measured"]
    out = call(*options, "--json", "-")[1]
    assert json.loads(out)["rmse_deg"]["total"] > 0.5


def test_pulls_from_rest_do_not_know_the_way_back(call, loop):
    found = json.loads(call("compare", "pacheco2021-b", loop, "--from-rest", "--json", "-")[1])
    assert found["from_rest"] is True
    assert found["order"] == ""
    assert found["rmse_deg"]["total"] > 1.0
    assert "Unloading rows of b.csv are" in found["diagnosis"][0]


def test_a_loop_is_a_path_unless_told_otherwise(call, loop):
    code, out, err = call("compare", "pacheco2021-b", loop, "--json", "-")
    found = json.loads(out)
    assert code == 0
    assert found["from_rest"] is False
    assert found["rmse_deg"]["total"] == pytest.approx(0.0, abs=1e-7)
    assert found["diagnosis"] == []
    assert "the force falls within a pull" in " ".join(err.split())
    assert "--from-rest" in err


def test_the_table_says_how_the_rows_were_loaded(call, loop):
    code, out, _ = call("compare", "pacheco2021-b", loop)
    assert code == 0
    assert "18 points of 1 trial, each trial one loading path" in out
    out = call("compare", "pacheco2021-b", loop, "--from-rest")[1]
    assert "18 points of 1 trial, each pulled from rest" in out
    assert "Unloading rows of b.csv are" in out
    head, row = Path(loop).read_text(encoding="utf-8").splitlines()[:2]
    Path("one.csv").write_text(f"{head}\n{row}\n", encoding="utf-8")
    assert "1 point of 1 trial, each" in call("compare", "pacheco2021-b", "one.csv")[1]


def test_an_order_that_may_mean_two_things_is_refused(call, refused, tmp_path):
    (tmp_path / "d.csv").write_text("tendon_force_N,total_deg\n0.5,13\n1.5,70\n1.0,27\n1.2,40\n")
    refused("UNSUPPORTED", "compare", "pacheco2021-b", "d.csv")
    assert call("compare", "pacheco2021-b", "d.csv", "--from-rest")[0] == 0
    assert call("compare", "pacheco2021-b", "d.csv", "--path")[0] == 0


@pytest.mark.parametrize(
    ("text", "heads"),
    [
        ("tendon_force_N,total_deg\n0.5,13\n1.0,25\n", ["total"]),
        ("tendon_displacement_mm,total_deg\n0.5,20\n1.0,41\n", ["total"]),
        ("tendon_force_N,tip_x_mm,tip_z_mm\n0.5,1.1,9.8\n1.0,2.2,9.4\n", ["tip"]),
        ("tendon_force_N,notch_2_deg\n0.5,3\n1.0,5\n", ["notch"]),
        ("tendon_force_N;total_deg\n0,5;13,2\n1,0;25\n", ["total"]),
    ],
)
def test_whatever_calibrate_reads_is_compared(call, tmp_path, text, heads):
    (tmp_path / "m.csv").write_text(text)
    files = ("--csv", "points.csv", "--plot", "m.svg", "--beside", "kinematics")
    code, out, _ = call("compare", "pacheco2021-b", "m.csv", *files)
    assert code == 0
    assert [line.split()[0] for line in out.splitlines()[3:] if " [" in line] == heads
    table = list(csv.DictReader((tmp_path / "points.csv").read_text().splitlines()))
    assert len(table) == 2
    assert "total_deg_model" in table[0]
    assert (tmp_path / "m.svg").exists()


def test_kinematics_says_whose_total_angle_it_has(call, loop):
    options = ("pacheco2021-b", loop, "--beside", "kinematics")
    _, out, err = call("compare", *options)
    (total,) = (line.split() for line in out.splitlines() if line.startswith("total "))
    assert total[2] == total[3]  # of the model and of the kinematics
    assert "that of the model by construction" in " ".join(err.split())
    _, out, _ = call("compare", *options, "--json", "-")
    assert json.loads(out)["beside"]["kinematics"]["stroke_from"] == "model"


def test_errors_are_those_of_the_rows(call, tmp_path):
    rows = [(-0.002, 1.0), (0.5, 12.0), (0.5, 10.0)]
    lines = ["trial,tendon_force_N,notch_1_deg,notch_2_deg,notch_3_deg,notch_4_deg,notch_5_deg,rig"]
    lines += [f"{i},{force},{angle},1,2,3,4,x" for i, (force, angle) in enumerate(rows)]
    (tmp_path / "d.csv").write_text("\n".join(lines))
    code, out, err = call("compare", "pacheco2021-a", "d.csv", "--json", "-", "--csv", "points.csv")
    assert code == 0
    found = json.loads(out)
    robot = nf.load_robot("pacheco2021-a")
    model = np.degrees(
        [nf.solve(robot, nf.Load(tension=t)).notch_angle[0] for t in (0.0, 0.5, 0.5)]
    )
    expected = np.sqrt(np.mean((model - [1.0, 12.0, 10.0]) ** 2))
    assert found["rmse_deg"]["notches"][0] == pytest.approx(expected, rel=1e-9)
    assert found["negative_forces"] == 1
    assert found["ignored_columns"] == ["rig"]
    assert found["rows"][0]["measured"]["tendon_tension_N"] == [-0.002]
    assert found["rows"][0]["model"]["tendon_tension_N"] == [0.0]
    assert "1 measured force is negative" in err
    assert "ignored columns: rig" in err
    table = list(csv.DictReader((tmp_path / "points.csv").read_text().splitlines()))
    assert float(table[1]["notch_1_deg_model"]) == pytest.approx(model[1])


def test_table_and_picture_with_other_models(call, loop, tmp_path):
    code, out, _ = call(
        "compare",
        "pacheco2021-b",
        loop,
        "--path",
        "--beside",
        "linear: material.kind=linear, material.elastic_modulus=7510",
        "--beside",
        "kinematics",
        "--plot",
        "b.svg",
    )
    assert code == 0
    assert ["rms", "error", "model", "linear", "kinematics"] in map(str.split, out.splitlines())
    assert max(len(line) for line in out.splitlines()) <= 80
    picture = (tmp_path / "b.svg").read_text(encoding="utf-8")
    for words in ("notch 5", "total", "centre lines", "kinematics", "tip error"):
        assert words in picture


def test_displacements_past_the_last_closing_fail_but_not_in_the_kinematic_model(call, tmp_path):
    header = "tendon_displacement_mm," + ",".join(f"notch_{j}_deg" for j in range(1, 6))
    rows = ["0.5,4,4,4,4,4", "1.5,12,12,12,12,12", "3.9,30,30,30,30,30"]
    (tmp_path / "d.csv").write_text("\n".join([header, *rows]))
    arguments = ("compare", "pacheco2021-a", "d.csv", "--beside", "kinematics", "--json", "-")
    code, out, err = call(*arguments)
    assert code == 1
    found = json.loads(out)
    assert found["points"] == 2
    assert "every notch closed" in found["reason"]
    assert found["beside"]["kinematics"]["points"] == 3
    assert "1 of 3 points, first row 3" in err


def test_nothing_solved_is_still_written_and_drawn(call, tmp_path):
    header = "tendon_displacement_mm," + ",".join(f"notch_{j}_deg" for j in range(1, 6))
    (tmp_path / "d.csv").write_text(f"{header}\n9,30,30,30,30,30\n")
    code, out, _ = call(
        "compare", "pacheco2021-a", "d.csv", "--json", "-", "--plot", "d.png", "--beside",
        "linear: material.kind=linear",
    )  # fmt: skip
    assert code == 1
    assert json.loads(out)["tip_rmse_mm"] is None
    assert (tmp_path / "d.png").exists()


def test_errors_of_no_solved_point_are_dashes(call, tmp_path):
    (tmp_path / "far.csv").write_text("tendon_displacement_mm,total_deg\n30,40\n")
    code, out, err = call("compare", "pacheco2021-a", "far.csv")
    assert (code, "nan" in out) == (1, False)
    assert "0 points of 1 trial" in out
    assert "not converged" in err
