"""Designs against independent calculations: the marching solution, closed forms."""

from __future__ import annotations

from functools import cache

import numpy as np
import pytest
from scipy.optimize import brentq

import notchflex as nf
from oracles.wrist import A

TENSION, ANGLE = 2.0, 90.0
EQUAL = {
    "name": "equal angles",
    "robot": "pacheco2021-a",
    "variable": [{"value": "notch.depth", "lower": 1.2, "upper": 1.5, "along": "each"}],
    "state": [{"name": "pulled", "tension": TENSION}],
    "constraint": [
        {"quantity": "notch_angle", "state": "pulled", "take": "range", "equal": 0.0},
        {"quantity": "total_angle", "state": "pulled", "equal": ANGLE},
    ],
    "search": {"starts": 3, "candidates": 32},
}


@cache
def equal_angles() -> nf.Design:
    """The wrist whose notches bend alike."""
    return nf.design(EQUAL)


def test_uniform_bending_is_that_of_the_marching_solution():
    made = equal_angles()
    assert made.converged, made.reason
    state = nf.solve(made.robot, nf.Load(tension=TENSION))
    angles = state.notch_angle
    assert np.abs(angles - angles.mean()).max() < 1e-6
    # The same depths one notch after the other, each a root of the scalar equation of its notch.
    wanted = np.radians(ANGLE) / 5
    depths = [1.4] * 5
    for j in range(5):

        def off(depth: float, j: int = j) -> float:
            depths[j] = depth
            return float(A.with_(depth=tuple(depths)).pull(TENSION)[0][j]) - wanted

        depths[j] = brentq(off, 1.2, 1.38, xtol=1e-13)
    designed = np.array([one.depth for one in made.robot.notches])
    assert np.abs(designed - depths).max() < 1e-8


def test_files(tmp_path):
    made = equal_angles()
    files = made.save(tmp_path / "designed")
    assert {file.name for file in files} == {
        "robot.toml",
        "wishes.csv",
        "design.json",
        "design.svg",
    }
    assert nf.load_robot(files[0]) == made.robot
    assert "total_angle at pulled: asked 90 deg, achieved 90 deg" in files[0].read_text()


@pytest.mark.parametrize("name", ["total_angle", "bore"])
def test_unknown_names_are_refused(name):
    wish = {"quantity": f"{name}s", "state": "pulled", "equal": 1.0}
    with pytest.raises(nf.InputError) as caught:
        nf.design(EQUAL | {"constraint": [wish]})
    assert caught.value.code is nf.ErrorCode.UNKNOWN_NAME
