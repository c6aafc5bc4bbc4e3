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
    ("old", "new"),
    [
        ("depth = 1.40", "depth = 1.62"),
        ("depth = 1.40", "depth = 0"),
        ("depth = 1.40", "depth = -1"),
        ("depth = 1.40", "depth = nan"),
        ("depth = 1.40", "depth = inf"),
        ("depth = 1.40", 'depth = "deep"'),
        ("inner_diameter = 1.40", "inner_diameter = 1.62"),
        ("radius = 0.70", "radius = 0.82"),
        ("radius = 0.70", "radius = -0.5"),
        ("height = 0.8", "height = -0.8"),
        ("uncut_length = 1.2", "uncut_length = -1"),
        ("elastic_modulus = 10000", "elastic_modulus = -5"),
        ("elastic_modulus = 10000", "elastic_modulus = inf"),
        ("coefficient = 0.13", "coefficient = -0.1"),
        ("coefficient = 0.13", "coeficient = 0.13"),
        ("repeat = 2", "repeat = 0"),
        ("repeat = 2", "repeat = 2.5"),
        ('cut = "on-axis"', ""),
        ('kind = "capstan"', 'kind = "glue"'),
        ("depth = 1.40", "depth = "),
        ("[tube]", "[tube"),
    ],
)
def test_robot_files(folder, refused, old, new):
    assert old in ROBOT
    (folder / "mine.toml").write_text(ROBOT.replace(old, new), encoding="utf-8")
    said = refused(*SIMULATE, name=f"mine.toml: {new or f'without {old}'}")
    assert "mine.toml" in said


@pytest.mark.parametrize(
    "arguments",
    [
        ["simulate", "none.toml", "--tension", "2"],
        ["simulate", "pacheco2021-x", "--tension", "2"],
        ["simulate", "folder", "--tension", "2"],
        ["simulate", "mine.toml"],
        ["simulate", "mine.toml", "--tension", "0:3:0"],
        ["simulate", "mine.toml", "--tension", "-1"],
        ["simulate", "mine.toml", "--tension", "nan"],
        ["simulate", "mine.toml", "--tension", "1="],
        ["simulate", "mine.toml", "--tension", ""],
        ["simulate", "mine.toml", "--tension", "2=1"],
        ["simulate", "mine.toml", "--stroke", "inf"],
        ["simulate", "mine.toml", "--tension", "1", "--stroke", "1"],
        ["simulate", "mine.toml", "--tension", "1", "--base-rotation", "1,2"],
        ["simulate", "mine.toml", "--tension", "1", "--base-rotation", "0,0,nan"],
        [*SIMULATE, "--tip-force", "0,1"],
        [*SIMULATE, "--body-force", "0,1,0"],
        [*SIMULATE, "--body-force", "3:0,1,0"],
        [*SIMULATE, "--tip-mass", "-1"],
        [*SIMULATE, "--gravity", "0,0,-9.81"],
        [*SIMULATE, "--set", "material.elastic_modulu=1"],
        [*SIMULATE, "--set", "notch[3].depth=1"],
        [*SIMULATE, "--set", "notch.depth=2"],
        [*SIMULATE, "--set", "notch.depth"],
        [*SIMULATE, "--from-state", "none.json"],
        [*SIMULATE, "--from-state", "data.csv"],
        [*SIMULATE, "--from-state", ""],
        [*SIMULATE, "--from-state", "folder"],
        ["show", "folder"],
        ["show", "a" * 300],
        ["show", "a" * 300 + ".toml"],
        ["new", "a" * 300],
        ["new", "null\0"],
        ["show", "mine.toml", "--set", "depth=1"],
        ["show", "mine.toml", "--set", "notch.depth=2"],
        ["compare", "mine.toml", "none.csv"],
        ["compare", "mine.toml", "mine.toml"],
        ["compare", "mine.toml", "data.csv", "--beside", "linear"],
        ["compare", "mine.toml", "data.csv", "--beside", "x: material.kind=wood"],
    ],
)
def test_arguments(refused, arguments):
    refused(*arguments)


OPTIONS = """\
--tension a
--tension 0:3
--tension 0:3:-2
--tension 0:3:1
--tension 0:3:2.5
--tension 1,,2
--tension inf
--tension 0:inf:3
--tension 0:-1:5
--tension 0:3:9999999999
--tension 0:3:600000,0:3:600000
--tension 0=2
--tension x=2
--tension 1=1 --tension 1=2
--tension 1=0:2:3 --stroke 0,1
--tension 1 --base-rotation 1,2,x
--tension 1 --tip-force 0,1,x
--tip-moment 0,1,x
--tip-force 0,1,0 --tip-point 1
--tip-point 0,0,1
--tip-point 0,0,1 --tip-moment 0,0,1
--gravity 9.81
--tip-mass heavy
--tip-mass nan
--tip-mass inf
--following --tension 1
--following --tip-mass 3
--body-force 1:
--body-force 1:0,1
--body-force -1:0,0,1
--body-force a:0,0,1
--body-force 1.5:0,0,1
--body-force 1:0,0,1@
--body-force 1:0,0,1@0,0
--body-force 1:0,0,inf
--body-force 1:0,0,1@0,0,nan
--body-force 1:0,0,1@0,0,0@0,0,0
--body-force 1:2:0,0,1
--body-force 1:0,0,1 --body-force 1:0,1
--tension 1 --beside =1
--tension 1 --columns notch_angel
--tension 1 --columns tension,
--tension 1 --columns gap,gap
--tension 1 --columns tip_rotation
--tension 1 --refinement x
"""


@pytest.mark.parametrize("options", OPTIONS.splitlines())
def test_options_of_simulate(refused, options):
    refused("simulate", "mine.toml", *options.split())


@pytest.mark.parametrize("option", ["--tip-force", "--tip-mass", "--base-rotation", "--body-force"])
def test_empty_options(refused, option):
    refused(*SIMULATE, option, "")


def test_numbers_of_thousands_of_digits(refused):
    refused(*SIMULATE, "--body-force", f"{'9' * 5000}:0,1,0")


@pytest.mark.parametrize("value", ["x", "0", "65536", "-1", "80.5", "9" * 5000])
def test_ports(refused, value):
    refused("view", "mine.toml", "--port", value)


@pytest.mark.parametrize(
    ("option", "target"),
    [
        ("--json", "missing/out.json"),
        ("--json", "folder"),
        ("--csv", "data.csv/out.csv"),
        ("--csv", "mine.toml"),
        ("--plot", "out.gif"),
        ("--plot", "out"),
        ("--plot", "-"),
        ("--plot", "missing/out.png"),
        ("--save-state", "missing/state.json"),
        ("--json", "null\0.json"),
        ("--plot", "null\0.png"),
    ],
)
def test_outputs_are_checked_before_anything_is_computed(refused, monkeypatch, option, target):
    monkeypatch.setitem(sys.modules, "notchflex.analysis", None)  # importing it would fail
    refused("simulate", "mine.toml", "--tension", "2", option, target)


def test_two_documents_on_standard_output_are_refused(refused):
    refused(*SIMULATE[:4], "--json", "-", "--csv", "-")


def test_missing_matplotlib_is_told_before_computing(refused, monkeypatch):
    monkeypatch.setattr("importlib.util.find_spec", lambda name: None)
    monkeypatch.setitem(sys.modules, "notchflex.analysis", None)
    refused(*SIMULATE[:4], "--plot", "out.png")


def test_measured_data_are_not_replaced(refused):
    refused("compare", "mine.toml", "data.csv", "--csv", "data.csv")


def test_a_notch_that_is_wrong_is_told_in_one_sentence(refused):
    refused("show", "mine.toml", "--set", "notch.depth=-1")


def test_files_that_break_their_readers(folder, refused):
    (folder / "deep.json").write_text("[" * 100_000)
    (folder / "huge.json").write_text("1" * 5_000)
    for name in ("deep.json", "huge.json"):
        refused(*SIMULATE, "--from-state", name)
    (folder / "mine.toml").write_text(ROBOT.replace("1.62", "1" * 5_000))
    refused(*SIMULATE, name="mine.toml: a number of 5000 digits")


def test_good_file_is_good(folder):
    # The table above changes one value at a time, so the file itself must be right.
    robot = load_robot(folder / "mine.toml")
    save_robot(robot, folder / "copy.toml")
    assert load_robot(folder / "copy.toml") == robot
