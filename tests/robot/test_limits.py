"""Numbers far beyond any robot are refused when it is made, with the usual sentence."""

import pytest

import notchflex as nf
from refusals import refused

WRIST = nf.load_robot("pacheco2021-a")


@pytest.mark.parametrize(
    ("robot", "name", "value", "limit"),
    [
        ("pacheco2021-a", "notch.height", 1e300, "1e+06 mm"),
        ("pacheco2021-a", "notch.depth", 1e-9, "1e-06 mm"),
        ("pacheco2021-a", "notch.depth", -1.0, "0 mm"),
        ("pacheco2021-a", "tube.outer_diameter", 1e200, "1e+06 mm"),
        ("pacheco2021-a", "tube.base_length", 1e7, "1e+06 mm"),
        ("pacheco2021-a", "tendon.free_length", 1e300, "1e+06 mm"),
        ("pacheco2021-a", "tendon.direction_deg", 1e9, "3600 deg"),
        ("pacheco2021-a", "notch.direction_deg", -1e9, "-3600 deg"),
        ("pacheco2021-a", "notch.precurvature_deg", -200.0, "-180 deg"),
        ("pacheco2021-a", "material.elastic_modulus", 1e300, "1e+09 MPa"),
        ("pacheco2021-a", "material.density", 1e300, "1e+06 kg/m3"),
        ("pacheco2021-a", "friction.coefficient", 1e300, "1000"),
        ("gao2017", "notch.slot_radius", 1e300, "1e+06 mm"),
        ("gao2017", "notch.strip_thickness", 1e300, "1e+06 mm"),
        ("liu2022", "notch.strip_thickness", 1e300, "1e+06 mm"),
    ],
)
def test_huge_and_tiny_numbers_are_refused(robot, name, value, limit):
    with refused("INVALID_ROBOT", name.rpartition(".")[2], limit):
        nf.load_robot(robot).with_value(name, value)


def test_an_inextensible_tendon_stays_allowed():
    assert WRIST.with_value("tendon.axial_stiffness", float("inf")) == WRIST


@pytest.mark.parametrize("cut", ["on-axis", "off-axis"])
def test_a_notch_precurved_beyond_its_closing_is_refused_when_made(cut):
    """It was refused only when solved, between the closing angle and h / r_o."""
    robot = WRIST.with_value("notch[*].cut", cut)
    closing = float(nf.closing(robot).angle[0]) * 180.0 / 3.141592653589793
    assert robot.with_value("notch.precurvature_deg", closing - 0.01)
    with refused("INVALID_ROBOT", "`notch[1].precurvature_deg`", f"{closing:.2f} deg"):
        robot.with_value("notch.precurvature_deg", closing + 0.01)
