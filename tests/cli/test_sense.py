"""`notchflex sense`: tables, files, exit codes and bad input."""

import csv
import json
import random

import pytest

ROBOT = "pacheco2021-a"
READ = """tendon_force_N,tendon_displacement_mm,tip_x_mm,tip_y_mm,tip_z_mm
0.2,0.2250,1.4,0,9.8
0.4,0.4730,2.9,0,9.1
0.6,,,,
0.38,0.4600,2.8,0,9.2
"""


@pytest.fixture
def read(tmp_path):
    (tmp_path / "read.csv").write_text(READ)
    return "read.csv"


def test_table_files_and_picture_agree(call, read, tmp_path):
    code, out, err = call("sense", ROBOT, read, "--json", "f.json", "--csv", "f.csv")
    assert code == 0, err
    assert "95 % intervals" in out
    document = json.loads((tmp_path / "f.json").read_text())
    rows = list(csv.DictReader((tmp_path / "f.csv").read_text().splitlines()))
    assert [row["reading"] for row in rows] == ["1", "2", "3", "4"]
    for row, one in zip(rows, document["readings"], strict=True):
        assert float(row["force_x_N"]) == one["force_N"]["x"]
        assert one["low_N"]["x"] <= one["force_N"]["x"] <= one["high_N"]["x"]
    assert [one["numbers_read"] for one in document["readings"]] == [1, 1, 0, 1]
    assert document["readings"][2]["limited"] == {"x": True}  # no stroke: nothing is known
    assert document["components"] == ["x"]
    code, out, err = call("sense", ROBOT, read, "--json", "-", "--plot", "f.html")
    assert json.loads(out) == document
    assert (tmp_path / "f.html").stat().st_size > 1000


@pytest.mark.nightly
def test_what_is_read_beside_is_used(call, read):
    code, out, err = call(
        "sense", ROBOT, read, "--with", "tip", "--components", "xz", "--quiet", "--json", "-"
    )
    assert code == 0, err
    readings = json.loads(out)["readings"]
    assert readings[0]["numbers_read"] == 4


@pytest.mark.nightly
def test_a_history_without_equilibrium_ends_with_code_1(call, tmp_path):
    (tmp_path / "far.csv").write_text("tendon_displacement_mm,tip_x_mm\n0.2,1.4\n60,3\n")
    code, out, err = call("sense", ROBOT, "far.csv", "--with", "tip", "--json", "-")
    assert code == 1
    assert "reading 2 of 2" in err
    document = json.loads(out)
    assert [one["converged"] for one in document["readings"]] == [True, False]
    assert document["readings"][1]["force_N"] == {"x": None}


@pytest.mark.parametrize(
    ("code", "arguments"),
    [
        ("FILE_NOT_FOUND", ["none.csv"]),
        ("UNKNOWN_NAME", ["read.csv", "--components", "xq"]),
        ("UNKNOWN_NAME", ["read.csv", "--with", "eyes"]),
        ("UNKNOWN_NAME", ["read.csv", "--place", "middle"]),
        ("OUT_OF_RANGE", ["read.csv", "--place", "9"]),
        ("OUT_OF_RANGE", ["read.csv", "--tension-noise", "-1"]),
        ("NOT_FINITE", ["read.csv", "--stroke-noise", "nan"]),
        ("NOT_A_NUMBER", ["read.csv", "--largest", "much"]),
        ("OUT_OF_RANGE", ["read.csv", "--largest", "0"]),
        ("TABLE_COLUMNS", ["read.csv", "--with", "angles"]),
        ("CONFLICT", ["read.csv", "--csv", "read.csv"]),
        ("FILE_FORMAT", ["read.csv", "--plot", "force.gif"]),
    ],
    ids=lambda value: value if isinstance(value, str) else " ".join(value),
)
def test_bad_input_is_refused(refused, read, code, arguments):
    assert read
    refused(code, "sense", ROBOT, *arguments)


def test_a_column_that_is_told_must_be_read(refused, read):
    told = "colour=tip_z_mm"  # it was left out without a word
    assert "colour_mm" in refused("UNKNOWN_NAME", "sense", ROBOT, read, "--column", told)


def test_tensions_that_are_all_negative_are_refused(refused, tmp_path):
    text = "tendon_force_N,tendon_displacement_mm,tip_x_mm\n-0.2,0.225,1.4\n-0.4,0.473,2.9\n"
    (tmp_path / "pushed.csv").write_text(text)
    message = refused("OUT_OF_RANGE", "sense", ROBOT, "pushed.csv", "--with", "tip")
    assert "-0.4 N" in message
    message = refused("OUT_OF_RANGE", "compare", ROBOT, "pushed.csv")
    assert "pushed.csv" in message


def mutated(rng: random.Random) -> str:
    """A table with something wrong, or nothing."""
    text = list(READ)
    for _ in range(rng.randint(1, 6)):
        place = rng.randrange(len(text))
        change = rng.choice(["", ",", "\n", "-", "x", "nan", "1e9", "0", ";", '"', "\x00", "é"])
        text[place : place + rng.randint(0, 3)] = [change]
    return "".join(text)


@pytest.mark.parametrize("count", [25, pytest.param(200, marks=pytest.mark.nightly)])
def test_no_mutated_table_ends_in_a_traceback(call, tmp_path, count):
    rng, codes = random.Random(0), []
    for _ in range(count):
        (tmp_path / "bad.csv").write_text(mutated(rng))
        code, out, err = call("sense", ROBOT, "bad.csv", "--json", "out.json", "--quiet")
        codes.append(code)
        assert code in (0, 1, 2), err
        assert (tmp_path / "out.json").exists() == (code != 2)
        (tmp_path / "out.json").unlink(missing_ok=True)
        if code == 2:
            assert (out, err.count("Error: ")) == ("", 1)
    assert codes.count(2) > count // 4
