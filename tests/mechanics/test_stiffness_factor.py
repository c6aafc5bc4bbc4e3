"""The factor on the stiffness of a notch, in closed form and by the scale of the loads."""

from __future__ import annotations

import numpy as np
import pytest

import notchflex as nf
from notchflex.robot import robot_from_text, robot_text

FACTOR = "notch.stiffness_factor"


def test_an_angle_falls_by_the_factor(wrist: nf.Robot, margin):
    """A linear arc with a tendon along its wall: the angle is F (r + y) h / (E I)."""
    robot = wrist.replace(material=nf.Linear(40e3), friction=nf.Frictionless())
    load = nf.Load(tension=0.5)
    angle = nf.solve(robot, load).notch_angle
    stiff = robot.with_values({FACTOR: 1.25, "notch[5].stiffness_factor": 0.8})
    expected = angle / np.array([1.25, 1.25, 1.25, 1.25, 0.8])
    margin.within("angle", nf.solve(stiff, load).notch_angle / expected - 1.0, 1e-12)


LONG = [pytest.param(name, marks=pytest.mark.nightly) for name in ("pacheco2021-a-true", "gao2017")]


@pytest.mark.parametrize("name", ["pacheco2021-a", *LONG])
def test_a_stiffer_robot_is_the_same_under_larger_loads(name: str, margin):
    """In every direction, with nitinol and friction: all forces grow in proportion."""
    robot = nf.load_robot(name)
    if robot.number_of_tendons > 1:
        robot = robot.replace(tendon=robot.tendon[:1])
    force = 2e-3 * np.array([1.0, 2.0, 0.5])
    soft, stiff = (
        nf.solve(
            robot.with_value(FACTOR, factor),
            nf.Load(tension=0.4 * factor, tip_force=factor * force),
        )
        for factor in (1.0, 1.3)
    )
    margin.within("tip", stiff.tip_position - soft.tip_position, 1e-9, "mm")
    margin.within("strain", stiff.peak_strain - soft.peak_strain, 1e-11)


def test_a_file_leaves_a_factor_of_one_out(wrist: nf.Robot):
    assert "stiffness_factor" not in robot_text(wrist)
    assert "stiffness_factor" not in robot_text(wrist, "")
    other = wrist.with_value("notch[2].stiffness_factor", 1.1)
    text = robot_text(other, "")
    assert text.count("stiffness_factor = 1.1  # factor on its stiffness in all directions") == 1
    assert robot_from_text(text) == other
    back = other.with_value("notch[2].stiffness_factor", 1.0)
    assert "stiffness_factor" not in robot_text(back, text)
    written = text.replace("stiffness_factor = 1.1", "stiffness_factor = 1.0")
    assert robot_text(robot_from_text(written), written) == written
