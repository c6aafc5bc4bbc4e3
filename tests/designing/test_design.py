"""Designs against independent calculations: the marching solution, closed forms."""

from __future__ import annotations

from functools import cache

import numpy as np
import pytest
from scipy.optimize import brentq

import notchflex as nf
from oracles.wrist import A
from refusals import refused

TENSION, ANGLE = 2.0, 90.0
EQUAL = {
    "name": "equal angles",
    "robot": "pacheco2021-a",
    "variable": [{"value": "notch.depth", "lower": 1.2, "upper": 1.5, "along": "each"}],
    "load": {"pulled": {"tension": TENSION}},
    "constraint": [
        {"quantity": "notch_angle", "load": "pulled", "take": "range", "equal": 0.0},
        {"quantity": "total_angle", "load": "pulled", "equal": ANGLE},
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
    wish = {"quantity": f"{name}s", "load": "pulled", "equal": 1.0}
    with pytest.raises(nf.InputError) as caught:
        nf.design(EQUAL | {"constraint": [wish]})
    assert caught.value.code is nf.ErrorCode.UNKNOWN_NAME


def test_a_tension_may_be_a_variable():
    """Wrist A as it is bends to 60 deg under one tension; its steps do not matter."""
    wish = {"quantity": "angle", "load": "pulled", "equal": 60.0}
    variable = {"value": "load.pulled.tension", "lower": 0.2, "upper": 2.0}
    load = {"rest": {"tension": 0.1}, "pulled": {"tension": 1.0, "after": "rest", "steps": 2}}
    spec = {"robot": "pacheco2021-a", "variable": [variable], "load": load, "constraint": [wish]}
    made = nf.design(spec | {"search": {"starts": 1}})
    assert made.converged, made.reason
    assert made.wishes[0].title == "total_angle at pulled"
    bent = nf.solve(made.robot, nf.Load(tension=made.variables[0].value)).total_angle
    assert np.degrees(bent) == pytest.approx(60.0, rel=1e-6)  # of the search


def on_grid(values, grid):
    return np.abs(np.asarray(values) / grid - np.round(np.asarray(values) / grid)).max() < 1e-9


@pytest.mark.parametrize(("grid", "along"), [(0.005, "each"), (0.01, "polynomial")])
def test_lengths_on_a_grid_are_evaluated_again(grid, along):
    """The numbers are those of the robot that a shop can make, not of the one beside it."""
    least = 152.0  # wrist A has 150 deg
    variable = EQUAL["variable"][0] | {"along": along}
    limit = {"quantity": "total_angle", "load": "pulled", "lower": least}
    spec = EQUAL | {"variable": [variable], "constraint": [limit]}
    free, made = nf.design(spec), nf.design(spec, grid=grid)
    depths = [one.depth for one in made.robot.notches]
    assert on_grid(depths, grid)
    assert not on_grid([one.depth for one in free.robot.notches], grid)
    assert [len(repr(one)) <= 5 for one in depths] == [True] * 5  # 1.405, no 16 digits
    assert on_grid([one.value for one in made.variables], grid)
    angle = np.degrees(nf.solve(made.robot, nf.Load(tension=TENSION)).total_angle)
    assert made.wishes[0].achieved[0] == pytest.approx(angle, rel=1e-9)
    assert made.path.total_angle[-1] == pytest.approx(np.radians(angle), rel=1e-9)
    # A neighbour on the grid meets the limit, though the nearest one may not.
    assert made.met, made.reason
    assert angle >= least
    assert np.abs(np.array(depths) - [one.depth for one in free.robot.notches]).max() <= 1.5 * grid


def test_a_grid_that_an_exact_value_is_not_on():
    wish = {"quantity": "closing_angle", "take": "sum", "equal": 120.0}
    height = {"value": "notch.height", "lower": 0.62, "upper": 0.64}
    spec = {"robot": "pacheco2021-a", "variable": [height], "constraint": [wish]}
    exact, made = nf.design(spec), nf.design(spec, grid=0.005)
    assert exact.converged
    assert made.robot.notches[0].height == 0.625
    assert not made.converged
    assert "on a grid of 0.005 mm" in made.reason
    # Closing angles are in proportion to the height.
    wanted = 120.0 * 0.625 / exact.robot.notches[0].height
    assert made.wishes[0].achieved[0] == pytest.approx(wanted, rel=1e-6)
    with refused("UNSUPPORTED", "grid", "limits"):
        nf.design(spec, grid=0.5)
    for grid in (-0.1, np.inf):
        with refused("OUT_OF_RANGE", "grid"):
            nf.design(spec, grid=grid)
