"""The simpler models of Pacheco et al. 2021 (section 4.4) as choices of parts.

Numbers: tests/reference/pacheco_simplified.csv; model 0 full, 1 linear with friction, 2 linear
frictionless (both E 10 GPa), 3 constant-curvature kinematics under the stroke of model 0.
"""

from __future__ import annotations

import numpy as np
import pytest

import notchflex as nf
from loads import tensions
from reference_data import choose, reference
from robots import linear_copy, ready

ANGLE, LENGTH = 1e-8, 1e-7  # rad, mm


def table(name: str, model: int) -> np.ndarray:
    rows = reference("pacheco_simplified.csv")
    return choose(rows, wrist=(0, "ABC".index(name)), model=(2, model))


@pytest.mark.parametrize("model", [0, 1, 2])
@pytest.mark.parametrize("name", "ABC")
def test_model_of_forces(name, model, margin):
    robot = ready(name)
    if model > 0:
        robot = linear_copy(robot)
    if model == 2:
        robot = robot.replace(friction=nf.Frictionless())
    rows = table(name, model)
    path = nf.simulate(robot, tensions(rows[:, 1]))
    assert path.converged.all(), path.reason
    n = robot.number_of_notches
    margin.within("notch angles", path.notch_angle - np.radians(rows[:, 3 : 3 + n]), ANGLE, "rad")
    margin.within("tip", path.tip_position[:, [0, 2]] - rows[:, 9:11], LENGTH, "mm")


@pytest.mark.parametrize("name", "ABC")
def test_constant_curvature_under_the_stroke_of_the_full_model(name, margin):
    robot, rows = ready(name), table(name, 3)
    path = nf.simulate(robot, tensions(rows[:, 1]))
    angle = nf.equal_stroke(robot, path.stroke[:, 0]).notch_angle
    margin.within("notch angles", angle - np.radians(rows[:, 3 : 3 + angle.shape[1]]), ANGLE, "rad")
    tip, _ = nf.tip_from_angles(robot, angle)
    margin.within("tip", tip[:, [0, 2]] - rows[:, 9:11], LENGTH, "mm")
