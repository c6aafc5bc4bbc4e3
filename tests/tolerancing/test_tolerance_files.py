"""`notchflex tolerance` and its files: what is read, written and refused."""

from __future__ import annotations

import csv
import json

import numpy as np
import pytest

import notchflex as nf
from mutations import mutated
from notchflex.cli import run
from refusals import refused

FILE = """
wanted_yield = 0.95

[load.pulled]
tension = "0.45:0.9:2"

[load.pushed]
tension = ["1=0.9"]
tip_force = [-0.02, 0, 0]

[[accept]]
quantity = "total_angle"
load = "pulled"
lower = 42.0
upper = 51.0

[[accept]]
quantity = "tip_position"
load = "pushed"
axis = "x"
lower = 3.0

[tolerance]
notch.depth = { plus = 0.005, minus = 0.005 }
material.elastic_modulus = "5 %"
"""
WRIST = nf.load_robot("pacheco2021-a")


@pytest.fixture(autouse=True)
def folder(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "limits.toml").write_text(FILE, encoding="utf-8")
    return tmp_path


def test_what_a_file_says():
    spec = nf.read_tolerance_spec("limits.toml", WRIST)
    assert spec.loads["pulled"].tension[:, 0].tolist() == [0.45, 0.9]
    assert spec.loads["pushed"].external[0].tip_force == (-0.02, 0.0, 0.0)
    assert spec.limits[0].upper == pytest.approx(np.radians(51.0))
    assert spec.limits[1].lower == 3.0
    assert spec.wanted_yield == 0.95


def test_old_words_are_read_with_a_note(folder):
    old = FILE.replace("wanted_yield = 0.95", "") + "[yield]\nwanted = 0.95\n"
    (folder / "old.toml").write_text(old, encoding="utf-8")
    with pytest.warns(FutureWarning, match="`yield.wanted` is now called `wanted_yield`"):
        spec = nf.read_tolerance_spec("old.toml", WRIST)
    assert spec == nf.read_tolerance_spec("limits.toml", WRIST)


def test_a_limit_may_name_several_entries_and_a_short_quantity(folder):
    more = FILE + '[[accept]]\nquantity = "strain"\nload = "pulled"\nnotch = [2, 1]\nupper = 0.04\n'
    (folder / "more.toml").write_text(more, encoding="utf-8")
    found = nf.tolerance_analysis(WRIST, "more.toml", draws=50)
    names = [one.name for one in found.criteria if one.quantity.name == "peak_strain"]
    assert names == ["peak_strain[2] at pulled", "peak_strain[1] at pulled"]


def test_prints_and_writes(folder, capsys):
    options = ["--draws", "50", "--json", "found.json", "--csv", "robots.csv", "--plot", "a.svg"]
    assert run(["tolerance", "pacheco2021-a", "limits.toml", *options]) == 0
    words = " ".join(capsys.readouterr().out.split())
    assert "Control material.elastic_modulus first" in words
    assert "95 % are wanted" in words
    document = json.loads((folder / "found.json").read_text())
    assert [one["upper"] for one in document["limits"]] == [51.0, None]
    assert document["sources"][0]["name"] == "notch.depth"
    counts = document["yield"]["counts"]
    with (folder / "robots.csv").open() as file:
        rows = list(csv.DictReader(file))
    assert len(rows) == document["draws"] == sum(counts.values()) == 50
    good = sum(row["outcome"] == "accepted" for row in rows)
    assert good == counts["accepted"] == round(50 * document["yield"]["accepted"])
    angles = np.array([float(row["total_angle at pulled [deg]"]) for row in rows])
    tips = np.array([float(row["tip_position[x] at pushed [mm]"]) for row in rows])
    assert good == ((angles >= 42.0) & (angles <= 51.0) & (tips >= 3.0)).sum()
    assert "total Sobol index" in (folder / "a.svg").read_text()


@pytest.mark.parametrize(
    ("old", "new", "code"),
    [
        ("[tolerance]", "[tolerances]", "UNKNOWN_NAME"),
        ("wanted_yield = 0.95", "wanted_yield = 95", "OUT_OF_RANGE"),
        ("wanted_yield = 0.95", "want = 0.95", "UNKNOWN_NAME"),
        ("wanted_yield = 0.95", "yield.want = 0.95", "UNKNOWN_NAME"),
        ('tension = "0.45:0.9:2"', "tension = true", "WRONG_TYPE"),
        ('tension = "0.45:0.9:2"', 'tension = "a"', "NOT_A_NUMBER"),
        ('tension = "0.45:0.9:2"', "tension = -1", "OUT_OF_RANGE"),
        ('tension = "0.45:0.9:2"', "tension = nan", "NOT_FINITE"),
        ('tension = "0.45:0.9:2"', 'tension = "2=1"', "UNKNOWN_NAME"),
        ('tension = "0.45:0.9:2"', "", "MISSING_VALUE"),
        ('tension = "0.45:0.9:2"', "pull = 1", "UNKNOWN_NAME"),
        ("[-0.02, 0, 0]", "[1, 2]", "BAD_SYNTAX"),
        ('["1=0.9"]', '["1=0.9", 0.5]', "CONFLICT"),
        ("lower = 42.0", "lower = 52.0", "OUT_OF_RANGE"),
        ("lower = 42.0", 'lower = "42"', "WRONG_TYPE"),
        ("lower = 42.0", "least = 42", "UNKNOWN_NAME"),
        ('load = "pulled"', "", "MISSING_VALUE"),
        ('load = "pulled"', 'load = "pulls"', "UNKNOWN_NAME"),
        ('load = "pulled"', "load = 1", "WRONG_TYPE"),
        ('quantity = "total_angle"', "", "MISSING_VALUE"),
        ('quantity = "total_angle"', 'quantity = ["a"]', "WRONG_TYPE"),
        ('quantity = "total_angle"', 'quantity = "totl_angle"', "UNKNOWN_NAME"),
        ('axis = "x"', 'axis = "w"', "UNKNOWN_NAME"),
        ('axis = "x"', "", "MISSING_VALUE"),
        ("[[accept]]", "[accept]", "FILE_UNREADABLE"),
        ("plus = 0.005, ", "", "INVALID_ROBOT"),
        ("notch.depth =", "notch.dept =", "INVALID_ROBOT"),
        ('"5 %"', '"5"', "INVALID_ROBOT"),
        ("notch.depth = { plus = 0.005,", "notch.depth = { plus = 5.0,", "INVALID_ROBOT"),
        ("[tolerance]\n", "[tolerance]\n[tolerance]\n", "FILE_UNREADABLE"),
    ],
)
def test_bad_files_are_refused_and_nothing_is_written(folder, old, new, code):
    assert old in FILE
    (folder / "limits.toml").write_text(FILE.replace(old, new), encoding="utf-8")
    with refused(code):
        nf.tolerance_analysis(WRIST, "limits.toml", draws=50)
    assert run(["tolerance", "pacheco2021-a", "limits.toml", "--json", "found.json"]) == 2
    assert not (folder / "found.json").exists()


@pytest.mark.parametrize(
    "text", ["", "[load.a]\ntension = 1\n", '[[accept]]\nquantity = "tension"']
)
def test_files_that_lack_something(folder, text):
    (folder / "limits.toml").write_text(text, encoding="utf-8")
    with refused("MISSING_VALUE"):
        nf.read_tolerance_spec("limits.toml", WRIST)


def test_calls_that_cannot_be():
    assert run(["tolerance", "pacheco2021-a", "none.toml"]) == 2
    assert run(["tolerance", "pacheco2021-a", "limits.toml", "--draws", "3"]) == 2
    assert run(["tolerance", "pacheco2021-a", "limits.toml", "--json", "limits.toml"]) == 2
    assert run(["tolerance", "pacheco2021-a", "limits.toml", "--plot", "none/a.svg"]) == 2
    with refused("WRONG_TYPE"):
        nf.tolerance_analysis(WRIST, 3)
    with refused("WRONG_TYPE"):
        nf.tolerance_analysis("pacheco2021-a", "limits.toml")
    with refused("NO_DATA"):
        nf.ToleranceSpec([], {"pulled": nf.Load(tension=1.0)})


def test_a_robot_of_the_drawing_that_fails_is_named(folder):
    text = FILE.replace('"0.45:0.9:2"', "0.9\nstroke = 50.0").replace('["1=0.9"]', "0.9")
    (folder / "limits.toml").write_text(text, encoding="utf-8")
    with refused("CONFLICT", "load.pulled"):
        nf.tolerance_analysis(WRIST, "limits.toml", draws=50)
    text = FILE.replace('tension = "0.45:0.9:2"', "stroke = 50.0")
    (folder / "limits.toml").write_text(text, encoding="utf-8")
    with refused("NOT_CONVERGED", "pulled"):
        nf.tolerance_analysis(WRIST, "limits.toml", draws=50)


@pytest.mark.parametrize(
    "seeds", [range(20), pytest.param(range(20, 300), marks=pytest.mark.nightly)]
)
def test_300_mutated_files(seeds, folder, monkeypatch, capsys):
    """Each is refused with one sentence, or accepted; none writes a file or ends in a traceback."""

    class AcceptedError(Exception):
        """The file can be used: what becomes of it is tested elsewhere."""

    def stop(*_):
        raise AcceptedError

    monkeypatch.setattr("notchflex.tolerancing.analysis.linear_effects", stop)
    before, refusals = set(folder.iterdir()), 0
    for seed in seeds:
        (folder / "limits.toml").write_text(mutated(FILE, seed), encoding="utf-8")
        try:
            code = run(["tolerance", "pacheco2021-a", "limits.toml", "--json", "found.json"])
        except AcceptedError:
            continue
        out, err = capsys.readouterr()
        refusals += 1
        assert code == 2, (seed, err)
        assert err.startswith("Error: "), (seed, err)
        assert "Traceback" not in err
        assert out == ""
        assert set(folder.iterdir()) == before
    assert refusals > len(seeds) // 2
