"""Robot files that are written: comments kept, and the same robot read back."""

import dataclasses
import math
import re
import string
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

import notchflex as nf
from notchflex.robot import robot_from_text, robot_text
from notchflex.robot.reading import READY
from refusals import refused

pytestmark = pytest.mark.filterwarnings("ignore::notchflex.InputWarning")  # any numbers


READY_NAMES = sorted(path.stem for path in READY.glob("*.toml"))


@pytest.mark.parametrize("name", READY_NAMES)
def test_writing_what_was_read_changes_nothing(name: str, tmp_path: Path):
    path = tmp_path / "copy.toml"
    nf.save_robot(nf.load_robot(name), path)
    assert path.read_text() == (READY / f"{name}.toml").read_text()
    assert path.read_text() == robot_text(nf.load_robot(name))


@pytest.mark.parametrize("name", READY_NAMES)
def test_a_fresh_file_is_the_same_robot(name: str):
    robot = nf.load_robot(name)
    text = robot_text(robot, "")
    assert robot_from_text(text) == robot
    assert "# mm, outer diameter of the tube" in text


def test_a_changed_value_keeps_its_comment_and_says_from_what(tmp_path: Path):
    robot = nf.load_robot("pacheco2021-a").with_value("material.elastic_modulus", 9_500.0)
    nf.save_robot(robot, tmp_path / "a.toml")
    old = (READY / "pacheco2021-a.toml").read_text().splitlines()
    new = (tmp_path / "a.toml").read_text().splitlines()
    assert [line for line in new if line not in old] == [
        "elastic_modulus = 9500.0  # MPa; E_lin, Table 3 (changed from 10000.0)"
    ]
    assert len(new) == len(old)

    # changed again: still the value that the comment speaks of; changed back: as it was
    again = nf.load_robot(tmp_path / "a.toml").with_value("material.elastic_modulus", 9_000.0)
    assert "9000.0  # MPa; E_lin, Table 3 (changed from 10000.0)\n" in robot_text(
        again, (tmp_path / "a.toml").read_text()
    )
    back = again.with_value("material.elastic_modulus", 10_000.0)
    nf.save_robot(back, tmp_path / "a.toml")
    assert (tmp_path / "a.toml").read_text().splitlines() == old


def test_a_split_group_keeps_every_comment_of_the_file():
    source = (READY / "pacheco2021-a.toml").read_text()
    robot = nf.load_robot("pacheco2021-a").with_value("notch[2].depth", 1.3)
    text = robot_text(robot, source)
    assert robot_from_text(text) == robot
    assert text.count("[[notch]]") == 3
    comments = [line.partition("#")[2] for line in source.splitlines() if "#" in line]
    assert all(comment in text for comment in comments)
    assert "depth = 1.3  # mm; g of wrist A, Table 2 (changed from 1.40)" in text


def test_comments_above_and_layout_stay():
    source = """\
# Head of the file.

# about the name
name = "x"  # mine

   # about the tube
[ tube ]  # bought
outer_diameter = 1.620  # measured
  inner_diameter = 1.4
# wall 0.11

# about notches
[[notch]]
kind = "arc"
cut = "on-axis"
depth = 1.4
height = 0.8
uncut_length = 1.2
# after a notch

# the second
[[notch]]
kind = "arc"
cut = "on-axis"
depth = 1.4
height = 0.8
uncut_length = 1.2
repeat = 4
[[tendon]]
radius = 7e-1 # thin
[material]
kind = "linear"
elastic_modulus = 10_000
[friction]
kind = "frictionless"
# The end.
"""
    robot = robot_from_text(source)
    assert robot_text(robot, source) == source
    changes = {"notch[4].depth": 1.3, "tube.base_length": 2.0, "friction.kind": "capstan"}
    robot = robot.with_values(changes | {"friction.coefficient": 0.1})
    text = robot_text(robot, source)
    assert robot_from_text(text) == robot
    assert text.count("[[notch]]") == 4
    for comment in re.findall(r"#.*", source):
        assert text.count(comment) == 1
    assert "outer_diameter = 1.620  # measured\n  inner_diameter = 1.4\n" in text
    assert (
        text.endswith('kind = "capstan"\ncoefficient = 0.1\n# The end.\n') or "# The end." in text
    )


@pytest.mark.parametrize(
    "source",
    [
        'name = "x"  # named\ntube.outer_diameter = 1.6  # o\ntube.inner_diameter = 1.4\n',
        'name = "x"  # named\ntube = { outer_diameter = 1.6, inner_diameter = 1.4 } # o\n',
    ],
)
def test_other_ways_of_toml(source: str):
    rest = (READY / "pacheco2021-a.toml").read_text().partition("[[notch]]")
    source += "".join(rest[1:])
    robot = robot_from_text(source)
    assert robot_text(robot, source) == source
    text = robot_text(robot.with_value("tube.inner_diameter", 1.41), source)
    assert robot_from_text(text).tube == nf.Tube(1.6, 1.41)
    assert "# o" in text
    assert "# named" in text


def test_notches_as_one_array():
    notch = "{kind='arc', cut='on-axis', depth=1.4, height=0.8, uncut_length=1.2, repeat=2}"
    rest = (READY / "pacheco2021-a.toml").read_text().partition("[[tendon]]")
    rest = "".join(rest[1:]).replace("end_body = 5", "end_body = 2")
    source = (
        f"name='x'\nnotch=[{notch}] # n\n[tube]\nouter_diameter=1.62\ninner_diameter=1.4\n{rest}"
    )
    robot = robot_from_text(source)
    assert robot_text(robot, source) == source
    for path in ("notch.depth", "notch[2].depth"):
        new = robot.with_value(path, 1.3)
        assert robot_from_text(robot_text(new, source)) == new


def test_template(tmp_path: Path):
    (tmp_path / "t.toml").write_text("# mine\n" + (READY / "pacheco2021-b.toml").read_text())
    robot = nf.load_robot("pacheco2021-c")
    nf.save_robot(robot, tmp_path / "c.toml", template=tmp_path / "t.toml")
    assert (tmp_path / "c.toml").read_text().startswith("# mine\n")
    assert nf.load_robot(tmp_path / "c.toml") == robot


def test_what_cannot_be_written(tmp_path: Path):
    robot = nf.load_robot("pacheco2021-a")
    with refused("FILE_UNWRITABLE", error=nf.RobotFileError):
        nf.save_robot(robot, tmp_path / "none" / "a.toml")
    with refused("FILE_UNWRITABLE", error=nf.RobotFileError):
        nf.save_robot(robot, tmp_path)
    with refused("FILE_UNWRITABLE", error=nf.RobotFileError):
        nf.save_robot(robot, tmp_path / "a\0.toml")
    with refused("FILE_NOT_FOUND", "none.toml", error=nf.RobotFileError):
        nf.save_robot(robot, tmp_path / "a.toml", template=tmp_path / "none.toml")
    assert list(tmp_path.iterdir()) == []


def test_a_failed_write_leaves_the_file_that_is_there(tmp_path: Path, monkeypatch):
    robot = nf.load_robot("pacheco2021-a")
    file = tmp_path / "a.toml"
    nf.save_robot(robot, file)
    before = file.read_bytes()

    def fill_the_disk(path: Path, text: str, **_: object) -> None:
        path.write_bytes(text.encode()[:100])
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(Path, "write_text", fill_the_disk)
    with refused("FILE_UNWRITABLE", "No space left on device"):
        nf.save_robot(robot, file)
    assert file.read_bytes() == before
    assert list(tmp_path.iterdir()) == [file]


lengths = st.floats(1e-3, 1e3)
angles = st.floats(-360, 360)
notches = st.builds(
    nf.ArcNotch,
    cut=st.sampled_from(["on-axis", "off-axis"]),
    depth=st.floats(1e-6, 1.999),
    height=lengths,
    uncut_length=st.floats(0, 1e3),
    direction_deg=angles,
    precurvature_deg=st.floats(-30, 0),
    repeat=st.integers(1, 9),
)
strips = st.builds(
    nf.StripNotch,
    height=lengths,
    strip_thickness=st.floats(0.001, 0.4),
    depth=st.floats(1.001, 1.999),
    strip_length=st.none() | st.floats(0.5, 2.0),
    wall_width=st.none() | st.floats(0.001, 2.0),
    deflection=st.sampled_from(["large", "small"]),
    repeat=st.integers(1, 9),
)
tendons = st.builds(
    nf.Tendon,
    radius=st.floats(1e-3, 1.0),
    direction_deg=angles,
    end_body=st.none() | st.just(1),
    axial_stiffness=lengths | st.just(math.inf),
    path=st.sampled_from(["wall-arc", "straight"]),
    free_length=lengths,
)
materials = st.builds(nf.Linear, lengths, density=st.none() | lengths) | st.builds(
    nf.Superelastic, lengths, lengths, st.floats(1e-4, 0.09)
)
robots = st.builds(
    nf.Robot,
    name=st.text(
        string.digits + string.ascii_letters + string.punctuation + " " + 'äμ"\\', min_size=1
    ),
    tube=st.builds(nf.Tube, st.just(2.0), st.floats(0.1, 1.9), base_length=lengths),
    notch=st.lists(notches, min_size=1, max_size=4).map(tuple),
    tendon=st.lists(tendons, min_size=1, max_size=3).map(tuple),
    material=materials,
    friction=st.builds(nf.Frictionless)
    | st.builds(nf.Capstan, st.floats(0, 2))
    | st.builds(nf.Corner, st.floats(0, 2), turning=st.sampled_from(["slope", "chord"])),
)
rows = st.builds(
    nf.ULink,
    slot_radius=st.just(0.1),  # neighbours share it
    strip_thickness=st.floats(0.1, 0.5),
    strip_length=st.floats(0.1, 0.8),
    proximal_slot=st.sampled_from(["away", "toward"]),
    uncut_length=st.floats(0, 1e3),
    repeat=st.integers(1, 9),
)
straight = st.builds(
    nf.Tendon,
    radius=st.floats(0.5, 1.0),
    direction_deg=st.sampled_from([0.0, 180.0, 340.0]),
    path=st.sampled_from(["straight", "straight-dead", "straight-follower"]),
)
strip_robots = st.builds(
    nf.Robot,
    name=st.just("strips and links"),
    tube=st.builds(nf.Tube, st.just(2.0), st.floats(0.1, 1.9)),
    notch=st.tuples(strips, notches, rows) | st.tuples(rows, strips),
    tendon=st.lists(straight, min_size=1, max_size=3).map(tuple),
    material=materials,
    friction=st.builds(nf.Corner, st.floats(0, 2)),
)
robots |= strip_robots


@given(robot=strip_robots, data=st.data())
def test_any_notch_of_any_row_is_split_off(robot: nf.Robot, data: st.DataObject):
    number = data.draw(st.integers(1, robot.number_of_notches))
    key = "strip_length" if robot.notches[number - 1].kind == "u-link" else "height"
    new = robot.with_value(f"notch[{number}].{key}", 0.35)
    differ = [i for i, (a, b) in enumerate(zip(robot.notches, new.notches, strict=True)) if a != b]
    assert differ in ([], [number - 1])
    assert robot_from_text(robot_text(new, robot_text(robot))) == new


@given(robot=robots, other=robots)
def test_any_robot_survives_its_file_and_any_template(robot: nf.Robot, other: nf.Robot):
    text = robot_text(robot)
    assert robot_from_text(text) == robot
    other_text = robot_text(other, text)
    assert robot_from_text(other_text) == other
    assert "# mm, outer diameter of the tube" in other_text


def test_a_copy_remembers_its_comments(tmp_path: Path):
    robot = nf.load_robot("pacheco2021-a")
    changed = dataclasses.replace(robot.material, poisson_ratio=0.3)
    nf.save_robot(robot.replace(material=changed), tmp_path / "a.toml")
    assert "Wrist A of Pacheco" in (tmp_path / "a.toml").read_text()


def test_fitted_values_say_so_notch_by_notch():
    source = (READY / "pacheco2021-a.toml").read_text()
    robot = nf.load_robot("pacheco2021-a").with_values(
        {"notch[2].depth": 1.3, "tendon[1].radius": 0.69}
    )
    notes = {
        "notch[2].depth": "a.csv: 1.2 to 1.4 mm (95 %)",
        "notch[2].precurvature_deg": "a.csv: any value fits",  # as it was
        "tendon.radius": "a.csv: 0.6 to 0.7 mm (95 %)",
    }
    text = robot_text(robot, source, notes)
    assert robot_from_text(text) == robot
    assert text.count("fitted by notchflex") == 3
    first, second, third = text.split("[[notch]]")[1:]
    assert "fitted" not in first
    assert (
        "depth = 1.3  # mm; g of wrist A, Table 2; fitted by notchflex to a.csv: 1.2 to 1.4 mm "
        "(95 %) (changed from 1.40)\n"
    ) in second
    assert "# nominal: straight; fitted by notchflex to a.csv: any value fits\n" in second
    assert "depth" in third
    assert "radius = 0.69" in third
    assert "fitted by notchflex to a.csv: 0.6 to 0.7 mm (95 %) (changed from 0.70)" in third
    # a value that is changed by hand is no longer a fitted one
    by_hand = robot_text(robot.with_value("notch[2].depth", 1.2), text)
    assert "depth = 1.2  # mm; g of wrist A, Table 2 (changed from 1.40)\n" in by_hand
    assert by_hand.count("fitted by notchflex") == 2
    # and what is fitted again has one note
    again = robot_text(robot, text, {"notch[2].depth": "b.csv: 1.3 to 1.31 mm (95 %)"})
    assert again.count("1.2 to 1.4") == 0
    assert "; fitted by notchflex to b.csv: 1.3 to 1.31 mm (95 %) (changed from 1.40)" in again


def test_fitted_values_without_comments_and_without_their_key():
    bare = "\n".join(
        line.partition("#")[0].rstrip()
        for line in (READY / "pacheco2021-a.toml").read_text().splitlines()
        if not line.startswith(("base_length", "name"))
    ).replace("[tube]", 'name = "bare"\n[tube]', 1)
    robot = robot_from_text(bare)
    notes = {"tube.base_length": "a.csv: at most 0.1 mm (95 %)", "friction.coefficient": "a.csv: x"}
    text = robot_text(robot.with_value("friction.coefficient", 0.12), bare, notes)
    assert "base_length = 0.0  # fitted by notchflex to a.csv: at most 0.1 mm (95 %)\n" in text
    assert "coefficient = 0.12  # fitted by notchflex to a.csv: x\n" in text
    fresh = robot_text(robot, "", {"notch[*].depth": "a.csv: 1 to 2 mm (95 %)"})
    assert "; fitted by notchflex to a.csv: 1 to 2 mm (95 %)\n" in fresh
