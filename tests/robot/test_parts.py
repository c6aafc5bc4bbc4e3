"""Parts made in Python: frozen, checked, compared by value."""

import copy
import dataclasses
import pickle

import numpy as np
import pytest

import notchflex as nf
from refusals import refused

TUBE = nf.Tube(1.62, 1.40)
NOTCH = nf.ArcNotch("on-axis", depth=1.4, height=0.8, uncut_length=1.2, repeat=2)


@pytest.fixture
def robot() -> nf.Robot:
    return nf.Robot("r", TUBE, (NOTCH,), (nf.Tendon(0.7),), nf.Linear(60_000.0), nf.Capstan(0.1))


def test_parts_are_values(robot: nf.Robot):
    twin = dataclasses.replace(robot)
    assert twin == robot
    assert hash(twin) == hash(robot)
    assert pickle.loads(pickle.dumps(robot)) == robot
    assert copy.deepcopy(robot) == robot
    with pytest.raises(dataclasses.FrozenInstanceError):
        robot.tube.outer_diameter = 3.0


def test_replace(robot: nf.Robot):
    other = robot.replace(material=nf.Linear(7510.0), friction=nf.Frictionless())
    assert other.material.elastic_modulus == 7510.0
    assert robot.material.elastic_modulus == 60_000.0
    with refused("INVALID_ROBOT", "`notch[1].depth`"):
        robot.replace(tube=nf.Tube(1.3, 1.2))
    with refused("INVALID_ROBOT", "`materials`", "`material`"):
        robot.replace(materials=nf.Linear(7510.0))


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: nf.Capstan(-0.1), "Capstan: `coefficient` is -0.1; it must be at least 0."),
        (
            lambda: nf.Capstan(),
            "Capstan: `coefficient` is missing; give the coefficient of friction.",
        ),
        (
            lambda: nf.Tube(1.0, 2.0),
            "Tube: `inner_diameter` is 2.0 mm; it must be less than the outer diameter, 1.0 mm.",
        ),
        (
            lambda: dataclasses.replace(NOTCH, height=float("nan")),
            "ArcNotch: `height` is nan mm; it must be a finite number.",
        ),
    ],
)
def test_messages(make, message: str):
    with pytest.raises(nf.InputError) as caught:
        make()
    assert str(caught.value) == message


def test_a_robot_needs_notches_and_tendons(robot: nf.Robot):
    with refused("INVALID_ROBOT", "`notch`"):
        robot.replace(notch=())
    with refused("INVALID_ROBOT", "`tendon`"):
        robot.replace(tendon=())
    with refused("INVALID_ROBOT", "`notch`", "10000"):
        robot.replace(notch=(dataclasses.replace(NOTCH, repeat=9_000),) * 2)
    with refused("INVALID_ROBOT", "`material.kind`"):
        robot.replace(material=nf.Capstan(0.1))


def test_problems_count_notches_from_the_base(robot: nf.Robot):
    deep = dataclasses.replace(NOTCH, depth=1.7)
    with refused("INVALID_ROBOT", "`notch[3].depth`", "1.7 mm"):
        robot.replace(notch=(NOTCH, deep))
    with refused("INVALID_ROBOT", "`notch[3]`", "[[notch]] table number 2"):
        robot.replace(notch=(NOTCH, 5))
    with refused("INVALID_ROBOT", "`notch[2]` is 5;"):
        dataclasses.replace(robot, notch=(dataclasses.replace(NOTCH, repeat=1), 5))


@pytest.mark.parametrize("number", [np.array([1, 2]), 2.0])
def test_whole_numbers_are_asked_for_whatever_comes(number):
    with refused("INVALID_ROBOT", "`repeat`"):
        dataclasses.replace(NOTCH, repeat=number)
    with refused("INVALID_ROBOT", "`end_body`"):
        nf.Tendon(0.7, end_body=number)


@pytest.mark.parametrize(
    ("name", "cited"),
    [
        ("pacheco2021-a", ["Pacheco, Gafford"]),
        ("york2015", ["Pacheco, Gafford", "York et al."]),
        ("liu2022", ["Liu et al.", "Gao et al."]),
    ],
)
def test_a_robot_names_the_papers_of_its_parts(name, cited):
    own, *papers = nf.load_robot(name).citations()
    assert own.startswith(f"notchflex {nf.__version__}")
    assert [one[: len(start)] for one, start in zip(papers, cited, strict=True)] == cited
