"""Loads out of the plane, and loads in it on a robot solved as one of space."""

from __future__ import annotations

import numpy as np
import pytest

import notchflex as nf
from levels import simulate_at
from notchflex.mechanics.cuts import annular_segment

# Never beyond its linear part; of this kind, so that programs are those of wrist A.
ELASTIC = nf.Superelastic(60_000.0, 3_000.0, 0.028, poisson_ratio=0.33)


@pytest.fixture(scope="module")
def wrist() -> nf.Robot:
    """Wrist A as the finite elements have it: cut across, linear."""
    robot = nf.load_robot("pacheco2021-a").with_value("notch.cut", "off-axis")
    return robot.replace(material=ELASTIC)


@pytest.fixture(scope="module")
def lateral(wrist):
    return nf.solve(wrist, nf.Load(tip_force=(0.0, -0.02, 0.0)))


def test_planar_robot_as_one_of_space(margin) -> None:
    robot = nf.load_robot("pacheco2021-a")
    loads = (
        nf.pull(0.0, 1.2, 4)
        .release()
        .loaded(
            tip_force=(0.04, 0.0, -0.03), tip_moment=(0.0, 0.05, 0.0), tip_point=(0.3, 0.0, 0.1)
        )
    )
    plane = nf.simulate(robot, loads).raise_if_failed()
    space = simulate_at(robot, loads, "space", loaded=True).raise_if_failed()
    assert plane.chain.level == "plane"
    assert space.chain.rods.modes > plane.chain.rods.modes
    for what, unit in (("notch_angle", "rad"), ("body_position", "mm"), ("span_tension", "N")):
        difference = getattr(space, what) - getattr(plane, what)
        margin.within(f"{what} of space and plane", difference, 1e-11, unit)


@pytest.mark.nightly
def test_twist_under_a_lateral_force_is_that_of_saint_venant(lateral, margin) -> None:
    # A force at the tube axis twists every section by its distance from the shear centre.
    section = annular_segment(0.81, 0.70, 1.40)
    shear_modulus = ELASTIC.elastic_modulus / (2 * (1 + ELASTIC.poisson_ratio))
    torque = 0.02 * float(section.shear_centre)
    by_hand = 5 * torque * 0.8 / (shear_modulus * float(section.torsion_constant))
    rotation = lateral.tip_rotation
    twist = 0.5 * (rotation[1, 0] - rotation[0, 1])
    margin.within("twist, relative to five times T h / G J", twist / -by_hand - 1.0, 1e-3)


def test_sideways_bending_under_a_lateral_force_is_that_of_the_beam(lateral, margin) -> None:
    section = annular_segment(0.81, 0.70, 1.40)
    stiffness = ELASTIC.elastic_modulus * float(section.second_moment_strong)
    start = np.arange(5) * 2.0
    # Moment F (10 - z), integrated over every notch from z to z + 0.8.
    turned = 0.02 * np.sum(0.8 * (10.0 - start) - 0.32) / stiffness
    tip = lateral.tip_rotation
    about_x = 0.5 * (tip[2, 1] - tip[1, 2])
    margin.within("turn about x, relative to the beam's", about_x / turned - 1.0, 5e-4)


def test_sideways_tendon_bends_the_strong_axis(margin) -> None:
    """A tendon at 90 deg to the only notch: M = T r about the strong axis, no friction."""
    robot = nf.Robot(
        name="one notch, tendon beside it",
        tube=nf.Tube(1.62, 1.40),
        notch=(nf.ArcNotch("off-axis", depth=1.40, height=0.8, uncut_length=1.2),),
        tendon=(nf.Tendon(0.70, direction_deg=90.0),),
        material=ELASTIC,
        friction=nf.Capstan(0.0, wrap="whole-before"),
    )
    state = nf.solve(robot, nf.Load(tension=0.05)).raise_if_failed()
    section = annular_segment(0.81, 0.70, 1.40)
    stiff = ELASTIC.elastic_modulus * float(section.second_moment_strong)
    weak = ELASTIC.elastic_modulus * float(section.second_moment_weak)
    strong_turn = 0.05 * 0.70 * 0.8 / stiff
    weak_turn = 0.05 * float(section.centroid) * 0.8 / weak
    rotation = state.tip_rotation
    vector = 0.5 * np.array([rotation[2, 1] - rotation[1, 2], rotation[0, 2] - rotation[2, 0]])
    angle = np.hypot(strong_turn, weak_turn)
    expected = np.sin(angle) / angle * np.array([-strong_turn, weak_turn])
    margin.within("turn about x and y", vector - expected, 1e-12, "rad")
