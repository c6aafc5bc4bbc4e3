"""`notchflex simulate --uncertain`, and what `show` says of tolerances."""

import csv
import json
import re

import pytest

import notchflex as nf
from notchflex.support import DEGREES

LOOP = ["simulate", "pacheco2021-a", "--tension", "0:1:3,0.5", "--uncertain", "--draws", "16"]


@pytest.fixture(scope="module")
def bands(wrist: nf.Robot) -> nf.Bands:
    """The same in Python."""
    load = [nf.Load(tension=one) for one in (0.0, 0.5, 1.0, 0.5)]
    return nf.uncertain(wrist, load, draws=16)


def test_table_files_and_picture_have_the_bands(call, tmp_path, bands: nf.Bands):
    files = ["--json", "a.json", "--csv", "a.csv", "--plot", "a.svg"]
    code, out, err = call(*LOOP, *files)
    assert code == 0, err
    one = bands["total_angle"]
    ends = {"low": one.low, "median": one.median, "high": one.high}
    (line,) = (line.split() for line in out.splitlines() if line.startswith("   3 "))
    degrees = {name: float(end[2]) * DEGREES for name, end in ends.items()}
    assert line[2:5] == [f"{value:.2f}" for value in degrees.values()]
    assert "Tolerances assumed: notch.depth 0.01 mm (SD)" in out
    assert max(map(len, out.splitlines())) <= 100

    document = json.loads((tmp_path / "a.json").read_text(), parse_constant=pytest.fail)
    step = document["bands"]["steps"][2]
    assert step["total_angle_deg"] == pytest.approx(degrees, rel=1e-12)
    assert len(step["notch_angle_deg"]["low"]) == 5
    assert document["bands"]["tolerances"]["notch.depth"] == 0.01
    assert [one["converged"] for one in document["bands"]["steps"]] == [16] * 4

    rows = list(csv.DictReader((tmp_path / "a.csv").read_text().splitlines()))
    for name, value in degrees.items():
        assert float(rows[2][f"total_deg_{name}"]) == pytest.approx(value, rel=1e-12)
    assert rows[2]["draws_converged"] == "16"
    assert float(rows[2]["total_deg"]) == document["steps"][2]["total_angle_deg"]
    assert "5 to 95 % of draws" in (tmp_path / "a.svg").read_text(encoding="utf-8")


def test_without_the_option_nothing_is_new(call, tmp_path):
    plain = [word for word in LOOP if word not in ("--uncertain", "--draws", "16")]
    assert call(*plain, "--json", "a.json", "--csv", "a.csv")[0] == 0
    assert "bands" not in json.loads((tmp_path / "a.json").read_text())
    assert "_low" not in (tmp_path / "a.csv").read_text()


def test_named_columns_and_tolerances_of_the_robot(call):
    named = ["--columns", "gap,closed", "--set", "tolerance.notch.depth=0", "--all"]
    code, out, err = call(*LOOP, *named)
    assert code == 0, err
    assert "Tolerances: notch.depth 0 mm (SD)." in out
    assert "95 %" in out
    assert "yes" not in out.splitlines()[5]


@pytest.mark.parametrize("other", [["--beside", "pacheco2021-b"], ["--from-state", "x.json"]])
def test_what_does_not_go_together(call, other: list[str]):
    code, out, err = call(*LOOP, *other)
    assert (code, out) == (2, "")
    assert other[0] in err


def test_draws_that_fail_are_warned_of(call):
    words = ["simulate", "pacheco2021-a", "--stroke", "0:3.68:4", "--uncertain", "--draws", "16"]
    code, _, err = call(*words, "--set", "tolerance.notch.height=0.03")
    assert code == 0
    assert "of 16 draws did not converge, the first at step 4" in err


def test_show_says_how_right_it_is(call):
    code, out, err = call("show", "pacheco2021-a", "--json", "a.json")
    assert code == 0, err
    text = " ".join(out.partition("Accuracy:")[2].split())
    assert re.search(r" 1 1\.\d\d\d to 1\.\d\d\d ", text)
    assert "10 µm of depth in all notches change that angle by 3.9 deg" in text
    assert "material.elastic_modulus ±10 %" in text
    code, out, _ = call("show", "pacheco2021-a", "--json", "-")
    found = json.loads(out, parse_constant=pytest.fail)["tolerances"]
    assert found["notches"] == [1, 2, 3, 4, 5]
    low, high = (found["closing_tension_N"][end][0] for end in ("low", "high"))
    assert low < 1.6153 < high
    assert found["total_angle_deg_by_10um_depth"] == pytest.approx(3.94, abs=0.01)


def test_draws_belong_to_uncertain(call):
    """They were ignored without a word."""
    code, _, err = call("simulate", "pacheco2021-a", "--tension", "1", "--draws", "16")
    assert code == 2
    assert "--uncertain" in err
