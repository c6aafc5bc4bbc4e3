"""The factor on the stiffness of a notch, in closed form and by the scale of the loads."""

from __future__ import annotations

import numpy as np
import pytest

import notchflex as nf
from notchflex._jax import jax
from notchflex.mechanics.chain import assemble
from notchflex.plotting import shape_from_angles
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


LONG = [
    pytest.param(name, marks=pytest.mark.nightly)
    for name in ("pacheco2021-a-true", "liu2022", "gao2017")
]


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


def test_the_weight_stays(wrist: nf.Robot):
    robot = wrist.with_value("material.density", 6_450.0)
    masses = [assemble(robot.with_value(FACTOR, one)).body_mass for one in (1.0, 1.5)]
    np.testing.assert_allclose(masses[1], masses[0], rtol=1e-15)


def test_the_cut_is_drawn_the_same(wrist: nf.Robot):
    angles = np.full(wrist.number_of_notches, 0.2)
    plain, stiff = (
        shape_from_angles(wrist.with_value(FACTOR, factor), angles) for factor in (1.0, 1.5)
    )
    for one, other in zip(plain.flexures, stiff.flexures, strict=True):
        np.testing.assert_allclose(other.area, one.area, rtol=1e-15)


def test_it_varies_as_other_numbers_do(wrist: nf.Robot, margin):
    name, load = "notch[5].stiffness_factor", nf.Load(tension=0.2)
    factors = np.linspace(0.99, 1.01, 5)
    by_hand = [nf.solve(wrist.with_value(name, one), load).total_angle for one in factors]
    batch = nf.batch(wrist, {name: factors}, load, outputs=("total_angle",))
    angles = batch["total_angle"].ravel()
    margin.within("batch", angles - np.ravel(by_hand), 1e-11, "rad")
    bands = nf.uncertain(wrist, load, {name: 0.05, FACTOR: 0.02}, draws=8)
    assert list(bands.drawn)[1:] == [f"notch[{one}].stiffness_factor" for one in range(1, 5)]
    found = nf.differentiable(wrist, load, [name], outputs=("total_angle",))
    (slope,) = np.ravel(jax.jacfwd(found)(found.start)["total_angle"][name])
    quadratic = np.polyfit(factors - 1.0, angles, 2)
    margin.within("slope", slope / quadratic[1] - 1.0, 1e-3)  # without third powers


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
