"""Jacobian and compliance of the tip: differences, symmetry, and what control needs of them."""

from __future__ import annotations

import numpy as np
import pytest

import notchflex as nf

LOAD = (0.02, 0.01, 0.0)
PATH = nf.pull(0.5, 1.6, steps=2).then(nf.pull(0.8, 0.8, steps=1)).loaded(tip_force=LOAD)


@pytest.fixture(scope="module")
def wrist() -> nf.Robot:
    return nf.load_robot("pacheco2021-a")


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
        margin.within("jacobian", (own - expected) / np.abs(own).max(), 1e-5)


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
    margin.within("compliance", other.compliance - quarter @ plain.compliance @ quarter.T, 1e-8)
    margin.within("jacobian", other.jacobian - quarter @ plain.jacobian, 1e-8)


def test_what_is_not_solved_has_none(wrist):
    response = nf.tip_response(wrist, nf.draw(0.5, 50.0, steps=2))
    assert np.isfinite(response.compliance[0]).all()
    assert np.isnan(response.compliance[1]).all()
    assert np.isnan(response.jacobian[1]).all()
