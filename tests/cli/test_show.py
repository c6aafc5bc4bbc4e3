"""`notchflex show`: sections and closing of every notch."""

import json
from dataclasses import replace

import numpy as np
import pytest

import notchflex as nf
from notchflex.analysis import closing_loads
from notchflex.cli import run


def test_table_fits_80_columns_and_numbers_are_right(capsys):
    assert run(["show", "pacheco2021-c"]) == 0
    out = capsys.readouterr().out
    assert max(len(line) for line in out.splitlines()) <= 80
    # Closing forces of wrist C: tests/reference/pacheco_closing.csv
    assert all(number in out for number in ("2.309", "38.62", "9.20", "1.3735", "0.1369"))


def test_json(capsys):
    assert run(["show", "pacheco2021-a", "--json", "-", "--set", "notch[5].depth=1.45"]) == 0
    document = json.loads(capsys.readouterr().out, parse_constant=pytest.fail)
    first, last = document["notches"][0], document["notches"][4]
    assert first["centroid_mm"] == pytest.approx(0.6865332868, rel=1e-9)
    assert first["second_moment_mm4"] == pytest.approx(0.0005816412685, rel=1e-9)
    assert first["moment_arm_mm"] == pytest.approx([1.386533287], rel=1e-9)
    assert first["closing_angle_deg"] == pytest.approx(30.62853597, rel=1e-9)
    assert first["closing_tension_N"] == pytest.approx(1.61530605, rel=1e-8)
    assert first["closing_outer_strain"] == pytest.approx(0.08250181552, rel=1e-9)
    assert last["depth_mm"] == 1.45
    assert last["area_mm2"] < first["area_mm2"]


@pytest.mark.parametrize("suffix", ["png", "svg", "pdf"])
def test_dimensioned_drawing(tmp_path, capsys, suffix):
    file = tmp_path / f"drawing.{suffix}"
    arguments = ["show", "pacheco2021-a", "--set", "notch.depth=1.38", "--plot", str(file)]
    assert run([*arguments, "--quiet"]) == 0
    assert capsys.readouterr().out == ""
    assert file.stat().st_size > 5000
    if suffix == "svg":
        assert "1.38" in file.read_text(encoding="utf-8")


def test_drawing_that_cannot_be_written(tmp_path, capsys):
    file = tmp_path / "drawing.html"
    assert run(["show", "pacheco2021-a", "--plot", str(file)]) == 2
    assert ".png, .svg or .pdf" in capsys.readouterr().err
    same = str(tmp_path / "both.png")
    assert run(["show", "pacheco2021-a", "--plot", same, "--json", same]) == 2
    assert not any(tmp_path.iterdir())


@pytest.mark.nightly
def test_a_force_loss_is_shown_with_its_unit(capsys):
    assert run(["show", "pacheco2021-a", "--set", "friction.constant_loss=0.05"]) == 0
    assert "constant loss 0.05 N" in " ".join(capsys.readouterr().out.split())


def test_only_what_differs_between_notches_is_listed_and_equal_ones_together(call, tmp_path):
    strips = nf.load_robot("liu2022")
    arc = nf.ArcNotch("off-axis", depth=7.0, height=2.0, uncut_length=1.0)
    nf.save_robot(strips.replace(notch=(*strips.notch, arc)), tmp_path / "mixed.toml")
    code, out, _ = call("show", "mixed.toml")
    assert code == 0
    assert max(map(len, out.splitlines())) <= 80
    rows = [" ".join(line.split()) for line in out.splitlines()]
    assert any(row.startswith("1, 2, 3, 4, 5, 6, 7 strip") for row in rows)
    assert any(row.startswith("8 arc") for row in rows)
    assert "never: no tension closes the notch." in " ".join(out.split())


def test_a_failed_search_is_not_called_never(call, monkeypatch):
    found = closing_loads.notch_table

    def one_failed(*arguments):
        first, *others = found(*arguments)
        return [first | {"closing_status": "not found", "closing_tension_N": float("nan")}, *others]

    monkeypatch.setattr(closing_loads, "notch_table", one_failed)
    out = " ".join(call("show", "pacheco2021-a")[1].split())
    assert out.count("not found") == 2  # in the table and in its legend
    assert "the notch may close" in out
    assert "never" not in out


def test_plateaus_and_closing_at_both_temperatures(capsys):
    setting = ["--set", "material.reference_temperature=37"]
    assert run(["show", "pacheco2021-a-true", *setting, "--json", "-"]) == 0
    bench, body = json.loads(capsys.readouterr().out)["temperatures"]
    wrist = nf.load_robot("pacheco2021-a-true")
    assert (bench["temperature_C"], body["temperature_C"]) == (22.0, 37.0)
    assert body["plateau_MPa"] - bench["plateau_MPa"] == pytest.approx(97.5, abs=1e-9)
    tension = nf.closing(wrist).tension
    assert body["closing_tension_N"] == pytest.approx([tension.min(), tension.max()], rel=1e-12)
    stress = wrist.material.plateau_stress - 97.5
    tension = nf.closing(wrist.with_value("material.plateau_stress", stress)).tension
    assert bench["closing_tension_N"] == pytest.approx([tension.min(), tension.max()], rel=1e-12)


def test_flexures_of_a_nitinol_of_their_own_are_warmed_and_named(call, tmp_path):
    """The material of the robot, that of no flexure here, has no part in the table."""
    wrist = nf.load_robot("pacheco2021-a-true").with_value("material.reference_temperature", 22.0)
    arc = replace(wrist.notch[0], repeat=1)
    strong = replace(wrist.material, plateau_stress=400.0)
    linear = nf.Linear(50e3, density=wrist.material.density)
    notch = [replace(arc, material=strong), replace(arc, material=linear), arc]
    tendon = [replace(wrist.tendon[0], end_body=None)]
    nf.save_robot(wrist.replace(notch=notch, tendon=tendon), tmp_path / "mixed.toml")
    rows = json.loads(call("show", "mixed.toml", "--json", "-")[1])["temperatures"]
    assert [(row["temperature_C"], row["notches"]) for row in rows] == [
        (22.0, "1"),
        (22.0, "3"),
        (37.0, "1"),
        (37.0, "3"),
    ]
    usual = wrist.material.plateau_stress
    plateaus = [400.0, usual, 497.5, usual + 97.5]
    assert [row["plateau_MPa"] for row in rows] == pytest.approx(plateaus, abs=1e-9)
    shifted = [replace(wrist.material, plateau_stress=one) for one in plateaus[2:]]
    warm = [replace(arc, material=shifted[0]), notch[1], replace(arc, material=shifted[1])]
    tension = nf.closing(wrist.replace(notch=warm, tendon=tendon)).tension
    found = [row["closing_tension_N"] for row in rows[2:]]
    assert found == [pytest.approx([one, one], rel=1e-9) for one in (tension[0], tension[2])]


def test_a_backbone_that_never_closes_hides_no_closing_of_notches(call, tmp_path):
    wrist = nf.load_robot("pacheco2021-a-true").with_value("material.reference_temperature", 37.0)
    rod = nf.RodGap(2.0, 0.5, uncut_length=1.0)
    tendon = [replace(wrist.tendon[0], end_body=None, path="straight")]
    robot = wrist.replace(notch=(rod, *wrist.notch), tendon=tendon)
    nf.save_robot(robot, tmp_path / "carried.toml")
    body = json.loads(call("show", "carried.toml", "--json", "-")[1])["temperatures"][1]
    tension = nf.closing(robot).tension
    ends = [np.nanmin(tension), np.nanmax(tension)]
    assert body["closing_tension_N"] == pytest.approx(ends, rel=1e-9)
