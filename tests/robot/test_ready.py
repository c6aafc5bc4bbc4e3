"""The robots that come with the package, against the papers' tables."""

import math

import pytest

import notchflex as nf
from notchflex.robot.reading import READY
from shared_data import measured, numbers

NAMES = [
    "disks-two-segments",
    "gao2017",
    "liu2022",
    "measured-backbone",
    "pacheco2021-a",
    "pacheco2021-a-specimen",
    "pacheco2021-a-true",
    "pacheco2021-b",
    "pacheco2021-b-specimen",
    "pacheco2021-b-true",
    "pacheco2021-c",
    "pacheco2021-c-specimen",
    "pacheco2021-c-true",
    "two-axis-wrist",
    "york2015",
]


def test_list():
    robots = nf.list_robots()
    assert list(robots) == NAMES
    assert robots["pacheco2021-a"] == "Pacheco 2021, wrist A"


@pytest.mark.parametrize("name", NAMES)
def test_every_value_has_its_source_beside_it(name: str):
    for line in (READY / f"{name}.toml").read_text().splitlines():
        if "=" in line.partition("#")[0] and not line.startswith(("name", "kind")):
            assert "#" in line, line


@pytest.mark.parametrize(
    ("wrist", "depths", "height", "uncut"),  # Pacheco 2021, Table 2
    [
        ("a", [1.4] * 5, 0.8, 1.2),
        ("b", [1.4] * 5, 0.5, 1.5),
        ("c", [1.36, 1.39, 1.42, 1.45], 1.0, 1.0),
    ],
)
@pytest.mark.parametrize("form", ["", "-specimen", "-true"])
def test_pacheco_geometry(wrist: str, form: str, depths: list, height: float, uncut: float):
    robot = nf.load_robot(f"pacheco2021-{wrist}{form}")
    assert (robot.tube.outer_diameter, robot.tube.inner_diameter) == (1.62, 1.40)
    assert [notch.depth for notch in robot.notches] == depths
    assert {notch.height for notch in robot.notches} == {height}
    assert {notch.uncut_length for notch in robot.notches} == {uncut}
    assert {notch.cut for notch in robot.notches} == {"on-axis"}
    (tendon,) = robot.tendon
    assert (tendon.radius, tendon.direction_deg) == (0.70, 0.0)
    assert tendon.end_body == robot.number_of_notches
    if form == "-true":
        # The uncut tube before the first notch is that between the notches.
        assert robot.tube.base_length == uncut
        assert (tendon.path, robot.friction.wrap) == ("straight", "geometric")
        (degrees,) = {notch.precurvature_deg for notch in robot.notches}
        assert degrees == pytest.approx(math.degrees(0.05 * height), abs=1e-4)
        assert {one.ends for one in robot.notches} == {"shell"}
    else:
        assert robot.tube.base_length == 0.0
        assert (tendon.path, robot.friction.wrap) == ("wall-arc", "whole-before")


@pytest.mark.parametrize("wrist", "abc")
def test_pacheco_table_3_and_set_196(wrist: str):
    nominal = nf.load_robot(f"pacheco2021-{wrist}")
    law = nominal.material
    assert law == nf.Superelastic(10e3, 3e3, 0.028, density=6450.0, allowed_strain=0.08)
    assert nominal.friction == nf.Capstan(0.13, wrap="whole-before")
    assert {notch.precurvature_deg for notch in nominal.notches} == {0.0}

    specimen = nf.load_robot(f"pacheco2021-{wrist}-specimen")
    law = specimen.material
    assert law.elastic_modulus == 9993.685186
    assert law.superelastic_modulus == 2994.787499
    assert law.transition_strain == 0.027869593
    assert specimen.friction.coefficient == 0.127548461


@pytest.mark.parametrize("wrist", "abc")
def test_precurvature_of_the_specimens(wrist: str):
    rows = [row for row in measured("pacheco2021_specimens.csv") if row["wrist"] == wrist.upper()]
    robot = nf.load_robot(f"pacheco2021-{wrist}-specimen")
    assert [n.precurvature_deg for n in robot.notches] == numbers(rows, "precurvature_deg")


def test_york():
    robot = nf.load_robot("york2015")
    assert robot.number_of_notches == 5
    assert {notch.cut for notch in robot.notches} == {"off-axis"}
    assert robot.tendon[0].radius == robot.tube.inner_radius
    assert robot.material.elastic_modulus == 40e3
    assert robot.friction.coefficient == 0.2


def test_liu():
    robot = nf.load_robot("liu2022")
    assert (robot.tube.outer_diameter, robot.tube.inner_diameter) == (10.0, 6.0)  # Table 2
    (row,) = robot.notch
    assert (row.strip_thickness, row.height, row.depth, row.repeat) == (1.5, 3.5, 6.9, 7)
    # the file says what the defaults are
    bare = nf.StripNotch(height=3.5, strip_thickness=1.5, depth=6.9)
    assert row.strip_length == bare.strip_length_in(robot.tube) == 8.0
    assert row.wall_width == bare.wall_width_in(robot.tube) == 4.0
    assert row.deflection == "large"
    assert [(one.radius, one.direction_deg) for one in robot.tendon] == [(4.0, 0.0), (4.0, 180.0)]
    assert {one.path for one in robot.tendon} == {"straight"}
    assert (robot.material.kind, robot.material.elastic_modulus) == ("linear", 1000.406)
    assert robot.friction == nf.Corner(0.2)


def test_gao():
    robot = nf.load_robot("gao2017")
    assert robot.number_of_notches == 27
    assert robot.notch[0].slots == 28
    assert robot.notches[0].proximal_slot == robot.notches[26].proximal_slot == "away"
    assert (robot.material.elastic_modulus, robot.friction) == (22e3, nf.Corner(0.66))
    assert robot.tube.base_length == robot.notch[0].uncut_length


def test_disks():
    """The numbers of main.cpp of tdcr-modeling."""
    robot = nf.load_robot("disks-two-segments")
    (gap,) = robot.notch
    assert (gap.kind, gap.diameter, gap.inner_diameter, gap.repeat) == ("rod", 1.4, 0.0, 20)
    assert robot.geometry.length == 400.0
    assert [tendon.end_body for tendon in robot.tendon] == [10] * 3 + [20] * 3
    assert [tendon.direction_deg % 360.0 for tendon in robot.tendon] == [90.0, 330.0, 210.0] * 2
    assert {tendon.radius for tendon in robot.tendon} == {10.0}
    assert (robot.material.elastic_modulus, robot.material.poisson_ratio) == (54e3, 0.3)


def test_two_axis_wrist():
    robot = nf.load_robot("two-axis-wrist")
    sides = [0.0, 90.0, 180.0, 270.0]
    assert [notch.direction_deg for notch in robot.notches] == sides * 2
    assert [tendon.direction_deg for tendon in robot.tendon] == sides
    assert {tendon.path for tendon in robot.tendon} == {"wall-arc"}
    assert "(example)" in robot.name
