"""Fits as documents, and as robot files that say where their values came from."""

from __future__ import annotations

import json
from dataclasses import replace

import numpy as np
import pytest

import notchflex as nf
from fitted import NAMES, ROBOT, fitted
from notchflex.fit import (
    Fold,
    Interval,
    LeftOut,
    NextMeasurement,
    Posterior,
    calibration_document,
    diagnose,
    errors_of_parts,
    left_out_document,
    next_measurement_document,
    posterior_document,
    repeats_of_each,
)
from notchflex.results.tables import json_text
from refusals import refused


def as_read(document):
    """What a reader of the file finds."""
    return json.loads(json_text(document))


def opened(found, name, reason="nothing holds it"):
    """The same fit with an interval that the data leave open above."""
    closed = found.intervals[name]
    interval = Interval(closed.lower, None, closed.profile, reason)
    return replace(found, intervals={**found.intervals, name: interval})


def test_constants_are_those_of_the_fit():
    found = fitted()
    document = as_read(calibration_document(found))
    assert [one["name"] for one in document["constants"]] == list(NAMES)
    friction, modulus = document["constants"]
    assert (friction["unit"], modulus["unit"]) == ("", "MPa")
    for one in (friction, modulus):
        interval = found.intervals[one["name"]]
        assert one["value"] == found.values[one["name"]]
        assert one["interval_95"] == [interval.lower, interval.upper]
        assert one["standard_deviation"] == found.deviations[one["name"]]
    assert friction["limits"] == [0.0, 1000.0]
    assert (friction["before"], modulus["before"]) == (0.13, 10_000.0)
    np.testing.assert_allclose(document["correlation"], found.correlation)
    assert document["cost"] == found.cost
    assert document["solves"] == found.solves
    assert document["verdict"] == list(diagnose(found))
    assert document["searches"][0]["cost"] == pytest.approx(found.cost)
    told = document["robots"]["Pacheco 2021, wrist A"]
    assert told["data"] == ["synthetic"]
    assert told["robot"]["friction"]["coefficient"] == pytest.approx(friction["value"])


def test_open_ends_are_null_with_their_reason():
    document = as_read(calibration_document(opened(fitted(), NAMES[0])))
    one = document["constants"][0]
    assert one["interval_95"][0] is not None
    assert one["interval_95"][1] is None
    assert one["interval_reason"] == "nothing holds it"


def test_errors_are_in_degrees_part_by_part():
    found = fitted()
    rows = errors_of_parts(found)
    assert [one.title for one in rows] == [
        *(f"notch {n}" for n in range(1, 6)),
        "total bending angle",
    ]
    measured = found.problem.samples.every[0].measured
    model = nf.solve_each(found.robots["Pacheco 2021, wrist A"], measured.load)
    off = np.degrees(model.notch_angle - measured.observed["notch_angle"])
    errors = [one.error for one in rows]
    np.testing.assert_allclose(errors[:5], np.sqrt(np.mean(off**2, axis=0)), rtol=1e-6)
    total = np.degrees(model.total_angle - measured.observed["total_angle"])
    assert errors[5] == pytest.approx(np.sqrt(np.mean(total**2)), rel=1e-6)
    floor = np.degrees(repeats_of_each(measured)["notch_angle"])
    np.testing.assert_allclose([one.repeats for one in rows[:5]], floor)
    document = as_read(calibration_document(found))
    assert [one["rmse"] for one in document["errors"]] == errors
    assert {one["unit"] for one in document["errors"]} == {"deg"}


def test_noise_tells_where_it_was_known_from():
    rows = as_read(calibration_document(fitted()))["noise"]
    assert [one["quantity"] for one in rows] == ["notch_angle", "total_angle"]
    assert {one["known_from"] for one in rows} == {"given"}
    assert rows[0]["standard_deviation"] == pytest.approx(np.degrees(0.01))


def test_left_out_parts():
    found = fitted()
    fold = Fold("A, pull a", found, {"total_angle": 0.1}, {"total_angle": 0.05}, True)
    lost = Fold("A, pull b", found, {}, {}, False)
    document = as_read(left_out_document(LeftOut("pull", found, (fold, lost))))
    first, second = document["folds"]
    assert first["errors"] == [
        {
            "quantity": "total_angle",
            "unit": "deg",
            "error": pytest.approx(np.degrees(0.1)),
            "error_of_all": pytest.approx(np.degrees(0.05)),
            "inside_90": None,
        }
    ]
    assert (second["solved"], second["errors"]) == (False, [])
    assert document["constants"] == found.values


def test_candidates_count_from_one():
    narrower = np.array([[0.9, 0.5], [np.nan, np.nan]])
    told = NextMeasurement(
        "A",
        nf.pull(0.5, 1.0, steps=2),
        narrower,
        np.array([0.7, np.nan]),
        NAMES,
        NAMES[1:],
        np.array([True, False]),
    )
    document = as_read(next_measurement_document(told))
    assert document["best"] == 1
    first, second = document["candidates"]
    assert first["load"] == {"tension_N": [0.5], "stroke_mm": [None]}
    assert first["narrower"] == dict(zip(NAMES, (0.9, 0.5), strict=True))
    assert first["gain"] == 0.5
    assert second["gain"] is None
    assert second["converged"] is False


def test_draws():
    draws = np.arange(12.0).reshape(2, 3, 2)
    drawn = Posterior(
        NAMES, draws, dict.fromkeys(NAMES, 5.0), dict.fromkeys(NAMES, float("nan")), 1
    )
    assert len(repr(drawn)) < 400
    document = as_read(posterior_document(drawn, draws=True))
    assert document["constants"][0]["mean"] == 5.0
    assert document["constants"][1]["split_r_hat"] is None
    assert document["draws"][NAMES[1]] == [[1.0, 3.0, 5.0], [7.0, 9.0, 11.0]]
    assert "draws" not in posterior_document(drawn)


def test_a_profile_is_shown_in_a_few_lines():
    found = fitted()
    assert len(repr(found.profile(found.names[0]))) < 400


def test_written_robot_keeps_comments_and_says_where_values_came_from(tmp_path):
    found = fitted()
    (file,) = nf.write_fitted(found, tmp_path / "fitted")
    assert file == tmp_path / "fitted" / "Pacheco 2021, wrist A.toml"
    back = nf.load_robot(file)
    assert back == found.robots["Pacheco 2021, wrist A"]
    new = file.read_text(encoding="utf-8").splitlines()
    nf.save_robot(nf.load_robot(ROBOT), tmp_path / "old.toml")
    old = (tmp_path / "old.toml").read_text(encoding="utf-8").splitlines()
    assert len(new) == len(old)
    changed = [line for line in new if line not in old]
    low, high = (found.intervals[NAMES[0]].lower, found.intervals[NAMES[0]].upper)
    assert changed[1] == (
        f"coefficient = {found.values[NAMES[0]]}  # mu, Table 3; fitted by notchflex to synthetic: "
        f"{low:.5g} to {high:.5g} (95 %) (changed from 0.13)"
    )
    assert changed[0].startswith("elastic_modulus = ")
    assert " MPa (95 %, by 2 whole pulls) (changed from 10000.0)" in changed[0]
    # fitted again: one note, and still what the comment speaks of
    notes = {"friction.coefficient": "b.csv: at least 0.1 (95 %)"}
    nf.save_robot(back.with_value("friction.coefficient", 0.2), tmp_path / "b.toml", fitted=notes)
    assert (
        "coefficient = 0.2  # mu, Table 3; fitted by notchflex to b.csv: at least 0.1 (95 %) "
        "(changed from 0.13)\n"
    ) in (tmp_path / "b.toml").read_text(encoding="utf-8")


def test_open_interval_and_unsettled_search_are_told(tmp_path):
    found = opened(fitted(), NAMES[0])
    found = replace(found, best=found.best._replace(converged=False))
    (file,) = nf.write_fitted(found, tmp_path)
    low = found.intervals[NAMES[0]].lower
    note = f"synthetic: at least {low:.5g} (95 %); the search did not settle (changed"
    assert note in file.read_text(encoding="utf-8")


def test_input_files_are_never_replaced(tmp_path):
    found = fitted()
    (file,) = nf.write_fitted(found, tmp_path)
    text = file.read_text(encoding="utf-8")
    with refused("CONFLICT", file.name):
        nf.write_fitted(found, tmp_path, inputs=[file])
    nf.save_robot(nf.load_robot(ROBOT), file)  # now the file that the robot came from
    with refused("CONFLICT", file.name):
        nf.write_fitted(found, tmp_path)
    assert file.read_text(encoding="utf-8") != text
    (tmp_path / "file").touch()
    with refused("FILE_UNWRITABLE", "file"):
        nf.write_fitted(found, tmp_path / "file")
    with refused("FILE_UNWRITABLE", "none"):
        nf.write_fitted(found, tmp_path / "none" / "folder")
