"""Every notch angle, tip, stroke and distal tension of wrists A, B, C under 0-3 N.

Numbers: tests/reference/pacheco_force_curves.csv (Pacheco et al. 2021, eq. 1-16, Table 3
constants, no precurvature; Lambert-W closed form, printed to ten digits), both cuts.
"""

from __future__ import annotations

import numpy as np
import pytest

import notchflex as nf
from reference_data import CUTS, choose, reference
from robots import ready

ANGLE, LENGTH, FORCE = 1e-8, 1e-7, 1e-7  # rad, mm, N


@pytest.mark.parametrize("cut", [0, 1])
@pytest.mark.parametrize("name", "ABC")
def test_force_curve(name, cut, margin):
    robot = ready(name).with_value("notch[*].cut", CUTS[cut])
    rows = choose(reference("pacheco_force_curves.csv"), cut=(0, cut), wrist=(1, "ABC".index(name)))
    path = nf.simulate(robot, nf.pull(0.0, 3.0, steps=61))

    assert path.converged.all(), path.reason
    np.testing.assert_allclose(path.tension[:, 0], rows[:, 2], rtol=0, atol=1e-14)
    n = robot.number_of_notches
    margin.within("notch angles", path.notch_angle - np.radians(rows[:, 3 : 3 + n]), ANGLE, "rad")
    margin.within("total angle", path.total_angle - np.radians(rows[:, 8]), ANGLE, "rad")
    margin.within("tip", path.tip_position[:, [0, 2]] - rows[:, 9:11], LENGTH, "mm")
    margin.within("tip out of plane", path.tip_position[:, 1], LENGTH, "mm")
    margin.within("stroke", path.stroke[:, 0] - rows[:, 11], LENGTH, "mm")
    margin.within("distal tension", path.span_tension[:, 0, -1] - rows[:, 12], FORCE, "N")


@pytest.mark.parametrize("name", "ABC")
@pytest.mark.parametrize("row", [7, 20, 33, 60])
def test_one_pull_from_rest_is_the_curve(name, row, margin):
    rows = choose(reference("pacheco_force_curves.csv"), cut=(0, 0), wrist=(1, "ABC".index(name)))
    state = nf.solve(ready(name), nf.Load(tension=rows[row, 2]))
    assert state.converged, state.reason
    n = len(state.notch_angle)
    margin.within("notch angles", state.notch_angle - np.radians(rows[row, 3 : 3 + n]), ANGLE)
    margin.within("tip", state.tip_position[[0, 2]] - rows[row, 9:11], LENGTH, "mm")


def test_tip_turns_by_the_total_angle(margin):
    path = nf.simulate(ready("A"), nf.pull(0.0, 3.0, steps=13))
    total = path.total_angle
    turned = np.zeros((len(total), 3, 3))
    turned[:, 0, 0] = turned[:, 2, 2] = np.cos(total)
    turned[:, 0, 2], turned[:, 2, 0] = np.sin(total), -np.sin(total)
    turned[:, 1, 1] = 1.0
    margin.within("tip rotation", path.tip_rotation - turned, 1e-13)
