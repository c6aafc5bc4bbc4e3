"""Bad input: exit code 2, one clear message, nothing written, nothing computed."""

import sys

import pytest

from notchflex import load_robot, save_robot

ROBOT = """\
name = "mine"
[tube]
outer_diameter = 1.62
inner_diameter = 1.40
[[notch]]
kind = "arc"
cut = "on-axis"
depth = 1.40
height = 0.8
uncut_length = 1.2
repeat = 2
[[tendon]]
radius = 0.70
[material]
kind = "superelastic"
elastic_modulus = 10000
superelastic_modulus = 3000
transition_strain = 0.028
[friction]
kind = "capstan"
coefficient = 0.13
"""
DATA = "tendon_force_N,notch_1_deg,notch_2_deg\n0.5,4,4\n"
SIMULATE = ["simulate", "mine.toml", "--tension", "2", "--json", "out.json"]


@pytest.fixture(autouse=True)
def folder(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "mine.toml").write_text(ROBOT, encoding="utf-8")
    (tmp_path / "data.csv").write_text(DATA, encoding="utf-8")
    (tmp_path / "folder").mkdir()
    return tmp_path


@pytest.mark.parametrize(
    ("code", "old", "new"),
    [
        ("INVALID_ROBOT", "depth = 1.40", "depth = 1.62"),
        ("INVALID_ROBOT", "depth = 1.40", "depth = nan"),
        ("INVALID_ROBOT", "depth = 1.40", 'depth = "deep"'),
        ("INVALID_ROBOT", "inner_diameter = 1.40", "inner_diameter = 1.62"),
        ("INVALID_ROBOT", "coefficient = 0.13", "coeficient = 0.13"),
        ("INVALID_ROBOT", "repeat = 2", "repeat = 2.5"),
        ("INVALID_ROBOT", 'cut = "on-axis"', ""),
        ("INVALID_ROBOT", 'kind = "capstan"', 'kind = "glue"'),
        ("FILE_UNREADABLE", "depth = 1.40", "depth = "),
        ("FILE_UNREADABLE", "[tube]", "[tube"),
    ],
)
def test_robot_files(folder, refused, code, old, new):
    assert old in ROBOT
    (folder / "mine.toml").write_text(ROBOT.replace(old, new), encoding="utf-8")
    said = refused(code, *SIMULATE, name=f"mine.toml: {new or f'without {old}'}")
    assert "mine.toml" in said


@pytest.mark.parametrize(
    ("code", "arguments"),
    [
        ("FILE_NOT_FOUND", ["simulate", "none.toml", "--tension", "2"]),
        ("UNKNOWN_NAME", ["simulate", "pacheco2021-x", "--tension", "2"]),
        ("FILE_UNREADABLE", ["simulate", "folder", "--tension", "2"]),
        ("MISSING_VALUE", ["simulate", "mine.toml"]),
        ("OUT_OF_RANGE", ["simulate", "mine.toml", "--tension", "0:3:0"]),
        ("OUT_OF_RANGE", ["simulate", "mine.toml", "--tension", "-1"]),
        ("NOT_FINITE", ["simulate", "mine.toml", "--tension", "nan"]),
        ("NOT_A_NUMBER", ["simulate", "mine.toml", "--tension", "1="]),
        ("NOT_A_NUMBER", ["simulate", "mine.toml", "--tension", ""]),
        ("UNKNOWN_NAME", ["simulate", "mine.toml", "--tension", "2=1"]),
        ("NOT_FINITE", ["simulate", "mine.toml", "--stroke", "inf"]),
        ("CONFLICT", ["simulate", "mine.toml", "--tension", "1", "--stroke", "1"]),
        ("BAD_SYNTAX", ["simulate", "mine.toml", "--tension", "1", "--base-rotation", "1,2"]),
        ("NOT_FINITE", ["simulate", "mine.toml", "--tension", "1", "--base-rotation", "0,0,nan"]),
        ("BAD_SYNTAX", [*SIMULATE, "--tip-force", "0,1"]),
        ("BAD_SYNTAX", [*SIMULATE, "--body-force", "0,1,0"]),
        ("OUT_OF_RANGE", [*SIMULATE, "--body-force", "3:0,1,0"]),
        ("OUT_OF_RANGE", [*SIMULATE, "--tip-mass", "-1"]),
        ("UNSUPPORTED", [*SIMULATE, "--gravity", "0,0,-9.81"]),
        ("UNKNOWN_NAME", [*SIMULATE, "--set", "material.elastic_modulu=1"]),
        ("OUT_OF_RANGE", [*SIMULATE, "--set", "notch[3].depth=1"]),
        ("INVALID_ROBOT", [*SIMULATE, "--set", "notch.depth=2"]),
        ("BAD_SYNTAX", [*SIMULATE, "--set", "notch.depth"]),
        ("FILE_NOT_FOUND", [*SIMULATE, "--from-state", "none.json"]),
        ("FILE_UNREADABLE", [*SIMULATE, "--from-state", "data.csv"]),
        ("MISSING_VALUE", [*SIMULATE, "--from-state", ""]),
        ("FILE_UNREADABLE", [*SIMULATE, "--from-state", "folder"]),
        ("FILE_UNREADABLE", ["show", "folder"]),
        ("UNKNOWN_NAME", ["show", "a" * 300]),
        ("FILE_UNREADABLE", ["show", "a" * 300 + ".toml"]),
        ("FILE_UNWRITABLE", ["new", "a" * 300]),
        ("FILE_UNWRITABLE", ["new", "null\0"]),
        ("UNKNOWN_NAME", ["show", "mine.toml", "--set", "depth=1"]),
        ("INVALID_ROBOT", ["show", "mine.toml", "--set", "notch.depth=2"]),
        ("UNKNOWN_NAME", ["--quiet", *SIMULATE]),
        ("FILE_NOT_FOUND", ["compare", "mine.toml", "none.csv"]),
        ("TABLE_COLUMNS", ["compare", "mine.toml", "mine.toml"]),
        ("BAD_SYNTAX", ["compare", "mine.toml", "data.csv", "--beside", "linear"]),
        ("UNKNOWN_NAME", ["compare", "mine.toml", "data.csv", "--beside", "x: material.kind=wood"]),
    ],
)
def test_arguments(refused, code, arguments):
    refused(code, *arguments)


OPTIONS = """\
NOT_A_NUMBER --tension a
BAD_SYNTAX --tension 0:3
OUT_OF_RANGE --tension 0:3:-2
OUT_OF_RANGE --tension 0:3:1
NOT_A_NUMBER --tension 0:3:2.5
NOT_A_NUMBER --tension 1,,2
NOT_FINITE --tension inf
NOT_FINITE --tension 0:inf:3
OUT_OF_RANGE --tension 0:-1:5
OUT_OF_RANGE --tension 0:3:9999999999
OUT_OF_RANGE --tension 0:3:600000,0:3:600000
UNKNOWN_NAME --tension 0=2
BAD_SYNTAX --tension x=2
CONFLICT --tension 1=1 --tension 1=2
CONFLICT --tension 1=0:2:3 --stroke 0,1
NOT_A_NUMBER --tension 1 --base-rotation 1,2,x
NOT_A_NUMBER --tension 1 --tip-force 0,1,x
NOT_A_NUMBER --tip-moment 0,1,x
BAD_SYNTAX --tip-force 0,1,0 --tip-point 1
CONFLICT --tip-point 0,0,1
CONFLICT --tip-point 0,0,1 --tip-moment 0,0,1
BAD_SYNTAX --gravity 9.81
NOT_A_NUMBER --tip-mass heavy
NOT_FINITE --tip-mass nan
NOT_FINITE --tip-mass inf
CONFLICT --following --tension 1
CONFLICT --following --tip-mass 3
NOT_A_NUMBER --body-force 1:
BAD_SYNTAX --body-force 1:0,1
BAD_SYNTAX --body-force -1:0,0,1
BAD_SYNTAX --body-force a:0,0,1
BAD_SYNTAX --body-force 1.5:0,0,1
NOT_A_NUMBER --body-force 1:0,0,1@
BAD_SYNTAX --body-force 1:0,0,1@0,0
NOT_FINITE --body-force 1:0,0,inf
NOT_FINITE --body-force 1:0,0,1@0,0,nan
NOT_A_NUMBER --body-force 1:0,0,1@0,0,0@0,0,0
NOT_A_NUMBER --body-force 1:2:0,0,1
BAD_SYNTAX --body-force 1:0,0,1 --body-force 1:0,1
BAD_SYNTAX --tension 1 --beside =1
UNKNOWN_NAME --tension 1 --columns notch_angel
UNKNOWN_NAME --tension 1 --columns tension,
CONFLICT --tension 1 --columns gap,gap
UNKNOWN_NAME --tension 1 --columns tip_rotation
NOT_A_NUMBER --tension 1 --refinement x
"""


@pytest.mark.parametrize("options", OPTIONS.splitlines())
def test_options_of_simulate(refused, options):
    code, *words = options.split()
    refused(code, "simulate", "mine.toml", *words)


@pytest.mark.parametrize("option", ["--tip-force", "--tip-mass", "--base-rotation"])
def test_empty_options(refused, option):
    refused("NOT_A_NUMBER", *SIMULATE, option, "")


def test_an_empty_body_force(refused):
    refused("BAD_SYNTAX", *SIMULATE, "--body-force", "")


def test_numbers_of_thousands_of_digits(refused):
    refused("BAD_SYNTAX", *SIMULATE, "--body-force", f"{'9' * 5000}:0,1,0")


@pytest.mark.parametrize("value", ["x", "80.5", "9" * 5000])
def test_ports(refused, value):
    refused("NOT_A_NUMBER", "view", "mine.toml", "--port", value)


@pytest.mark.parametrize("value", ["0", "65536", "-1"])
def test_ports_outside_their_range(refused, value):
    refused("OUT_OF_RANGE", "view", "mine.toml", "--port", value)


@pytest.mark.parametrize(
    ("code", "option", "target"),
    [
        ("FILE_UNWRITABLE", "--json", "missing/out.json"),
        ("FILE_UNWRITABLE", "--json", "folder"),
        ("FILE_UNWRITABLE", "--csv", "data.csv/out.csv"),
        ("CONFLICT", "--csv", "mine.toml"),
        ("FILE_FORMAT", "--plot", "out.gif"),
        ("FILE_FORMAT", "--plot", "out"),
        ("FILE_FORMAT", "--plot", "-"),
        ("FILE_UNWRITABLE", "--plot", "missing/out.png"),
        ("FILE_UNWRITABLE", "--save-state", "missing/state.json"),
        ("FILE_UNWRITABLE", "--json", "null\0.json"),
        ("FILE_UNWRITABLE", "--plot", "null\0.png"),
    ],
)
def test_outputs_are_checked_before_anything_is_computed(
    refused, monkeypatch, code, option, target
):
    monkeypatch.setitem(sys.modules, "notchflex.analysis", None)  # importing it would fail
    refused(code, "simulate", "mine.toml", "--tension", "2", option, target)


def test_two_documents_on_standard_output_are_refused(refused):
    refused("CONFLICT", *SIMULATE[:4], "--json", "-", "--csv", "-")


def test_missing_matplotlib_is_told_before_computing(refused, monkeypatch):
    monkeypatch.setattr("importlib.util.find_spec", lambda name: None)
    monkeypatch.setitem(sys.modules, "notchflex.analysis", None)
    refused("MISSING_PACKAGE", *SIMULATE[:4], "--plot", "out.png")


def test_measured_data_are_not_replaced(refused):
    refused("CONFLICT", "compare", "mine.toml", "data.csv", "--csv", "data.csv")


def test_a_notch_that_is_wrong_is_told_in_one_sentence(refused):
    refused("INVALID_ROBOT", "show", "mine.toml", "--set", "notch.depth=-1")


def test_files_that_break_their_readers(folder, refused):
    (folder / "deep.json").write_text("[" * 100_000)
    (folder / "huge.json").write_text("1" * 5_000)
    for name in ("deep.json", "huge.json"):
        refused("FILE_UNREADABLE", *SIMULATE, "--from-state", name)
    (folder / "mine.toml").write_text(ROBOT.replace("1.62", "1" * 5_000))
    refused("FILE_UNREADABLE", *SIMULATE, name="mine.toml: a number of 5000 digits")


def test_good_file_is_good(folder):
    # The table above changes one value at a time, so the file itself must be right.
    robot = load_robot(folder / "mine.toml")
    save_robot(robot, folder / "copy.toml")
    assert load_robot(folder / "copy.toml") == robot


@pytest.mark.parametrize(
    ("words", "option"),
    [
        ("calibrate --strts 3", "--starts"),
        ("calibrate pacheco2021-a=x.csv --strts 3", "--starts"),
        ("measure x.jpg --bord x", "--board"),
        ("sense a b --tip-nois 3", "--tip-noise"),
        ("compare a b --pth", "--path"),
        ("simulate a --tensin 3", "--tension"),
    ],
)
def test_an_unknown_option_is_answered_by_the_nearest(call, words, option):
    code, out, err = call(*words.split())
    assert (code, out) == (2, "")
    assert f"Did you mean {option}?" in err
