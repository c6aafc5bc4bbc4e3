"""What a result warns of: strains beyond what is allowed or known, and unstable shapes."""

import numpy as np

from fake_path import fake_path
from notchflex.results.path import path_warnings


def test_allowed_strain_names_notches_step_and_load():
    path = fake_path(7)
    (sentence,) = path_warnings(path)
    assert "allowed strain of 8 % in notches 1, 2, 3, 4, 5" in sentence
    assert "first at step 4 (1.5 N)" in sentence
    assert "at most 11.8 %" in sentence


def test_nothing_is_said_within_bounds_or_without_them():
    robot = fake_path(2).robot
    assert path_warnings(fake_path(2, robot=robot.with_value("material.allowed_strain", 0.2))) == []
    linear = robot.with_values({"material.kind": "linear"})
    assert linear.material.allowed_strain == 0.08  # what both kinds share is kept
    assert (
        path_warnings(fake_path(2, robot=linear.with_value("material.allowed_strain", 0.5))) == []
    )


def test_plastic_branch_of_the_material():
    robot = fake_path(2).robot.with_values(
        {"material.allowed_strain": 0.5, "material.plastic_strain": 0.06}
    )
    (sentence,) = path_warnings(fake_path(7, robot=robot))
    assert "passes 6 %, where the plastic branch begins" in sentence


def test_unstable_steps():
    path = fake_path(7)
    path.columns["stable"] = np.arange(14) != 3
    assert "1 step is unstable, first step 4 (1.5 N)" in path_warnings(path)[-1]


def test_steps_that_were_not_solved_warn_of_nothing():
    path = fake_path(7, failed=14)
    path.columns["stable"] = np.zeros(14, bool)
    assert path_warnings(path) == []


def test_coarse_strain_modes_name_the_worst_step_and_the_remedy():
    path = fake_path(7)
    path.columns["moment_error"] = np.where(np.arange(14) == 5, 0.0234, 0.01)
    sentence = path_warnings(path)[-1]
    assert "by up to 2.3 % of the largest one, at step 6 (2.5 N)" in sentence
    assert "--refinement 1" in sentence
    path.columns["moment_error"][5] = 0.01
    assert not any("strain modes" in one for one in path_warnings(path))
