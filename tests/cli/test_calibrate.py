"""`notchflex calibrate`: what it prints, writes, draws and refuses."""

from __future__ import annotations

import json
import re
from dataclasses import replace
from functools import partial
from pathlib import Path

import numpy as np
import pytest

import notchflex as nf
import notchflex.fit as fitting
from fitted import NAMES, OBSERVED, ROBOT, fitted, measured

FIT = ("--fit", ",".join(NAMES), "--starts", "1")
ALONE = (*FIT, "--no-priors")


@pytest.fixture
def calibrate(call):
    return partial(call, "calibrate")


@pytest.fixture
def data(tmp_path):
    """The measurements of the shared fit as a file."""
    nf.write_measurements(measured(), tmp_path / "a.csv")
    return "a.csv"


def test_from_csv_to_fitted_robot(calibrate, data, tmp_path):
    code, out, err = calibrate(
        *(f"A={ROBOT}={data}", *ALONE, "-o", "fitted", "--json", "fit.json", "--plot", "fit.html"),
        *("--next", "0.4,1.2", "--narrow", NAMES[0]),
    )
    assert code == 0
    found = fitted()  # of the same rows in memory
    words = out.split("\n")
    assert words[0] == "A: a.csv"
    interval = found.intervals[NAMES[0]]
    row = next(line for line in words if line.startswith(NAMES[0]))
    assert f"{interval.lower:.5g} to {interval.upper:.5g}" in row
    assert f"{found.values[NAMES[0]]:.5g}" in row
    assert sum(line.startswith("A      notch_angle ") for line in words) == 5
    assert "Next measurement of A, to narrow friction.coefficient:" in out
    assert re.search(r"(?m)^best: candidate [12]$", out)
    assert max(map(len, words)) <= 80
    assert "written: fitted/A.toml" in err
    document = json.loads((tmp_path / "fit.json").read_text(encoding="utf-8"))
    assert document["constants"][0]["value"] == pytest.approx(found.values[NAMES[0]], rel=1e-9)
    assert document["next_measurement"]["wanted"] == [NAMES[0]]
    back = nf.load_robot(tmp_path / "fitted" / "A.toml")
    assert back.friction.coefficient == document["constants"][0]["value"]
    note = f"fitted by notchflex to a.csv: {interval.lower:.5g} to {interval.upper:.5g} (95 %"
    assert note in (tmp_path / "fitted" / "A.toml").read_text(encoding="utf-8")
    picture = (tmp_path / "fit.html").read_text(encoding="utf-8")
    assert "95 % band of the model" in picture


def test_a_loop_without_any_hint_gives_the_constants_that_made_it(calibrate, tmp_path):
    """Loading and unloading of a known wrist, photographed with 0.6 deg of noise."""
    wrist = nf.load_robot(ROBOT)
    noise = {name: np.radians(0.6) for name in OBSERVED}
    load = nf.pull(0.2, 1.8, steps=9).release()
    seen = nf.simulate_measurements(
        wrist, load, observed=OBSERVED, deviation=noise, seed=5, from_rest=False
    )
    angles = np.degrees(seen.observed["notch_angle"])
    header = ["tendon_force_N", *(f"notch_{n}_deg" for n in range(1, 6)), "total_deg"]
    rows = np.column_stack([load.tension, angles, np.degrees(seen.observed["total_angle"])])
    np.savetxt(
        tmp_path / "loop.csv", rows, fmt="%.2f", delimiter=",", header=",".join(header), comments=""
    )
    nf.save_robot(wrist, tmp_path / "my.toml")
    code, out, err = calibrate("w=my.toml=loop.csv", *ALONE, "--json", "fit.json")
    assert code == 0
    document = json.loads((tmp_path / "fit.json").read_text(encoding="utf-8"))
    for one, true in zip(document["constants"], (0.13, 10_000.0), strict=True):
        low, high = one["interval_95"]
        assert low < true < high
        assert high - low < 0.1 * true
    assert "Unloading" not in out
    assert "loop.csv: the force falls within a pull" in " ".join(err.split())
    code, out, err = calibrate("w=my.toml=loop.csv", *ALONE, "--from-rest")
    assert code == 0
    assert "Unloading rows of loop.csv are" in out
    assert "No problems found" not in out
    found = nf.calibrate(
        wrist, nf.read_measurements("loop.csv", wrist), NAMES, starts=1, priors=False
    )
    assert found.values[NAMES[0]] == pytest.approx(document["constants"][0]["value"], rel=1e-6)


@pytest.mark.nightly
def test_a_robot_left_out_before_and_after_a_photograph(calibrate, tmp_path):
    # Linear, so that 12 % of force are 12 % of angle.
    nf.save_robot(nf.load_robot(ROBOT).with_value("material.kind", "linear"), tmp_path / "w.toml")
    wrist = nf.load_robot(tmp_path / "w.toml")
    load = nf.LoadPath(np.repeat([[0.6], [1.0], [1.4], [1.8]], 2, axis=0), np.full((8, 1), np.nan))
    for number, (name, factor) in enumerate({"A": 1.06, "B": 0.94, "C": 1.0}.items()):
        acting = nf.LoadPath(factor * load.tension, load.stroke)
        seen = nf.simulate_measurements(
            wrist, acting, deviation={"notch_angle": 0.005}, seed=number, pull=tuple("12" * 4)
        )
        shown = replace(seen, load=load, measured_tension=load.tension)
        nf.write_measurements(shown, tmp_path / f"{name}.csv")
    code, out, _ = calibrate(
        *(f"{name}=w.toml={name}.csv" for name in "ABC"),
        *("--fit", "material.elastic_modulus,each:sensor.force_factor", "--starts", "1"),
        *("--prior", "each:sensor.force_factor=1+-0.05", "--measured", "edge"),
        *("--leave-out", "robot", "--photograph", "--json", "fit.json"),
    )
    assert code == 0
    assert "Constants of a robot left out" in out
    assert max(map(len, out.split("\n"))) <= 80
    folds = json.loads((tmp_path / "fit.json").read_text(encoding="utf-8"))["left_out"]["folds"]
    assert [fold["left_out"] for fold in folds] == ["A", "B", "C"]
    for fold in folds[:2]:
        (blind,), (updated,) = fold["errors"], fold["photograph"]["errors"]
        assert blind["quantity"] == updated["quantity"] == "edge_angle"
        assert updated["error"] < 0.6 * blind["error"]
        assert f"{updated['error']:.3g}" in out
        ((mean, size),) = fold["before"].values()
        assert mean == 1.0
        assert size > 0.04
        assert fold["photograph"]["gain"] < 0.8


def test_a_search_that_does_not_settle_is_told(calibrate, data, monkeypatch):
    found = fitted()
    best = found.best._replace(converged=False, reason="not settled after 100 steps")
    monkeypatch.setattr(fitting, "calibrate", lambda *_, **__: replace(found, best=best))
    code, out, err = calibrate(f"{ROBOT}={data}", *ALONE, "-o", ".")
    assert code == 1
    assert "The search did not settle: not settled after 100 steps." in out
    assert "Error: not converged: not settled after 100 steps" in err


def test_what_cannot_be_done_beyond_the_fit_does_not_lose_it(calibrate, data, tmp_path):
    narrow = ("--next", "0.4,1.2", "--narrow", "x")
    code, out, err = calibrate(f"A={ROBOT}={data}", *ALONE, "-o", "fitted", *narrow)
    assert code == 2
    assert "--next: x was not fitted" in err
    assert NAMES[0] in out
    assert (tmp_path / "fitted" / "A.toml").exists()


def test_an_interrupted_fit_is_told_and_writes_nothing(calibrate, data, tmp_path, monkeypatch):
    def interrupted(*arguments, **options):
        raise KeyboardInterrupt

    monkeypatch.setattr(fitting, "calibrate", interrupted)
    code, out, err = calibrate(f"A={ROBOT}={data}", *ALONE, "-o", "fitted", "--json", "fit.json")
    assert code == 130
    assert out == ""
    assert "interrupted; nothing more is written" in err
    assert [file.name for file in tmp_path.iterdir()] == [data]


@pytest.mark.parametrize("by", ["pull", "robot"])
def test_what_was_left_out_is_predicted(calibrate, data, by):
    """Labels, values of one robot, limits and priors reach the fit, too."""
    long = "a-robot-with-a-rather-long-name"
    code, out, err = calibrate(
        *(f"A={ROBOT}={data}", f"{long}={ROBOT}={data}", *ALONE, "--leave-out", by),
        *("--set", "friction.coefficient=0.2", "--set", f"{long}:notch[2].depth=1.4"),
        *("--bounds", f"{NAMES[0]}=:0.9", "--prior", f"{NAMES[1]}=1e4±5000", "--json", "fit.json"),
    )
    assert code == 0, err
    assert max(map(len, out.splitlines())) <= 80
    document = json.loads(Path("fit.json").read_text(encoding="utf-8"))
    one, other = document["constants"]
    assert (one["limits"], one["before"]) == ([0.0, 0.9], 0.2)
    assert other["prior"] == [1e4, 5000.0]
    folds = document["left_out"]["folds"]
    assert [*dict.fromkeys(fold["left_out"].split(",")[0] for fold in folds)] == ["A", long]
    assert all(f"{fold['errors'][0]['error']:.3g}" in out for fold in folds)


PAIR = f"{ROBOT}=a.csv"


@pytest.mark.parametrize(
    ("code", "arguments"),
    [
        ("MISSING_VALUE", ["--fit", "x"]),
        ("MISSING_VALUE", [PAIR]),
        ("BAD_SYNTAX", [ROBOT, "--fit", "x"]),
        ("CONFLICT", [PAIR, PAIR, "--fit", "x"]),
        ("CONFLICT", [PAIR, f"{ROBOT}=x=b.csv", "--fit", "x"]),
        ("BAD_SYNTAX", [f"A:b={ROBOT}=a.csv", "--fit", "x"]),
        ("UNKNOWN_NAME", ["pacheco2021-q=a.csv", "--fit", "x"]),
        ("FILE_NOT_FOUND", [f"{ROBOT}=none.csv", *FIT]),
        ("NOT_A_NUMBER", [f"{ROBOT}=wrong.csv", *FIT]),
        ("UNKNOWN_NAME", [PAIR, "--fit", "friction.coeficient"]),
        ("UNKNOWN_NAME", [PAIR, "--fit", "frction.coefficient"]),
        ("UNKNOWN_NAME", [PAIR, "--fit", "sensor.ofset"]),
        ("UNKNOWN_NAME", [PAIR, "--fit", "B:friction.coefficient"]),
        ("CONFLICT", [PAIR, "--fit", "a,a"]),
        ("MISSING_VALUE", [PAIR, "--fit", "a,"]),
        ("UNKNOWN_NAME", [PAIR, *FIT, "--bounds", "x=0:1"]),
        ("BAD_SYNTAX", [PAIR, *FIT, "--bounds", f"{NAMES[0]}=0"]),
        ("OUT_OF_RANGE", [PAIR, *FIT, "--bounds", f"{NAMES[0]}=1:0"]),
        ("NOT_A_NUMBER", [PAIR, *FIT, "--bounds", f"{NAMES[0]}=a:1"]),
        ("BAD_SYNTAX", [PAIR, *FIT, "--prior", f"{NAMES[0]}=1"]),
        ("OUT_OF_RANGE", [PAIR, *FIT, "--prior", f"{NAMES[0]}=1+-0"]),
        ("OUT_OF_RANGE", [PAIR, *FIT[:2], "--starts", "0"]),
        ("CONFLICT", [PAIR, *FIT, "--huber", "2", "--objective", "robot-errors"]),
        ("UNSUPPORTED", [PAIR, *FIT, "--objective", "distances"]),
        ("CONFLICT", [PAIR, *FIT, "--narrow", "x"]),
        ("UNKNOWN_NAME", [PAIR, *FIT, "--next", "1", "--next-robot", "B"]),
        ("BAD_SYNTAX", [PAIR, *FIT, "--next", "1:2"]),
        ("UNKNOWN_NAME", [PAIR, *FIT, "--set", "B:friction.coefficient=1"]),
        ("NOT_A_NUMBER", [PAIR, *FIT, "--next", "x"]),
        ("UNKNOWN_NAME", [PAIR, *FIT, "--leave-out", "notch"]),
        ("TOO_FEW_DATA", [PAIR, *FIT, "--leave-out", "robot"]),
        ("CONFLICT", [PAIR, *FIT, "--leave-out", "pull", "--photograph"]),
        ("CONFLICT", [f"offset={PAIR}", *FIT]),
        ("UNKNOWN_NAME", [PAIR, "--fit", "times:notch.depth"]),
        ("OUT_OF_RANGE", [PAIR, *FIT, "--seed", "-1"]),
        ("NOT_A_NUMBER", [PAIR, *FIT, "--seed", "x"]),
        ("NOT_A_NUMBER", [PAIR, *FIT, "--huber", "x"]),
        ("CONFLICT", [PAIR, *FIT, "--bounds", f"{NAMES[0]}=0:1", "--bounds", f"{NAMES[0]}=0:2"]),
        ("BAD_SYNTAX", [PAIR, *FIT, "--prior", "x"]),
        ("OUT_OF_RANGE", [PAIR, *FIT, "--next", "-1"]),
        ("UNKNOWN_NAME", [PAIR, *FIT, "--next", "2=1"]),
        ("CONFLICT", [PAIR, *FIT, "--next-robot", "B"]),
        ("OUT_OF_RANGE", [PAIR, *FIT, "--posterior", "--draws", "3"]),
        ("CONFLICT", [PAIR, *FIT, "--posterior", "--objective", "robot-errors"]),
        ("CONFLICT", [f"each={ROBOT}=a.csv", *FIT]),
        ("CONFLICT", [PAIR, *FIT, "--json", "a.csv"]),
        ("CONFLICT", ["mine.toml=a.csv", *FIT, "-o", "."]),
        ("FILE_UNWRITABLE", [PAIR, *FIT, "-o", "a.csv"]),
        ("FILE_UNWRITABLE", [PAIR, *FIT, "-o", "none/fitted"]),
        ("CONFLICT", [PAIR, *FIT, "-o", ".", "--json", f"{ROBOT}.toml"]),
        ("FILE_FORMAT", [PAIR, *FIT, "--plot", "fit.txt"]),
    ],
)
def test_bad_input_is_one_sentence(refused, data, tmp_path, code, arguments):
    nf.save_robot(nf.load_robot(ROBOT), tmp_path / "mine.toml")
    (tmp_path / "wrong.csv").write_text("tendon_force_N,total_deg\nmuch,3\n")
    refused(code, "calibrate", *arguments)
