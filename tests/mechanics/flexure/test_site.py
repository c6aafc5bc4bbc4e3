"""What surrounds a notch with elastic ends, its closing, and the dimensions that were checked."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import notchflex as nf
from fem_wrists import LINEAR, sideways, wrist
from notchflex.mechanics.chain import sites_of, unchecked_dimensions
from notchflex.mechanics.cuts import SECTION_OF_CUT
from notchflex.mechanics.ends import notch_stiffness
from notchflex.mechanics.ring import Side


def test_a_base_of_no_length_is_rigid():
    bare = replace(wrist(), tube=nf.Tube(1.62, 1.40))
    assert bare.notches[0] == bare.notches[1]
    near, far = (notch_stiffness(0.81, 0.7, "off-axis", 1.4, 0.8, 0.33, *pair) for pair in (
        (Side("clamped", 0.0), Side("between", 1.2)), (Side("between", 1.2),) * 2))  # fmt: skip
    assert 0.8 < near.weak < far.weak
    assert nf.solve(bare, nf.Load(tension=1.0)).converged


def test_dimensions_outside_the_range_are_named():
    assert unchecked_dimensions(wrist()) == []
    (sentence,) = unchecked_dimensions(wrist(depth=1.05))
    assert "depth / outer diameter is 0.648, below 0.68" in sentence
    assert "off inside, near that bound (all notches)" in sentence
    assert "`notch.stiffness_factor`" in sentence
    shallow = nf.simulate(wrist(depth=1.05), nf.Load(tension=0.5))
    from notchflex.results.path import path_warnings

    assert sentence in path_warnings(shallow)


@pytest.mark.parametrize("scale", [1.0, 10.0])
def test_a_short_ring_counts_in_proportion_to_the_tube(scale: float):
    """The same robot is told the same at any size."""

    def told(ring: float) -> list[str]:
        names = ("depth", "height", "uncut_length")
        sizes = {name: scale * getattr(wrist().notch[0], name) for name in names}
        tube = nf.Tube(1.62 * scale, 1.40 * scale, base_length=ring * scale)
        notch = replace(wrist().notch[0], **sizes)
        parts = {"tube": tube, "notch": (notch,), "tendon": (nf.Tendon(0.7 * scale),)}
        return unchecked_dimensions(replace(wrist(), **parts))

    (sentence,) = told(0.15)
    assert "ring / outer diameter is 0.0926, below 0.13: the stiffness was found up to" in sentence
    assert "(notch 1)" in sentence
    assert told(0.3) == told(0.0) == told(3.0) == []


def test_short_rings_between_notches_that_open_to_different_sides_are_named():
    turned = wrist().with_value("notch[2].direction_deg", 90.0)
    (sentence,) = unchecked_dimensions(turned)
    assert "a neighbour opens to another side" in sentence
    assert "(notches 1, 2, 3)" in sentence
    assert "1.2 mm" in sentence
    assert unchecked_dimensions(wrist().with_value("notch[2].direction_deg", 0.1 + 0.2 - 0.3)) == []


@pytest.mark.parametrize(("ends", "most"), [("shell", 8.0), ("rigid", 16.0)])
def test_an_elastic_stop(margin, ends, most):
    robot = wrist(closing="elastic", ends=ends)
    path = nf.simulate(robot, nf.pull(0.0, most, steps=17))
    assert path.converged.all()
    ring = Side("between", 1.2)
    law = notch_stiffness(0.81, 0.7, "off-axis", 1.4, 0.8, 0.33, ring, ring)
    section = SECTION_OF_CUT["off-axis"](0.81, 0.7, 1.4)
    closing = law.closing_factor * 0.8 / (0.81 + section.centroid)
    angle, force = path.notch_angle[:, 2], path.contact_force[:, 2]
    closed = force > 0.0
    assert closed.sum() >= 3
    assert (angle[~closed] < closing).all()
    stop = law.closed_ratio * LINEAR.elastic_modulus * section.second_moment_weak / law.weak
    arm = 0.8 / closing
    beyond = stop * (angle[closed] - closing)
    margin.within("moment of the stop, relative", force[closed] * arm / beyond - 1.0, 5e-11)
    rigid = nf.simulate(wrist(ends=ends), nf.Load(tension=most))
    assert rigid.notch_angle[0, 2] == pytest.approx(closing / law.closing_factor)


def test_work_is_stored_with_elastic_ends_and_stops(margin):
    path = nf.simulate(wrist(closing="elastic"), nf.pull(0.0, 8.0, steps=4001))
    work = np.trapezoid(path.tension[:, 0], path.stroke[:, 0])
    margin.within("work over stored energy", work / path.stored_energy[-1] - 1.0, 1e-6)


def test_sideways_force(margin):
    # Where the two rings of a notch differ, its torsion and its bending sideways are coupled: the
    # law leaves that out. The first notch, beside the plate, shows it.
    twist, bend, *solid = sideways(wrist())
    for name, error, allowed in (
        ("twist", twist / solid[0] - 1.0, (0.08, 0.03, 0.01)),
        ("sideways bend", bend / solid[1] - 1.0, (0.095, 0.045, 0.01)),
    ):
        parts = zip(("first", "others", "tip"), np.split(error, [1, 4]), allowed, strict=True)
        for ring, part, most in parts:
            margin.within(f"{name}, {ring}", part, most)


@pytest.mark.parametrize("across", [0, 1])
def test_rings_shift_by_the_compliance_in_shear(across, margin):
    """A force through the middle of a notch, at its centre of twist, shifts its rings alone."""
    five = wrist()
    one = replace(five, notch=(replace(five.notch[0], repeat=1),))
    site = sites_of(one)[0]
    law = notch_stiffness(0.81, 0.7, "off-axis", 1.4, 0.8, 0.33, site.proximal, site.distal)
    force = 1e-5 * np.eye(3)[across]
    middle, tip = 1.2 + 0.4, 1.2 + 0.8 + 1.2
    arm = np.array([-law.shear_centre, 0.0, middle - tip])
    state = nf.solve(one, nf.Load(tension=0.0, tip_force=force, tip_moment=np.cross(arm, force)))
    turned = state.body_rotation[-1] - np.eye(3)
    margin.within("turn, rad", turned, 1e-11)
    at_middle = state.tip_position - np.array([0.0, 0.0, tip]) + turned @ arm
    wanted = (law.shear, law.sway)[across] * 1e-5 / LINEAR.elastic_modulus
    margin.within("shift, relative", at_middle[across] / wanted - 1.0, 1e-8)
