"""Robot files that can and cannot be used, and what is said about them."""

import math
from pathlib import Path

import numpy as np
import pytest

import notchflex as nf
from refusals import refused

GOOD = """\
name = "test"
[tube]
outer_diameter = 1.62
inner_diameter = 1.40
[[notch]]
kind = "arc"
cut = "on-axis"
depth = 1.4
height = 0.8
uncut_length = 1.2
repeat = 3
[[notch]]
kind = "arc"
cut = "off-axis"
depth = 1.3
height = 0.8
uncut_length = 1.2
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


@pytest.fixture
def read(tmp_path: Path):
    """Read a robot file of this text."""

    def read(text: str | bytes) -> nf.Robot:
        path = tmp_path / "wrist.toml"
        path.write_bytes(text if isinstance(text, bytes) else text.encode())
        return nf.load_robot(path)

    return read


def test_defaults(read):
    robot = read(GOOD)
    assert robot.number_of_notches == 4
    assert robot.number_of_tendons == 1
    assert robot.notch[0].repeat == 3
    assert [n.cut for n in robot.notches] == ["on-axis"] * 3 + ["off-axis"]
    assert {n.repeat for n in robot.notches} == {1}
    tendon = robot.tendon[0]
    assert (tendon.path, tendon.end_body, tendon.axial_stiffness) == ("wall-arc", None, math.inf)
    assert robot.friction.wrap == "geometric"
    assert robot.material == nf.Superelastic(
        10_000, 3_000, 0.028, poisson_ratio=0.33, plastic_strain=0.10, plastic_modulus=1000.0
    )


def test_what_editors_do_to_a_file_is_no_harm(read):
    assert read(b"\xef\xbb\xbf" + GOOD.replace("\n", "\r\n").encode()) == read(GOOD)


def changed(old: str, new: str) -> str:
    assert old in GOOD
    return GOOD.replace(old, new, 1)


OUTSIDE = [
    # what stands in the file, and what the message must hold
    (("depth = 1.4", "depth = 1.62"), ["`notch[1].depth`", "1.62 mm", "less than the outer diam"]),
    (("depth = 1.3", "depth = -1.3"), ["`notch[4].depth`", "table number 2", "greater than 0"]),
    (("inner_diameter = 1.40", "inner_diameter = 1.62"), ["`tube.inner_diameter`", "1.62 mm"]),
    (("radius = 0.70", "radius = 0.9"), ["`tendon[1].radius`", "outside the wall", "0.81 mm"]),
    (("radius = 0.70", "radius = 0.7\nend_body = 5"), ["`tendon[1].end_body`", "1 to 4"]),
    (("radius = 0.70", "radius = 0.7\naxial_stiffness = -1"), ["`tendon[1].axial_stiffness`"]),
    (("repeat = 3", "repeat = 0"), ["`notch[1].repeat`", "at least 1"]),
    (("repeat = 3", "repeat = 2.5"), ["`notch[1].repeat`", "a whole number"]),
    (("repeat = 3", "precurvature_deg = 60"), ["`notch[1].precurvature_deg`", "closes at"]),
    (("= 10000", "= nan"), ["`material.elastic_modulus`", "nan", "finite number"]),
    (("= 0.028", "= 2.8"), ["`material.transition_strain`", "at most 0.5", "0.04 is 4 %"]),
    (("= 0.028", "= 0.2"), ["`material.plastic_strain`", "transition strain"]),
    (("coefficient = 0.13", "coefficient = -0.1"), ["`friction.coefficient`", "at least 0"]),
    # wrong types
    (("depth = 1.4", 'depth = "1.4"'), ["`notch[1].depth`", '"1.4" (text)', "without quotes"]),
    (("depth = 1.4", "depth = true"), ["`notch[1].depth`", "true", "a number in mm"]),
    (("depth = 1.4", "depth = 1979-05-27"), ["`notch[1].depth`", "a number in mm"]),
    (('name = "test"', "name = 5"), ["`name`", "text in quotes"]),
    (('name = "test"', 'name = ""'), ["`name`", "not be empty"]),
    (("[tube]\nouter_diameter = 1.62\ninner_diameter = 1.40", "tube = 5"), ["`tube`", "[tube]"]),
    # words
    (('"on-axis"', '"onaxis"'), ["`notch[1].cut`", '"on-axis"', '"off-axis"', "did you mean"]),
    (('kind = "capstan"', 'kind = "capstn"'), ["`friction.kind`", "did you mean `capstan`"]),
    (
        ('kind = "arc"', 'kind = "v"'),
        ["`notch[1].kind`", '"rod", "strip", "table", "u-link"'],
    ),
    (("coefficient = 0.13", 'coefficient = 0.1\nwrap = "x"'), ["`friction.wrap`", "whole-before"]),
    (("radius = 0.70", 'radius = 0.70\npath = "straight-ded"'), ["mean `straight-dead`?"]),
    # unknown keys
    (("depth = 1.4", "dept = 1.4"), ["`notch[1].dept`", "did you mean `depth`?", "Allowed: kind"]),
    (("[friction]", "[frction]"), ["`frction`", "did you mean `friction`?"]),
    # missing keys
    (('cut = "on-axis"\n', ""), ["`notch[1].cut` is missing", "annular sector", "annular segment"]),
    (("elastic_modulus = 10000\n", ""), ["`material.elastic_modulus` is missing", "[MPa]"]),
    (
        ('kind = "capstan"\n', ""),
        ["`friction.kind` is missing", '"capstan", "corner", "frictionless"'],
    ),
    (("[[tendon]]\nradius = 0.70\n", ""), ["`tendon` is missing", "[[tendon]]"]),
    (("[[tendon]]", "[tendon]"), ["`tendon`", "a table", "[[tendon]]"]),
]


@pytest.mark.parametrize(("change", "wanted"), OUTSIDE, ids=[f"{a[0][1]}" for a in OUTSIDE])
def test_a_value_that_is_not_allowed(read, tmp_path: Path, change: tuple, wanted: list):
    with pytest.raises(nf.RobotFileError) as caught:
        read(changed(*change))
    message = str(caught.value)
    for words in wanted:
        assert words in message
    assert str(tmp_path / "wrist.toml") in message
    assert message.endswith(".")
    assert "pydantic" not in message
    assert "Input should" not in message
    assert "None" not in message
    # a key that is misspelt is missing too: that is said in a second line
    assert len(message.splitlines()) <= 2


def test_each_problem_has_its_line(read):
    text = changed("depth = 1.4", "depth = -1").replace("0.13", "-1")
    with pytest.raises(nf.RobotFileError) as caught:
        read(text)
    lines = str(caught.value).splitlines()
    assert len(lines) == 2
    assert "`notch[1].depth`" in lines[0]
    assert "`friction.coefficient`" in lines[1]


@pytest.mark.parametrize(
    ("text", "line"),
    [
        ("name = 'x'\n[tube]\nouter_diameter = \n", "line 3"),
        ("name = 'x'\n[tube\n", "line 2"),
        ("name = 'x'\nname = 'y'\n", "line 2"),
        ("name = 'x", "line 1"),
        ("a = [1,\n\n", "line 1"),
        ("depth: 1.4\n", "line 1"),
    ],
)
def test_toml_syntax_is_named_with_its_line(read, text: str, line: str):
    with refused("FILE_UNREADABLE", line, "not TOML", error=nf.RobotFileError) as caught:
        read(text)
    assert len(str(caught.value).splitlines()) == 1


@pytest.mark.parametrize("name", [None, b"wrist.toml", 3])
def test_what_names_no_robot(name):
    """A TypeError before."""
    with refused("WRONG_TYPE", repr(name), error=nf.RobotFileError):
        nf.load_robot(name)
    with refused("UNKNOWN_NAME", str(name)):
        nf.load_robot("pacheco2021-a").with_value(name, 1.0)


def test_a_file_that_is_none(tmp_path: Path, read):
    with refused("FILE_NOT_FOUND", "none.toml", error=nf.RobotFileError):
        nf.load_robot(tmp_path / "none.toml")
    with refused("FILE_NOT_FOUND", "nowhere/none.toml", error=nf.RobotFileError):
        nf.load_robot("nowhere/none.toml")
    with refused("FILE_UNREADABLE", str(tmp_path), error=nf.RobotFileError):
        nf.load_robot(tmp_path)
    with refused("FILE_UNREADABLE", "wrist.toml", "UTF-8", error=nf.RobotFileError):
        read(b'name = "\xff\xfe"')
    with refused("FILE_UNREADABLE", error=nf.RobotFileError):
        nf.load_robot("a\0b.toml")
    with refused("FILE_NOT_FOUND", "`pacheco2021-a`", error=nf.RobotFileError):
        nf.load_robot("pacheco2021-a.toml")


@pytest.mark.parametrize("name", ["pacheco2021-d", "pacheco-a", "", "york"])
def test_a_name_that_nobody_knows(name: str):
    with refused("UNKNOWN_NAME", f"`{name}`", *nf.list_robots(), error=nf.RobotFileError):
        nf.load_robot(name)


def test_nearest_name():
    with refused("UNKNOWN_NAME", "`pacheco2021-c`?", error=nf.RobotFileError):
        nf.load_robot("pacheco-2021-c")


def test_a_file_in_the_working_folder_needs_no_ending(tmp_path: Path, monkeypatch):
    (tmp_path / "mine").write_text(GOOD)
    monkeypatch.chdir(tmp_path)
    assert nf.load_robot("mine").name == "test"


def test_numbers_of_numpy_are_numbers():
    assert nf.Capstan(np.float32(0.5)).coefficient == 0.5
    assert nf.Tube(np.array(2.0), np.int64(1)).inner_diameter == 1.0
    tube = nf.Tube(2, 1)
    assert type(tube.outer_diameter) is float
    with refused("INVALID_ROBOT", "`coefficient`"):
        nf.Capstan(np.array([0.1, 0.2]))
