"""`notchflex workspace`: tables, files, comparison and bad input."""

import json

import pytest

ROBOT = "pacheco2021-a"
FEW = ("--states", "256", "--tension", "1.2")


def test_files_and_table(call, tmp_path):
    code, out, err = call(
        "workspace", ROBOT, *FEW, "--limit", "strain=0.04", "--json", "w.json", "--plot", "w.png"
    )
    assert code == 0, err
    document = json.loads((tmp_path / "w.json").read_text())
    assert document["states"]["solved"] == 256
    assert document["peak_strain"]["largest"] <= 0.04
    assert document["limits"] == ["peak strain at most 0.04"]
    assert f"{document['convex_hull']['size']:.4g} mm²" in out
    units, *parts = out.partition("\nstates")[2].splitlines()
    assert units.split() == ["deg", "strain", "N", "mm"]
    assert [part.split()[0] for part in parts] == ["5", "50", "95", "largest"]
    assert (tmp_path / "w.png").stat().st_size > 1000


def test_degrees_at_the_edge(call):
    code, out, err = call("workspace", ROBOT, *FEW, "--limit", "angle=30", "--json", "-")
    assert code == 0, err
    angle = json.loads(out)["total_angle_deg"]["largest"]
    assert 29.5 < angle <= 30.0


@pytest.mark.nightly
def test_two_robots_are_compared(call, tmp_path):
    code, out, err = call(
        *("workspace", ROBOT, *FEW, "--beside", "slick: friction.coefficient=0"),
        *("--json", "w.json", "--plot", "w.html"),
    )
    assert code == 0, err
    document = json.loads((tmp_path / "w.json").read_text())
    assert document["beside"]["slick"]["hysteresis_mm"]["largest"] < 1e-6
    assert document["overlaps"][0]["both"] > 0
    assert "in first" in out


def test_nothing_left_ends_with_code_1(call):
    code, out, err = call("workspace", ROBOT, *FEW, "--limit", "strain=-1", "--json", "-")
    assert code == 1
    assert "no state is left" in err
    assert json.loads(out)["states"]["kept"] == 0


@pytest.mark.parametrize(
    ("code", "arguments"),
    [
        ("UNKNOWN_NAME", ["--limit", "colour=1"]),
        ("BAD_SYNTAX", ["--limit", "strain"]),
        ("BAD_SYNTAX", ["--limit", "strain=:"]),
        ("NOT_A_NUMBER", ["--limit", "strain=much"]),
        ("NOT_FINITE", ["--limit", "strain=nan"]),
        ("OUT_OF_RANGE", ["--limit", "strain=0.1:0.01"]),
        ("CONFLICT", ["--limit", "strain=0.1", "--limit", "strain=0.2"]),
        ("OUT_OF_RANGE", ["--states", "3"]),
        ("NOT_A_NUMBER", ["--states", "many"]),
        ("OUT_OF_RANGE", ["--tension", "-1"]),
        ("WRONG_SHAPE", ["--tension", "1,2"]),
        ("FILE_FORMAT", ["--nc", "-"]),
        ("FILE_FORMAT", ["--plot", "w.gif"]),
    ],
    ids=lambda value: value if isinstance(value, str) else " ".join(value),
)
def test_bad_input_is_refused(refused, code, arguments):
    refused(code, "workspace", ROBOT, *arguments)
