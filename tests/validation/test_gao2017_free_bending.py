"""The tendon of Gao 2017's robot pulled to 13 N and let go: tip, tensions and friction front.

Numbers: tests/reference/gao_free_bending.csv, gao_tension_profiles.csv, gao_mu_sweep.csv. Each
limit is the one of the usual strain modes, then the one of more modes.
"""

from __future__ import annotations

import numpy as np
import pytest

import notchflex as nf
from gao2017 import CONTACTS, PULLED, pulled_and_let_go, robot, tip
from reference_data import reference

# Refinements; that with more modes takes longest to compile.
MODES = [0, pytest.param(1, marks=pytest.mark.nightly)]
LENGTH = {0: 1e-4, 1: 1e-6}  # mm
ANGLE = {0: 1e-5, 1: 1e-7}  # rad
FORCE = {0: 1e-5, 1: 1e-6}  # N
# The friction at the front is the difference of two tensions over the largest it can be, which is
# 0.13 N or more in this table: an error of FORCE in both would be 1.6e-4 or 1.6e-5 of that.
PART_OF_FRICTION = {0: 1e-4, 1: 1e-5}


@pytest.mark.parametrize("refinement", MODES)
def test_tip(refinement, margin):
    rows, path = reference("gao_free_bending.csv"), pulled_and_let_go(refinement)
    assert path.converged.all(), path.reason
    np.testing.assert_allclose(path.tension[:, 0], rows[:, 1], rtol=0, atol=1e-12)
    distance = np.linalg.norm(tip(path) - rows[:, 2:4], axis=1)
    margin.within("tip", distance, LENGTH[refinement], "mm")
    margin.within("rotation", path.total_angle - rows[:, 4], ANGLE[refinement], "rad")
    margin.within("tip out of plane", path.tip_position[:, 1], 1e-12, "mm")


@pytest.mark.parametrize("refinement", MODES)
def test_tension_of_every_span(refinement, margin):
    rows, path = reference("gao_tension_profiles.csv"), pulled_and_let_go(refinement)
    error = path.span_tension[:, 0] - rows[:, 2:]
    assert error.shape == (2 * PULLED, CONTACTS + 1)
    margin.within("tension, loading", error[:PULLED], FORCE[refinement], "N")
    margin.within("tension, unloading", error[PULLED:], FORCE[refinement], "N")


@pytest.mark.parametrize("refinement", MODES)
def test_turning_of_the_tendon(refinement, margin):
    rows, path = reference("gao_free_bending.csv"), pulled_and_let_go(refinement)
    turning = path.contact_turning[:, 0].sum(axis=-1)
    margin.within("sum of turning", turning - rows[:, 6], ANGLE[refinement], "rad")


@pytest.mark.parametrize("refinement", MODES)
def test_front_of_friction(refinement, margin):
    rows = reference("gao_free_bending.csv")[PULLED:]
    m, eta = (values[PULLED:, 0] for values in pulled_and_let_go(refinement).front)
    np.testing.assert_array_equal(m, rows[:, 7])
    inside = rows[:, 7] <= CONTACTS
    np.testing.assert_array_equal(np.isnan(eta), ~inside)
    margin.within("eta", (eta - rows[:, 8])[inside], PART_OF_FRICTION[refinement])


@pytest.mark.parametrize("row", range(9))
def test_coefficient_of_friction(row, margin):
    mu, pull, y, z, angle, ratio = reference("gao_mu_sweep.csv")[row]
    other = robot().with_value("friction.coefficient", mu)
    path = nf.simulate(other, nf.pull(0.0, pull, PULLED))
    assert path.converged.all(), path.reason
    distance = np.linalg.norm(tip(path)[-1] - [y, z])
    margin.within(f"tip, mu {mu:g}", distance, LENGTH[0], "mm")
    margin.within(f"rotation, mu {mu:g}", path.total_angle[-1] - angle, ANGLE[0], "rad")
    margin.within("distal tension", path.span_tension[-1, 0, -1] - pull / ratio, FORCE[0], "N")


@pytest.mark.nightly
@pytest.mark.parametrize("mu", [0.0, 1.0])
def test_coefficient_of_friction_with_more_modes(mu, margin):
    rows = reference("gao_mu_sweep.csv")
    _, pull, y, z, angle, ratio = rows[rows[:, 0] == mu][0]
    other = robot().with_value("friction.coefficient", mu)
    # While the tendon is only pulled, long steps lead to the same state as short ones.
    path = nf.simulate(other, nf.pull(0.0, pull, 3), refinement=1)
    assert path.converged.all(), path.reason
    margin.within("tip", np.linalg.norm(tip(path)[-1] - [y, z]), LENGTH[1], "mm")
    margin.within("rotation", path.total_angle[-1] - angle, ANGLE[1], "rad")
    margin.within("distal tension", path.span_tension[-1, 0, -1] - pull / ratio, FORCE[1], "N")
