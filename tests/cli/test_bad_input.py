"""Bad input: exit code 2, one clear message, nothing written, nothing computed."""

import sys

import pytest

from notchflex import load_robot, save_robot
from notchflex.cli import run

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


@pytest.fixture
def refused(folder, capsys):
    """Run a command that must be refused; return what it said."""

    def runner(*arguments):
        before = {path: path.read_bytes() for path in folder.rglob("*") if path.is_file()}
        code = run(list(arguments))
        output = capsys.readouterr()
        assert code == 2, output
        assert output.out == ""
        assert output.err.startswith("Error: ")
        assert "Traceback" not in output.err
        assert len(output.err.strip()) > 20
        after = {path: path.read_bytes() for path in folder.rglob("*") if path.is_file()}
        assert after == before
        return output.err

    return runner


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ("depth = 1.40", "depth = 1.62", ("depth", "1.62")),
        ("depth = 1.40", "depth = 0", ("depth", "greater than 0")),
        ("depth = 1.40", "depth = -1", ("depth", "greater than 0")),
        ("depth = 1.40", "depth = nan", ("depth", "finite")),
        ("depth = 1.40", "depth = inf", ("depth",)),
        ("depth = 1.40", 'depth = "deep"', ("depth", "number")),
        ("inner_diameter = 1.40", "inner_diameter = 1.62", ("inner_diameter", "1.62")),
        ("radius = 0.70", "radius = 0.82", ("radius", "0.81")),
        ("radius = 0.70", "radius = -0.5", ("radius", "greater than 0")),
        ("height = 0.8", "height = -0.8", ("height",)),
        ("uncut_length = 1.2", "uncut_length = -1", ("uncut_length",)),
        ("elastic_modulus = 10000", "elastic_modulus = -5", ("elastic_modulus",)),
        ("elastic_modulus = 10000", "elastic_modulus = inf", ("elastic_modulus", "finite")),
        ("coefficient = 0.13", "coefficient = -0.1", ("coefficient",)),
        ("coefficient = 0.13", "coeficient = 0.13", ("coeficient", "coefficient")),
        ("repeat = 2", "repeat = 0", ("repeat",)),
        ("repeat = 2", "repeat = 2.5", ("repeat", "whole number")),
        ('cut = "on-axis"', "", ("cut",)),
        ('kind = "capstan"', 'kind = "glue"', ("glue", "capstan")),
        ("depth = 1.40", "depth = ", ("line 8",)),
        ("[tube]", "[tube", ("line 2",)),
    ],
)
def test_robot_files(folder, refused, old, new, words):
    assert old in ROBOT
    (folder / "mine.toml").write_text(ROBOT.replace(old, new), encoding="utf-8")
    said = refused(*SIMULATE)
    assert "mine.toml" in said
    assert all(word in said for word in words), said


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["simulate", "none.toml", "--tension", "2"], "no such file"),
        (["simulate", "pacheco2021-x", "--tension", "2"], "pacheco2021-a"),
        (["simulate", "folder", "--tension", "2"], "folder"),
        (["simulate", "mine.toml"], "--tension"),
        (["simulate", "mine.toml", "--tension", "0:3:0"], "a range of 0 steps"),
        (["simulate", "mine.toml", "--tension", "-1"], "only pulls"),
        (["simulate", "mine.toml", "--tension", "nan"], "finite"),
        (["simulate", "mine.toml", "--tension", "1="], "--tension 1=: a number is missing"),
        (["simulate", "mine.toml", "--tension", ""], "--tension '': a number is missing"),
        (["simulate", "mine.toml", "--tension", "2=1"], "no tendon 2"),
        (["simulate", "mine.toml", "--stroke", "inf"], "finite"),
        (["simulate", "mine.toml", "--tension", "1", "--stroke", "1"], "already has"),
        (["simulate", "mine.toml", "--tension", "1", "--base-rotation", "1,2"], "three finite"),
        (["simulate", "mine.toml", "--tension", "1", "--base-rotation", "0,0,nan"], "finite"),
        ([*SIMULATE, "--tip-force", "0,1"], "--tip-force 0,1: give three finite forces in N"),
        ([*SIMULATE, "--body-force", "0,1,0"], "give BODY:X,Y,Z"),
        ([*SIMULATE, "--body-force", "3:0,1,0"], "there is no body 3; mine has the bodies 0"),
        ([*SIMULATE, "--tip-mass", "-1"], "0 or more"),
        ([*SIMULATE, "--gravity", "0,0,-9.81"], "give material.density (kg/m3) or a tip_mass"),
        ([*SIMULATE, "--set", "material.elastic_modulu=1"], "elastic_modulus"),
        ([*SIMULATE, "--set", "notch[3].depth=1"], "2 notches"),
        ([*SIMULATE, "--set", "notch.depth=2"], "less than"),
        ([*SIMULATE, "--set", "notch.depth"], "notch.depth"),
        ([*SIMULATE, "--from-state", "none.json"], "none.json"),
        ([*SIMULATE, "--from-state", "data.csv"], "state"),
        ([*SIMULATE, "--from-state", ""], "empty"),
        ([*SIMULATE, "--from-state", "folder"], "cannot be read as a state: Is a directory"),
        (["show", "folder"], "is a folder"),
        (["show", "a" * 300], "neither a ready robot"),
        (["show", "a" * 300 + ".toml"], "cannot be read"),
        (["new", "a" * 300], "cannot be written"),
        (["new", "null\0"], "null character"),
        (["show", "mine.toml", "--set", "depth=1"], "did you mean `notch.depth`?"),
        (["show", "mine.toml", "--set", "notch.depth=2"], "less than"),
        (["compare", "mine.toml", "none.csv"], "no such file"),
        (["compare", "mine.toml", "mine.toml"], "column"),
        (["compare", "mine.toml", "data.csv", "--beside", "linear"], "kinematics"),
        (["compare", "mine.toml", "data.csv", "--beside", "x: material.kind=wood"], "wood"),
    ],
)
def test_arguments(refused, arguments, words):
    assert words in refused(*arguments)


@pytest.mark.parametrize(
    ("option", "target", "words"),
    [
        ("--json", "missing/out.json", "does not exist"),
        ("--json", "folder", "is a folder"),
        ("--csv", "data.csv/out.csv", "not a folder"),
        ("--csv", "mine.toml", "would replace"),
        ("--plot", "out.gif", ".png, .svg or .pdf"),
        ("--plot", "out", "no suffix"),
        ("--plot", "-", "standard output"),
        ("--plot", "missing/out.png", "does not exist"),
        ("--save-state", "missing/state.json", "does not exist"),
        ("--json", "null\0.json", "null character"),
        ("--plot", "null\0.png", "null character"),
    ],
)
def test_outputs_are_checked_before_anything_is_computed(
    refused, monkeypatch, option, target, words
):
    monkeypatch.setitem(sys.modules, "notchflex.analysis", None)  # importing it would fail
    assert words in refused("simulate", "mine.toml", "--tension", "2", option, target)


def test_two_documents_on_standard_output_are_refused(refused):
    assert "both write" in refused(*SIMULATE[:4], "--json", "-", "--csv", "-")


def test_missing_matplotlib_is_told_before_computing(refused, monkeypatch):
    monkeypatch.setattr("importlib.util.find_spec", lambda name: None)
    monkeypatch.setitem(sys.modules, "notchflex.analysis", None)
    said = refused(*SIMULATE[:4], "--plot", "out.png")
    assert "pip install 'notchflex[plot]'" in said


def test_measured_data_are_not_replaced(refused):
    said = refused("compare", "mine.toml", "data.csv", "--csv", "data.csv")
    assert "would replace" in said


def test_a_notch_that_is_wrong_is_told_in_one_sentence(refused):
    said = refused("show", "mine.toml", "--set", "notch.depth=-1")
    assert "`notch` is a list" not in said


def test_files_that_break_their_readers(folder, refused):
    (folder / "deep.json").write_text("[" * 100_000)
    (folder / "huge.json").write_text("1" * 5_000)
    for name in ("deep.json", "huge.json"):
        assert f"{name} cannot be read" in refused(*SIMULATE, "--from-state", name)
    (folder / "mine.toml").write_text(ROBOT.replace("1.62", "1" * 5_000))
    assert "mine.toml holds a number that cannot be read" in refused(*SIMULATE)


def test_good_file_is_good(folder):
    # The table above changes one value at a time, so the file itself must be right.
    robot = load_robot(folder / "mine.toml")
    save_robot(robot, folder / "copy.toml")
    assert load_robot(folder / "copy.toml") == robot
