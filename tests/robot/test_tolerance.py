"""The `[tolerance]` table of a robot file."""

import pickle

import pytest

import notchflex as nf
from notchflex.results.state import differences
from notchflex.robot import robot_from_text, robot_text
from notchflex.robot.reading import READY
from refusals import refused

SOURCE = (READY / "pacheco2021-a.toml").read_text()
TABLE = """
[tolerance]  # of the shop
notch.depth = 0.010  # laser
"notch[3].depth" = {sd = 0.02}
material.elastic_modulus = "10 %"
friction.coefficient = {plus = 0.01, minus = 0.05}
notch.height = {sd = 0.01, per_notch = true}
"""


def test_what_was_read_is_written_unchanged_and_fresh_files_are_the_same_robot():
    robot = robot_from_text(SOURCE + TABLE)
    assert {one.value: one.written for one in robot.tolerance} == {
        "notch.depth": 0.01,
        "notch[3].depth": 0.02,
        "material.elastic_modulus": "10 %",
        "friction.coefficient": {"plus": 0.01, "minus": 0.05},
        "notch.height": {"sd": 0.01, "per_notch": True},
    }
    assert robot_text(robot, SOURCE + TABLE) == SOURCE + TABLE
    assert robot_from_text(robot_text(robot, "")) == robot
    assert pickle.loads(pickle.dumps(robot)) == robot
    assert hash(robot) != hash(robot.replace(tolerance=None))


def test_parts_of_notches_need_no_quotes():
    own = SOURCE.replace(
        "[[tendon]]", "[notch.tube]\nouter_diameter = 1.7\ninner_diameter = 1.4\n[[tendon]]"
    )
    robot = robot_from_text(
        own + "\n[tolerance]\nnotch.depth = 0.01\nnotch.tube.outer_diameter = 0.02\n"
    )
    assert [one.value for one in robot.tolerance] == ["notch.depth", "notch.tube.outer_diameter"]
    assert robot_from_text(robot_text(robot, "")) == robot


def test_tolerances_are_set_added_and_taken_away():
    robot = robot_from_text(SOURCE + TABLE)
    other = robot.with_value("tolerance.notch.depth", 0.03)
    text = robot_text(other, SOURCE + TABLE)
    assert robot_from_text(text) == other
    assert "notch.depth = 0.03\n" in text
    assert text.startswith(SOURCE)
    bare = robot.replace(tolerance=None)
    assert robot_text(bare, SOURCE + TABLE) == SOURCE
    added = bare.replace(tolerance={"notch.depth": {"plus": "2 %", "minus": 0.0}})
    wanted = '\n[tolerance]\nnotch.depth = {plus = "2 %", minus = 0.0}\n'
    assert robot_text(added, SOURCE) == SOURCE + wanted


def test_a_change_of_kind_drops_the_tolerance_of_what_it_drops():
    robot = nf.load_robot("pacheco2021-a").replace(
        tolerance={"material.superelastic_modulus": "5 %", "material.elastic_modulus": "5 %"}
    )
    linear = robot.with_value("material.kind", "linear")
    assert [one.value for one in linear.tolerance] == ["material.elastic_modulus"]


def test_states_do_not_depend_on_tolerances():
    robot = robot_from_text(SOURCE + TABLE)
    assert differences(robot, robot.replace(tolerance=None)) == []


@pytest.mark.parametrize(
    ("line", "name", "words"),
    [
        ("notch.dept = 0.01", "notch.dept", "did you mean `depth`"),
        ("notch.depth = 10", "notch.depth", "give it in mm"),
        ('notch.depth = "5 mm"', "notch.depth", '"5 %"'),
        ("notch.depth = -0.1", "notch.depth", "0 or more"),
        ("notch.depth = nan", "notch.depth", "finite"),
        ("notch.depth = true", "notch.depth", "not a number"),
        ("notch.depth = {plus = 0.1}", "notch.depth", "both `plus` and `minus`"),
        ("notch.depth = {sd = 0.1, high = 2}", "notch.depth", "Allowed: sd, plus, minus"),
        ("notch.depth = {sd = 0.1, per_notch = 1}", "notch.depth", "true or false"),
        ("tube.inner_diameter = {sd = 0.01, per_notch = true}", "tube.inner_diameter", "notches"),
        ("friction = 3", "friction", "names no single value"),
        ("notch.cut = 0.1", "notch.cut", "no number"),
        ('"notch[9].depth" = 0.1', "notch[9].depth", "the robot has 5 notches"),
        ("tendon.axial_stiffness = 1", "tendon.axial_stiffness", "no number"),
        ('notch.depth = 0.1\n"notch[*].depth" = 0.1', "notch[*].depth", "twice"),
    ],
)
def test_what_is_no_tolerance(line: str, name: str, words: str):
    with pytest.raises(nf.InputError) as error:
        robot_from_text(f"{SOURCE}\n[tolerance]\n{line}\n")
    assert error.value.code.name == "INVALID_ROBOT"
    (sentence,) = str(error.value).splitlines()
    assert sentence.startswith(f"`tolerance.{name}` ")
    assert words in sentence


@pytest.mark.parametrize("table", [5, "notch.depth", [0.1]])
def test_what_is_no_table(table: object):
    with refused("INVALID_ROBOT", "`tolerance`"):
        nf.load_robot("pacheco2021-a").replace(tolerance=table)
