"""`notchflex calibrate`: what it prints, writes, draws and refuses."""

from __future__ import annotations

import json
from dataclasses import replace
from functools import partial

import numpy as np
import pytest

import notchflex as nf
import notchflex.fit as fitting
from fitted import NAMES, OBSERVED, ROBOT, fitted, measured
from notchflex.cli.arguments.calibrate_words import parse_fit, parse_pairs, robots_of
from notchflex.cli.tables import calibrate_tables
from notchflex.fit import Fold, LeftOut, Posterior

FIT = ("--fit", ",".join(NAMES), "--starts", "1")


@pytest.fixture
def call(call):
    return partial(call, "calibrate")


@pytest.fixture
def data(tmp_path):
    """The measurements of the shared fit as a file."""
    nf.write_measurements(measured(), tmp_path / "a.csv")
    return "a.csv"


def test_from_csv_to_fitted_robot(call, data, tmp_path):
    code, out, err = call(
        *(f"A={ROBOT}={data}", *FIT, "-o", "fitted", "--json", "fit.json", "--plot", "fit.html"),
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
    assert sum(line.startswith("A     notch ") for line in words) == 5
    assert "Next measurement of A, to narrow friction.coefficient:" in out
    assert sum(line.endswith(" best") for line in words) == 1
    assert max(map(len, words)) <= 80
    assert "written: fitted/A.toml" in err
    document = json.loads((tmp_path / "fit.json").read_text(encoding="utf-8"))
    assert document["constants"][0]["value"] == pytest.approx(found.values[NAMES[0]], rel=1e-9)
    assert document["next_measurement"]["wanted"] == [NAMES[0]]
    back = nf.load_robot(tmp_path / "fitted" / "A.toml")
    assert back.friction.coefficient == document["constants"][0]["value"]
    note = f"fitted by notchflex to a.csv: {interval.lower:.5g} to {interval.upper:.5g} (95 %)"
    assert note in (tmp_path / "fitted" / "A.toml").read_text(encoding="utf-8")
    picture = (tmp_path / "fit.html").read_text(encoding="utf-8")
    assert "95 % band of the model" in picture


def test_a_loop_without_any_hint_gives_the_constants_that_made_it(call, tmp_path):
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
    code, out, err = call("w=my.toml=loop.csv", *FIT, "--json", "fit.json")
    assert code == 0
    document = json.loads((tmp_path / "fit.json").read_text(encoding="utf-8"))
    for one, true in zip(document["constants"], (0.13, 10_000.0), strict=True):
        low, high = one["interval_95"]
        assert low < true < high
        assert high - low < 0.1 * true
    assert "Unloading" not in out
    assert "loop.csv: the force falls within a pull" in " ".join(err.split())
    code, out, err = call("w=my.toml=loop.csv", *FIT, "--from-rest")
    assert code == 0
    assert "Unloading rows of loop.csv are" in out
    assert "No problems found" not in out
    found = nf.calibrate(wrist, nf.read_measurements("loop.csv", wrist), NAMES, starts=1)
    assert found.values[NAMES[0]] == pytest.approx(document["constants"][0]["value"], rel=1e-6)


def test_a_search_that_does_not_settle_is_told(call, data, monkeypatch):
    found = fitted()
    best = found.best._replace(converged=False, reason="not settled after 100 steps")
    monkeypatch.setattr(fitting, "calibrate", lambda *_, **__: replace(found, best=best))
    code, out, err = call(f"{ROBOT}={data}", *FIT, "-o", ".")
    assert code == 1
    assert "The search did not settle: not settled after 100 steps." in out
    assert "Error: not converged: not settled after 100 steps" in err


def test_what_cannot_be_done_beyond_the_fit_does_not_lose_it(call, data, tmp_path):
    narrow = ("--next", "0.4,1.2", "--narrow", "x")
    code, out, err = call(f"A={ROBOT}={data}", *FIT, "-o", "fitted", *narrow)
    assert code == 2
    assert "--next: x was not fitted" in err
    assert NAMES[0] in out
    assert (tmp_path / "fitted" / "A.toml").exists()


def test_an_interrupted_fit_is_told_and_writes_nothing(call, data, tmp_path, monkeypatch):
    def interrupted(*arguments, **options):
        raise KeyboardInterrupt

    monkeypatch.setattr(fitting, "calibrate", interrupted)
    code, out, err = call(f"A={ROBOT}={data}", *FIT, "-o", "fitted", "--json", "fit.json")
    assert code == 130
    assert out == ""
    assert "interrupted; nothing more is written" in err
    assert [file.name for file in tmp_path.iterdir()] == [data]


def test_other_tables_fit_80_columns(capsys):
    found = fitted()
    long = "notch[12].very_long_name_of_a_constant_of_a_robot"
    drawn = Posterior(
        (long,), np.arange(8.0).reshape(2, 4, 1) * 1e3, {long: 8.0}, {long: np.nan}, 0
    )
    calibrate_tables.print_posterior(drawn)
    errors = {"total_angle": 0.1, "tip_position": 0.2}
    folds = (Fold("A, pull a", found, errors, errors, True), Fold("B", found, {}, {}, False))
    calibrate_tables.print_left_out(LeftOut("pull", found, folds))
    out = capsys.readouterr().out
    assert max(map(len, out.splitlines())) <= 80
    assert "5.73" in out  # 0.1 rad
    assert "not solved" in out


def test_pairs():
    given = parse_pairs(["A=w.toml=1.csv", "A=w.toml=2.csv", "x/w.toml=3.csv", "gao2017=4.csv"])
    assert given.robot == {"A": "w.toml", "w": "x/w.toml", "gao2017": "gao2017"}
    assert given.data == {"A": ["1.csv", "2.csv"], "w": ["3.csv"], "gao2017": ["4.csv"]}


def test_limits_and_priors():
    one, other = parse_fit(["a.b, A:c.d"], ["a.b=:2", "A:c.d=-1:1e3"], ["A:c.d=10+-0.5"])
    assert one == ("a.b", None, 2.0, None)
    assert other == ("A:c.d", -1.0, 1000.0, (10.0, 0.5))
    assert parse_fit(["m"], [], ["m=1e4±500"])[0].prior == (10_000.0, 500.0)


def test_values_are_set_in_all_robots_or_one():
    given = parse_pairs([f"A={ROBOT}=1.csv", f"B={ROBOT}=2.csv"])
    robots = robots_of(given, ["friction.coefficient=0.2", "B:notch[2].depth=1.38"])
    assert {one.friction.coefficient for one in robots.values()} == {0.2}
    assert [one.notches[1].depth for one in robots.values()] == [1.4, 1.38]


PAIR = f"{ROBOT}=a.csv"


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["--fit", "x"], "Give a robot with its data: ROBOT=DATA.csv"),
        ([PAIR], "--fit"),
        ([ROBOT, "--fit", "x"], "is no robot with its data; give ROBOT=DATA.csv"),
        ([PAIR, PAIR, "--fit", "x"], "a.csv is given twice"),
        ([PAIR, f"{ROBOT}=x=b.csv", "--fit", "x"], f"both called {ROBOT}"),
        ([f"A:b={ROBOT}=a.csv", "--fit", "x"], "a label must not hold"),
        (["pacheco2021-q=a.csv", "--fit", "x"], "pacheco2021-"),
        ([f"{ROBOT}=none.csv", *FIT], "none.csv: there is no such file"),
        ([f"{ROBOT}=wrong.csv", *FIT], "wrong.csv, line 2: tendon_force_N"),
        ([PAIR, "--fit", "friction.coeficient"], "did you mean `coefficient`?"),
        ([PAIR, "--fit", "frction.coefficient"], "did you mean `friction`?"),
        ([PAIR, "--fit", "sensor.ofset"], "sensor.force_offset and sensor.stroke_slack"),
        ([PAIR, "--fit", "B:friction.coefficient"], "no robot of this fit is called B"),
        ([PAIR, "--fit", "a,a"], "--fit a is given twice"),
        ([PAIR, "--fit", "a,"], "--fit needs names"),
        ([PAIR, *FIT, "--bounds", "x=0:1"], "x is not fitted"),
        ([PAIR, *FIT, "--bounds", f"{NAMES[0]}=0"], "NAME=LOW:HIGH"),
        ([PAIR, *FIT, "--bounds", f"{NAMES[0]}=1:0"], "the lower limit must be below"),
        ([PAIR, *FIT, "--bounds", f"{NAMES[0]}=a:1"], "'a' is no finite number"),
        ([PAIR, *FIT, "--prior", f"{NAMES[0]}=1"], "NAME=MEAN+-SD"),
        ([PAIR, *FIT, "--prior", f"{NAMES[0]}=1+-0"], "a standard deviation above 0"),
        ([PAIR, *FIT[:2], "--starts", "0"], "--starts 0: give 1 or more"),
        ([PAIR, *FIT, "--huber", "2", "--objective", "robot-errors"], "belongs to least-squares"),
        ([PAIR, *FIT, "--objective", "distances"], "SumOfDistances adds distances of points"),
        ([PAIR, *FIT, "--narrow", "x"], "belong to --next"),
        ([PAIR, *FIT, "--next", "1", "--next-robot", "B"], "no robot of this fit is called so"),
        ([PAIR, *FIT, "--next", "1:2"], "is no start:stop:count"),
        ([PAIR, *FIT, "--set", "B:friction.coefficient=1"], "no robot of this fit is called B"),
        ([PAIR, *FIT, "--next", "x"], "--next x: 'x' is no number"),
        ([PAIR, *FIT, "--leave-out", "notch"], "--leave-out"),
        ([PAIR, *FIT, "--leave-out", "robot"], "there is only one robot"),
        ([PAIR, *FIT, "--seed", "-1"], "--seed -1: give 0 or more"),
        ([PAIR, *FIT, "--posterior", "--draws", "3"], "--draws 3: give 4 or more"),
        ([PAIR, *FIT, "--posterior", "--objective", "robot-errors"], "is no likelihood"),
        ([f"each={ROBOT}=a.csv", *FIT], "no robot can be called each"),
        ([PAIR, *FIT, "--json", "a.csv"], "would replace the file that is read"),
        (["mine.toml=a.csv", *FIT, "-o", "."], "would replace the file that is read"),
        ([PAIR, *FIT, "-o", "a.csv"], "is a file, not a folder"),
        ([PAIR, *FIT, "-o", "none/fitted"], "does not exist"),
        ([PAIR, *FIT, "-o", ".", "--json", f"{ROBOT}.toml"], "both write to"),
        ([PAIR, *FIT, "--plot", "fit.txt"], "--plot fit.txt"),
    ],
)
def test_bad_input_is_one_sentence(call, data, tmp_path, arguments, words):
    nf.save_robot(nf.load_robot(ROBOT), tmp_path / "mine.toml")
    (tmp_path / "wrong.csv").write_text("tendon_force_N,total_deg\nmuch,3\n")
    before = {file.name: file.read_bytes() for file in tmp_path.iterdir()}
    code, out, err = call(*arguments)
    assert code == 2
    assert out == ""
    assert words in " ".join(err.split())
    assert err.count("Error:") == 1
    assert {file.name: file.read_bytes() for file in tmp_path.iterdir()} == before
