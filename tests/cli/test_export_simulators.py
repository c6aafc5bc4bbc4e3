"""`notchflex export` of models for simulators and of decks."""

import json

import pytest

pytest.importorskip("mujoco", reason="needs the extra robotics")


def test_all_files_at_once(call, tmp_path):
    code, out, err = call(
        *["export", "pacheco2021-a", "--mjcf", "a.xml", "--urdf", "a.urdf"],
        *["--transmission", "a.csv", "--inp", "a.inp"],
        *["--tension", "1", "--mesh", "coarse", "--json", "-"],
    )
    assert code == 0, err
    names = [one["file"] for one in json.loads(out)["files"]]
    assert sorted(names) == ["a.csv", "a.inp", "a.urdf", "a.xml"]
    assert all((tmp_path / name).stat().st_size > 500 for name in names)
    mjcf = next(one for one in json.loads(out)["files"] if one["file"] == "a.xml")
    assert mjcf["largest_tension_N"] == 1.0
    assert mjcf["errors"][0]["total_angle"] < 0.02
    assert mjcf["errors"][0]["largest_tension_N"] == 1.0


def test_a_deck_without_a_load_is_refused_where_no_notch_closes(refused):
    away = ["--set", "tendon.direction_deg=180"]
    refused("MISSING_VALUE", *["export", "pacheco2021-a", "--inp", "a.inp"], *away)


def test_a_deck_of_a_bent_tube_is_refused(refused):
    values = ["--set", "notch.precurvature_deg=4", "--tension", "0.1"]
    refused("UNSUPPORTED", *["export", "pacheco2021-a", "--inp", "a.inp"], *values)


def test_a_wrong_suffix_is_refused(refused):
    refused("FILE_FORMAT", *["export", "pacheco2021-a", "--mjcf", "a.txt"])
