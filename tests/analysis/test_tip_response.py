"""Jacobian and compliance of the tip: differences, symmetry, and what control needs of them."""

from __future__ import annotations

import numpy as np
import pytest

import notchflex as nf

LOAD = (0.02, 0.01, 0.0)
PATH = nf.pull(0.5, 1.6, steps=2).then(nf.pull(0.8, 0.8, steps=1)).loaded(tip_force=LOAD)


@pytest.fixture(scope="module")
def found(wrist) -> nf.TipResponse:
    return nf.tip_response(wrist, PATH)


def pose_slope(after, before, width: float) -> np.ndarray:
    """Rotation vector and translation between two states, per unit."""
    turn = (after.tip_rotation - before.tip_rotation) @ before.tip_rotation.T
    vector = 0.5 * np.array(
        [turn[2, 1] - turn[1, 2], turn[0, 2] - turn[2, 0], turn[1, 0] - turn[0, 1]]
    )
    return np.concatenate([vector, after.tip_position - before.tip_position]) / width


def test_a_response_is_shown_in_a_few_lines(found):
    lines = repr(found).splitlines()
    assert len(lines) < 8
    assert "3 steps x 6 x 1 tendons" in lines[1]


@pytest.mark.nightly
def test_compliance_against_differences(wrist, found, margin):
    width = 2e-4
    for step in (1, 2):
        for axis in range(6):
            ends = []
            for side in (0.5, -0.5):
                change = np.zeros(6)
                change[axis] = side * width
                loads = [
                    nf.Load(
                        tension=float(tension[0]),
                        tip_force=np.array(LOAD) + (change[3:] if number == step else 0.0),
                        tip_moment=change[:3] if number == step else np.zeros(3),
                    )
                    for number, tension in enumerate(PATH.tension)
                ]
                ends.append(nf.simulate(wrist, loads)[step])
            expected = pose_slope(*ends, width)
            largest = np.abs(found.compliance[step, :, axis]).max()
            own = found.compliance[step, :, axis]
            margin.within(f"column {axis}", (own - expected) / largest, 1e-4)


def test_jacobian_against_differences(wrist, found, margin):
    width = 1e-4
    for step in (1, 2):  # going on sliding, and letting go
        ends = []
        for side in (0.5, -0.5):
            tension = PATH.tension.copy()
            tension[step] += side * width
            loads = [nf.Load(tension=float(t[0]), tip_force=LOAD) for t in tension]
            ends.append(nf.simulate(wrist, loads)[step])
        expected = pose_slope(*ends, width)
        own = found.jacobian[step, :, 0]
        margin.within("jacobian", (own - expected) / np.abs(own).max(), 1e-7)


@pytest.mark.nightly
def test_without_friction_compliance_is_symmetric(wrist, margin):
    # Forces that keep their direction have a potential; moments at a bent tip have none.
    smooth = wrist.with_value("friction.kind", "frictionless")
    forces = nf.tip_response(smooth, PATH).compliance[:, 3:, 3:]
    margin.within("forces", (forces - forces.swapaxes(1, 2)) / np.abs(forces).max(), 1e-9)


def test_the_base_turns_it_all(wrist, found, margin):
    turned = nf.LoadPath(PATH.tension, PATH.stroke, np.array([0.0, 0.0, np.pi / 2]))
    plain = nf.tip_response(wrist, nf.LoadPath(PATH.tension, PATH.stroke))
    other = nf.tip_response(wrist, turned)
    quarter = np.kron(np.eye(2), np.array([[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]]))
    margin.within("compliance", other.compliance - quarter @ plain.compliance @ quarter.T, 1e-11)
    margin.within("jacobian", other.jacobian - quarter @ plain.jacobian, 1e-11)


@pytest.mark.parametrize(
    "path",
    [
        nf.pull(0.5, 0.5, steps=1)
        .loaded(tip_force=LOAD)
        .then(nf.pull(0.5, 0.5, steps=1).loaded(tip_force=(1000.0, 1.0, 0.0))),
        pytest.param(nf.stroke_path(0.5, 50.0, steps=2), marks=pytest.mark.nightly),
    ],
    ids=["by tension", "by stroke"],
)
def test_what_is_not_solved_has_none(wrist, path):
    response = nf.tip_response(wrist, path)
    assert np.isfinite(response.compliance[0]).all()
    assert np.isnan(response.compliance[1]).all()
    assert np.isnan(response.jacobian[1]).all()


# A push against the bend, before the tendon is pulled: contacts slide outward under the push alone,
# and the pull then leaves some where the push put them.
AGAINST = (-0.114, -0.024, -0.189)


def test_slopes_go_through_what_loads_did_before_the_tendons(wrist, margin):
    rubs = wrist.with_value("friction.coefficient", 0.4)
    response = nf.tip_response(rubs, nf.pull(0.373, 0.373, steps=1).loaded(tip_force=AGAINST))
    assert response.path.run.substeps[0] == 2
    width = 1e-5
    cases = {"tension": (response.jacobian[0, :, 0], 1.0, np.zeros(3))}
    for axis, push in enumerate(np.eye(3)):
        cases[f"force {axis}"] = (response.compliance[0, :, 3 + axis], 0.0, push)
    for name, (own, pull, push) in cases.items():
        ends = [
            nf.solve(rubs, nf.Load(tension=0.373 + by * pull, tip_force=AGAINST + by * push))
            for by in (0.5 * width, -0.5 * width)
        ]
        expected = pose_slope(*ends, width)
        margin.within(name, (own - expected) / np.abs(own).max(), 1e-6)


# So hard a push that the load is solved in three parts: as others come, loads before tendons, and
# these in two. What the contacts remember in between shows: slopes of the whole load were 5e-4 off.
HARD = nf.pull(0.122, 0.122, steps=1).loaded(tip_force=(0.574, -0.7, 0.597))


def test_slopes_that_nobody_knows_are_not_told(wrist):
    rubs = wrist.with_value("friction.coefficient", 0.4)
    response = nf.tip_response(rubs, HARD)
    assert response.path.converged[0]
    assert response.path.run.substeps[0] == 3
    assert np.isfinite(response.path.tip_position).all()
    assert np.isnan(response.jacobian).all()
    assert np.isnan(response.compliance).all()
