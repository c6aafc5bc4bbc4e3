"""Values set by their names, as `--set` does."""

import itertools

import pytest

import notchflex as nf
from notchflex.robot import parse_assignment, set_values
from refusals import refused


@pytest.fixture
def robot() -> nf.Robot:
    return nf.load_robot("pacheco2021-a")


def test_every_part_has_names(robot: nf.Robot):
    new = robot.with_values(
        {
            "name": "other",
            "tube.outer_diameter": 1.7,
            "material.elastic_modulus": 9_000,
            "friction.wrap": "geometric",
            "tendon.axial_stiffness": 1e4,
            "tendon[1].radius": 0.8,
        }
    )
    assert new.name == "other"
    assert new.tube.outer_diameter == 1.7
    assert new.material.elastic_modulus == 9_000.0
    assert new.friction.wrap == "geometric"
    assert (new.tendon[0].axial_stiffness, new.tendon[0].radius) == (1e4, 0.8)
    assert robot == nf.load_robot("pacheco2021-a")


@pytest.mark.parametrize("number", range(1, 6))
def test_a_single_notch_is_split_from_its_group(robot: nf.Robot, number: int):
    new = robot.with_value(f"notch[{number}].depth", 1.3)
    depths = [1.4] * 5
    depths[number - 1] = 1.3
    assert [n.depth for n in new.notches] == depths
    assert sum(n.repeat for n in new.notch) == 5
    assert len(new.notch) == (2 if number in (1, 5) else 3)


@pytest.mark.parametrize("path", ["notch.depth", "notch[*].depth"])
def test_all_notches(robot: nf.Robot, path: str):
    new = robot.with_value("notch[2].height", 0.7).with_value(path, 1.3)
    assert [n.depth for n in new.notches] == [1.3] * 5
    assert [n.height for n in new.notches] == [0.8, 0.7, 0.8, 0.8, 0.8]


def test_order_does_not_matter(robot: nf.Robot):
    values = [
        ("notch[2].depth", 1.3),
        ("notch.depth", 1.35),
        ("friction.kind", "capstan"),
        ("friction.coefficient", 0.2),
        ("material.kind", "linear"),
        ("material.elastic_modulus", 7510.0),
    ]
    start = robot.replace(friction=nf.Frictionless())
    results = [set_values(start, order).robot for order in itertools.permutations(values)]
    assert all(one == results[0] for one in results)
    assert [n.depth for n in results[0].notches] == [1.35, 1.3, 1.35, 1.35, 1.35]
    assert results[0].friction == nf.Capstan(0.2)


def test_both_diameters_at_once(robot: nf.Robot):
    larger = {"tube.inner_diameter": 2.0, "tube.outer_diameter": 2.2, "tendon.radius": 1.0}
    assert robot.with_values(larger).tube == nf.Tube(2.2, 2.0)


def test_a_change_of_kind_keeps_what_is_shared_and_tells_the_rest(robot: nf.Robot):
    new, dropped = set_values(robot, {"material.kind": "linear"})
    assert new.material == nf.Linear(10_000.0, density=6450.0, allowed_strain=0.08)
    assert dropped == tuple(
        f"material.{key}"
        for key in (
            "superelastic_modulus",
            "transition_strain",
            "plastic_strain",
            "plastic_modulus",
            "plastic_exponent",
        )
    )
    new, dropped = set_values(robot, {"friction.kind": "frictionless"})
    assert new.friction == nf.Frictionless()
    assert dropped == ("friction.coefficient", "friction.wrap")
    with refused("INVALID_ROBOT", "`material.superelastic_modulus`"):
        robot.with_value("material.kind", "linear").with_value("material.kind", "superelastic")
    assert set_values(robot, {"material.kind": "superelastic"}) == (robot, ())


@pytest.mark.parametrize(
    ("path", "value", "wanted"),
    [
        ("notch[6].depth", 1.3, ["5 notches", "1 to 5"]),
        ("notch[0].depth", 1.3, ["5 notches", "1 to 5"]),
        ("tendon[2].radius", 0.7, ["1 tendon;", "1 to 1"]),
        ("notch[2].dept", 1.3, ["`notch[2].dept`", "did you mean `depth`?"]),
        ("notch.repeat", 3, ["number of notches", "robot file"]),
        ("notch[2]", 1.3, ["no single value", "notch[2].depth"]),
        ("material", 1.3, ["no single value"]),
        ("materials.elastic_modulus", 1.0, ["did you mean `material`?"]),
        ("material[1].elastic_modulus", 1.0, ["`material.elastic_modulus`"]),
        ("material.elastic", 1.0, ["`material.elastic`", "Allowed: kind, elastic_modulus"]),
        ("material.kind", "liner", ["did you mean `linear`?"]),
        ("tube.kind", "x", ["`tube.kind`", "Allowed: outer_diameter"]),
        ("notch[3].tube.outer_diameter", 1.8, ["no notch", "[notch.tube]", "tube.outer_diameter"]),
        ("notch[a].depth", 1.0, ["not the name of a value"]),
        ("", 1.0, ["not the name of a value"]),
        ("notch[2].depth", 1.7, ["`notch[2].depth`", "1.7 mm", "outer diameter"]),
        ("notch[4].depth", -1, ["`notch[4].depth`", "greater than 0"]),
        ("friction.coefficient", float("nan"), ["`friction.coefficient`", "nan"]),
        ("friction.coefficient", "much", ["`friction.coefficient`", '"much" (text)']),
    ],
)
def test_what_cannot_be_set(robot: nf.Robot, path: str, value: object, wanted: list):
    with pytest.raises(nf.InputError) as caught:
        robot.with_value(path, value)
    for words in wanted:
        assert words in str(caught.value)
    assert len(str(caught.value).splitlines()) == 1


def test_a_value_is_set_once(robot: nf.Robot):
    with refused("CONFLICT", "`notch[*].depth`"):
        set_values(robot, [("notch.depth", 1.3), ("notch[*].depth", 1.2)])


@pytest.mark.parametrize(
    ("text", "value"),
    [
        ("tube.outer_diameter=2", 2),
        ("tube.outer_diameter = .5", 0.5),
        ("material.elastic_modulus=1e4", 1e4),
        ("tendon.axial_stiffness=inf", float("inf")),
        ("friction.wrap=geometric", "geometric"),
        ('friction.wrap="geometric"', "geometric"),
        ("name=a=b", "a=b"),
        ("tendon.end_body=true", True),
    ],
)
def test_assignments(text: str, value: object):
    path, got = parse_assignment(text)
    assert path == text.partition("=")[0].strip()
    assert got == value
    assert type(got) is type(value)


@pytest.mark.parametrize("text", ["", "depth", "depth=", "=3", " = "])
def test_no_assignment(text: str):
    with refused("BAD_SYNTAX", f"`{text}`"):
        parse_assignment(text)


def test_a_number_of_thousands_of_digits_is_told():
    with refused("OUT_OF_RANGE", "the robot has 5 notches"):
        nf.load_robot("pacheco2021-a").with_value(f"notch[{'9' * 5000}].depth", 1.0)
